"""`milp-mpc-guided`: the same OCP along a global order of the waypoints.

What the paper's planner loses, it loses in the order of the waypoints. Here the order of the whole
swarm is searched apart (`uas_coverage_baselines.routing`) and given to the OCP as a terminal cost,
the time still to go along one's own order, and as the few waypoints that get binaries.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydantic import Field

from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Target
from uas_coverage_baselines.milp_mpc.moving_horizon import MovingHorizon
from uas_coverage_baselines.milp_mpc.options import MovingHorizonOptions, weight
from uas_coverage_baselines.milp_mpc.problem_builder import ProblemBuilder
from uas_coverage_baselines.milp_mpc.route_guide import RouteGuide, TourShape
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.world import Mode, SwarmState

_HOMING_PER_M = 0.1  # cost of a metre from home for one step, once nothing is left to visit


class GuidedOptions(MovingHorizonOptions):
    """Options of `milp-mpc-guided`."""

    waypoint_sides: int = Field(default=12, ge=4, le=16, multiple_of=4, description="H_WP")
    limit_sides: int = Field(
        default=32,
        ge=4,
        le=64,
        multiple_of=4,
        description="H_P of the limits",
    )
    early_s: float = Field(
        default=0.05,
        ge=0.0,
        le=1.0,
        description="worth of covering a waypoint a step earlier, in seconds of flight",
    )
    # in seconds, as the terminal cost is
    weight_lift: float = weight(0.02, "of the lift")
    weight_torque: float = weight(0.01, "of the torques")
    weight_rate: float = weight(0.01, "of the angular rates")
    weight_climb: float = weight(0.03, "of the climb rate")


class MilpMpcGuided(MovingHorizon[GuidedOptions]):
    """MILP-MPC with a global order as terminal cost.

    Args:
        options: see `uas-coverage planners`.
        blocks: of the OCP; those that the option `blocks` names come after them.
    """

    Options = GuidedOptions

    def __init__(self, options: GuidedOptions | None = None, blocks: Sequence[Block] = OCP) -> None:
        super().__init__(options or GuidedOptions(), blocks)
        self._weights = self.options.weights

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Start a mission: the first order is searched here, before take-off.

        Args:
            brief: the mission.
            seed: of the search.
        """
        super().reset(brief, seed)
        self._builder = ProblemBuilder(brief, self.options)
        decision_s = self.options.threads * self.options.time_limit_s
        self._guide = RouteGuide(brief, self._builder, TourShape(), decision_s)
        self._guide.begin(first_sight(brief), seed)
        self._returning: set[str] = set()

    def mode(self, name: str) -> Mode:
        """Covering while a UAS has anything left to visit."""
        return "return" if name in self._returning else "covering"

    def problem(self, swarm: SwarmState) -> PlanningProblem:
        """The OCP along the order of each UAS."""
        self._guide.update(swarm)
        ahead = self._guide.tours(swarm.active)
        index = np.concatenate(ahead).astype(np.int64)
        early = np.full(len(index), self.options.early_s)
        problem = self._builder.seen(swarm, self._weights, index, early)
        rows = np.split(np.arange(len(index)), np.cumsum([len(a) for a in ahead])[:-1])
        tours = tuple(
            self._guide.tour(name, row) for name, row in zip(swarm.active, rows, strict=True)
        )
        targets = tuple(
            Target(self._builder.home_m[name], _HOMING_PER_M) if tour is None else None
            for name, tour in zip(swarm.active, tours, strict=True)
        )
        self._returning = {n for n, t in zip(swarm.active, tours, strict=True) if t is None}
        return replace(problem, tours=tours, targets=targets)

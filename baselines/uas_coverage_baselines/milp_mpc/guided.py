"""`milp-mpc-guided`: the same OCP along a global order of the waypoints.

What the paper's planner loses, it loses in the order of the waypoints. Here the order of the whole
swarm is searched apart (`planning.routing`) and given to the OCP as a terminal cost,
the time still to go along one's own order, and as the few waypoints that get binaries.
"""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Target, TourSegment
from uas_coverage_baselines.milp_mpc.moving_horizon import MovingHorizon
from uas_coverage_baselines.milp_mpc.options import MovingHorizonOptions, weight
from uas_coverage_baselines.milp_mpc.problem_builder import ProblemBuilder
from uas_coverage_baselines.milp_mpc.route_guide import RouteGuide, TourShape
from uas_coverage_baselines.trajectory import Trajectory, TrajectoryOptions
from uas_coverage_baselines.trajectory.mission_plan import order_effort
from uas_coverage_env.entities.commands import HOME, Mode
from uas_coverage_env.mission import MissionBrief, Ways, first_sight
from uas_coverage_env.planning.routing import Routes
from uas_coverage_env.vehicle.layout import VX, VY
from uas_coverage_env.world import SwarmState

_HOMING_PER_M = 0.1  # cost of a metre from home for one step, once nothing is left to visit


class GuidedOptions(MovingHorizonOptions):
    """Options of `milp-mpc-guided`."""

    order: Literal["search", "trajectory"] = Field(
        default="search",
        description="where the order before take-off comes from: the planner's own search, or the "
        "plan of `trajectory`, whose weight of energy is then used",
    )
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
        options: see `uas-coverage planner list`.
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
        self._builder = ProblemBuilder(brief, self.options, Ways(brief))
        made = brief, self._builder, TourShape()
        if self.options.order == "trajectory":
            order, total_weight = self._order_of_trajectory(brief, seed)
            self._guide = RouteGuide(*made, total_weight)
            self._guide.take(first_sight(brief), order)
        else:
            self._guide = RouteGuide(*made)
            self._guide.begin(first_sight(brief), seed)
        self._returning: set[str] = set()
        self._next: dict[str, int] = {}

    def _order_of_trajectory(self, brief: MissionBrief, seed: int) -> tuple[Routes, float]:
        """The order of its plan, and the weight that it gives energy."""
        planner = Trajectory(TrajectoryOptions(planned_orders=3, threads=self.options.threads))
        # with whole flights, also where an autopilot is to fly the mission by legs, or in a wind
        whole: dict[str, object] = {"execution": None}
        if brief.conditions is not None:
            whole["conditions"] = brief.conditions.model_copy(update={"mean_mps": 0.0})
        planner.reset(brief.model_copy(update=whole), seed)
        assert planner.mission_plan is not None
        effort = order_effort(planner.options, len(brief.uas))
        return planner.mission_plan.order, effort.total_weight

    def mode(self, name: str) -> Mode:
        """Covering while a UAS has anything left to visit."""
        return "return" if name in self._returning else "covering"

    def target(self, name: str) -> int | None:
        """The next waypoint of its order, or home."""
        return self._next.get(name)

    def waits_for(self) -> Set[int]:
        """Waypoints that the order postpones while moving obstacles block them."""
        return self._guide.blocked

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are left out or given up, and why in a few words."""
        order = self._guide.order
        left_out = [] if order is None else order.left_out.tolist()
        return dict.fromkeys(left_out, "its order leaves it out") | super().given_up

    def problem(self, swarm: SwarmState) -> PlanningProblem:
        """The OCP along the order of each UAS."""
        self._guide.update(swarm)
        ahead = self._guide.tours(swarm.active)
        index = np.concatenate(ahead).astype(np.int64)
        early = np.full(len(index), self.options.early_s)
        problem = self._builder.seen(swarm, self._weights, index, early)
        rows = np.split(np.arange(len(index)), np.cumsum([len(a) for a in ahead])[:-1])
        self._next = {
            name: int(a[0]) if len(a) else HOME for name, a in zip(swarm.active, ahead, strict=True)
        }
        straight = [
            self._guide.tour(name, row) for name, row in zip(swarm.active, rows, strict=True)
        ]
        tours, targets = zip(
            *(self._led_round(swarm, n, t) for n, t in zip(swarm.active, straight, strict=True)),
            strict=True,
        )
        self._returning = {n for n, t in zip(swarm.active, straight, strict=True) if t is None}
        return replace(problem, tours=tours, targets=targets)

    def _led_round(
        self, swarm: SwarmState, name: str, tour: TourSegment | None
    ) -> tuple[TourSegment | None, Target | None]:
        """The tour of a UAS, or the way home of one without; by a corner where they are shaded."""
        x = swarm.x[swarm.names.index(name)]
        speed_mps = float(np.hypot(x[VX], x[VY]))
        way = self._builder.way(name, self._next[name], x[:3], speed_mps)
        aim_m = self._builder.home_m[name]
        if way is not None:
            aim_m = self._builder.aim_m(name, x[:3], way)
        # at the end of the horizon alone a place within it may be reached as late as one likes
        if tour is None or (way is not None and way.tight):
            return None, Target(aim_m, _HOMING_PER_M)
        if way is None:
            return tour, None
        aims, radius, onward = tour.aims_m.copy(), tour.radius_m.copy(), tour.onward_s.copy()
        aims[0], radius[0] = aim_m, 0.0
        onward[0] += way.onward_s
        return replace(tour, aims_m=aims, radius_m=radius, onward_s=onward), None

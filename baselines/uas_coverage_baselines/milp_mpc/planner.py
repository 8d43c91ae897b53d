"""`milp-mpc`: the paper's planner, its targets chosen by operation modes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import Field

from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Target, Weights
from uas_coverage_baselines.milp_mpc.modes import (
    ModeMemory,
    Situation,
    TargetChoice,
    target_of,
    update_modes,
)
from uas_coverage_baselines.milp_mpc.moving_horizon import MovingHorizon
from uas_coverage_baselines.milp_mpc.options import MovingHorizonOptions, weight
from uas_coverage_baselines.milp_mpc.problem_builder import ProblemBuilder
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.vehicle import DOD, VX, VZ
from uas_coverage_env.world import Mode, SwarmState


class MilpMpcOptions(MovingHorizonOptions):
    """Options of `milp-mpc`."""

    priority_per_s: float = Field(
        default=0.15,
        ge=0.0,
        le=10.0,
        description="added to a waypoint's weight per second its coverage takes off the way left",
    )
    return_detour: float = Field(
        default=2.5,
        ge=1.0,
        le=20.0,
        description="D_r,max over the distance from home to the fence's far corner",
    )
    weight_transit: float = weight(Weights.transit, "of the way to a transit target")
    weight_return_home: float = weight(Weights.return_home, "of the way home")


class MilpMpc(MovingHorizon[MilpMpcOptions]):
    """The paper's energy-aware MILP-MPC (Gasche et al., Sec. III).

    Args:
        options: see `uas-coverage planners`.
        blocks: of the OCP; those that the option `blocks` names come after them.
    """

    Options = MilpMpcOptions

    def __init__(
        self, options: MilpMpcOptions | None = None, blocks: Sequence[Block] = OCP
    ) -> None:
        super().__init__(options or MilpMpcOptions(), blocks)
        self._weights, self._choice = self.options.weights, TargetChoice()

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Start a mission; nothing is random in the planner, so the seed changes nothing."""
        super().reset(brief, seed)
        self._builder = ProblemBuilder(brief, self.options)
        self._memories = {uas.name: ModeMemory() for uas in brief.uas}

    def mode(self, name: str) -> Mode:
        """The operation mode."""
        return self._memories[name].mode.label

    def problem(self, swarm: SwarmState) -> PlanningProblem:
        """Algorithms 2 and 3, then the OCP's data."""
        situations = [self._situation(swarm, name) for name in swarm.active]
        memories = update_modes(
            [self._memories[name] for name in swarm.active],
            situations,
            self._builder.waypoints_m,
            self._planned_waypoints(),
            self._builder.blocked_waypoints(swarm),
            self._choice,
        )
        self._memories.update(zip(swarm.active, memories, strict=True))
        return self._builder.problem(
            swarm,
            self._targets(swarm, situations),
            self._weights,
            self.options.priority_per_s,
        )

    def _situation(self, swarm: SwarmState, name: str) -> Situation:
        x = swarm.x[swarm.names.index(name)]
        covering = self.plan is None or name not in self.plan.names
        return Situation(
            position_m=x[0:3],
            velocity_mps=x[VX : VZ + 1],
            dod=float(x[DOD]),
            dod_return=self._builder.dod_return(name, self.options.return_detour),
            uncovered=swarm.uncovered,
            plans_coverage=covering or bool(self._still_planned(name)),
        )

    def _still_planned(self, name: str) -> set[int]:
        if self.plan is None or name not in self.plan.names:
            return set()
        return set(np.flatnonzero(self.plan.covers[self.plan.of(name)].any(axis=0)).tolist())

    def _planned_waypoints(self) -> set[int]:
        names = () if self.plan is None else self.plan.names
        return set().union(*(self._still_planned(name) for name in names))

    def _targets(
        self, swarm: SwarmState, situations: Sequence[Situation]
    ) -> dict[str, Target | None]:
        return {
            name: target_of(
                self._memories[name],
                now,
                self._builder.home_m[name],
                self._builder.waypoints_m,
                self._builder.seconds_left(name, now.dod),
                self._builder.seconds_home(name, now.position_m),
                self._builder.horizon_m(name),
                self._weights,
            )
            for name, now in zip(swarm.active, situations, strict=True)
        }

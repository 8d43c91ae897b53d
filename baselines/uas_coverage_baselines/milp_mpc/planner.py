"""`milp-mpc`: the paper's OCP in real time, its targets chosen by operation modes or an order."""

from __future__ import annotations

from collections.abc import Sequence, Set
from typing import Literal

from pydantic import Field

from uas_coverage_baselines.milp_mpc.along_order import AlongOrder
from uas_coverage_baselines.milp_mpc.mode_problems import ModeProblems
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.own_data import with_data
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem
from uas_coverage_baselines.milp_mpc.moving_horizon import MovingHorizon
from uas_coverage_baselines.milp_mpc.options import ModeOptions, MovingHorizonOptions
from uas_coverage_env.entities.commands import Mode
from uas_coverage_env.mission import MissionBrief, Ways
from uas_coverage_env.world import SwarmState


class MilpMpcOptions(MovingHorizonOptions, ModeOptions):
    """Options of `milp-mpc`."""

    order: Literal["none", "search"] = Field(
        default="none",
        description="what a plan's end is worth: the paper's coverage alone, or the time still to "
        "go along an order of all waypoints that is searched before take-off and in flight; a "
        "second of flight then costs 1, and operation modes are not asked",
    )


class MilpMpc(MovingHorizon[MilpMpcOptions]):
    """The paper's OCP in real time: a decomposition by UAS that ends in the joint program.

    Gasche et al., Sec. III. The paper's program itself, solved to a gap, is `milp-mpc-paper`.

    Args:
        options: see `uas-coverage planner list`.
        blocks: of the OCP; those that the option `blocks` names come after them.
    """

    Options = MilpMpcOptions

    def __init__(
        self, options: MilpMpcOptions | None = None, blocks: Sequence[Block] = OCP
    ) -> None:
        super().__init__(options or MilpMpcOptions(), blocks)

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Start a mission; nothing is random but the search for an order.

        Args:
            brief: the mission.
            seed: of that search.
        """
        super().reset(brief, seed)
        self._brief = brief
        self._problems: ModeProblems | AlongOrder
        if self.options.order == "search":
            self._problems = AlongOrder(brief, self.options, seed)
        else:
            self._problems = ModeProblems(brief, self.options, Ways(brief))

    def mode(self, name: str) -> Mode:
        """The operation mode."""
        return self._problems.mode(name)

    def target(self, name: str) -> int | None:
        """The transit target or the next of the order; or home."""
        return self._problems.target(name)

    def waits_for(self) -> Set[int]:
        """Waypoints that are left alone while moving obstacles block them."""
        return self._problems.blocked

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are given up, and why in a few words."""
        return self._problems.given_up | super().given_up

    def problem(self, swarm: SwarmState) -> PlanningProblem:
        """Algorithms 2 and 3 or the order, then the OCP's data."""
        problem = self._problems.problem(swarm, self.plan)
        return with_data(problem, self.blocks, self._brief, swarm)

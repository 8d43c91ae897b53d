"""`milp-mpc`: the paper's OCP in real time, its targets chosen by operation modes."""

from __future__ import annotations

from collections.abc import Sequence, Set

from uas_coverage_baselines.milp_mpc.mode_problems import ModeProblems
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem
from uas_coverage_baselines.milp_mpc.moving_horizon import MovingHorizon
from uas_coverage_baselines.milp_mpc.options import ModeOptions, MovingHorizonOptions
from uas_coverage_env.entities.commands import Mode
from uas_coverage_env.mission import MissionBrief, Ways
from uas_coverage_env.world import SwarmState


class MilpMpcOptions(MovingHorizonOptions, ModeOptions):
    """Options of `milp-mpc`."""


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
        """Start a mission; nothing is random in the planner, so the seed changes nothing."""
        super().reset(brief, seed)
        self._by_modes = ModeProblems(brief, self.options, Ways(brief))

    def mode(self, name: str) -> Mode:
        """The operation mode."""
        return self._by_modes.mode(name)

    def target(self, name: str) -> int | None:
        """The transit target, or home in return mode."""
        return self._by_modes.target(name)

    def waits_for(self) -> Set[int]:
        """Waypoints that are left alone while moving obstacles block them."""
        return self._by_modes.blocked

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are given up, and why in a few words."""
        return self._by_modes.given_up | super().given_up

    def problem(self, swarm: SwarmState) -> PlanningProblem:
        """Algorithms 2 and 3, then the OCP's data."""
        return self._by_modes.problem(swarm, self.plan)

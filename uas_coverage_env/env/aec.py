"""The multi-agent environment in turns: one agent acts after the other (PettingZoo AEC)."""

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from pettingzoo import AECEnv
from pettingzoo.utils import BaseWrapper
from pettingzoo.utils.conversions import parallel_to_aec

from uas_coverage_env.env.parallel import CoverageParallelEnv
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import ScenarioLike
from uas_coverage_env.world import Command, SwarmState


class ChecksAtOnce(BaseWrapper[str, NDArray[np.float32], Any]):
    """Refuses an invalid action when it is given, not when the last agent has acted.

    It stands where PettingZoo's own environments have `ClipOutOfBoundsWrapper`, which accepts
    infinity and prints; finite numbers out of bounds are clipped by the environment itself.
    """

    def step(self, action: Any) -> None:
        """Take the turn of `agent_selection`; what one that has ended is asked is ignored.

        Raises:
            ValueError: The action is invalid; names agent and value, and nothing has changed.
        """
        agent = self.agent_selection
        if self.agents and (self.terminations[agent] or self.truncations[agent]):
            action = None  # as PettingZoo wants it
        elif self.agents:
            self._parallel.check_action(agent, action)
        super().step(action)

    @property
    def brief(self) -> MissionBrief:
        """See `CoverageParallelEnv.brief`."""
        return self._parallel.brief

    def swarm_state(self) -> SwarmState:
        """See `CoverageParallelEnv.swarm_state`: the same for all agents of a round."""
        return self._parallel.swarm_state()

    def action_of(self, agent: str, command: Command, *, clip: bool = False) -> Any:
        """See `CoverageParallelEnv.action_of`."""
        return self._parallel.action_of(agent, command, clip=clip)

    @property
    def _parallel(self) -> CoverageParallelEnv:
        return cast(CoverageParallelEnv, self.unwrapped)


def raw_env(
    scenario: ScenarioLike = "village", **settings: Any
) -> AECEnv[str, NDArray[np.float32], Any]:
    """The environment in turns, without checks of its own.

    Args:
        scenario: See `CoverageParallelEnv`.
        **settings: See `CoverageParallelEnv`.
    """
    return parallel_to_aec(CoverageParallelEnv(scenario, **settings))


def env(scenario: ScenarioLike = "village", **settings: Any) -> ChecksAtOnce:
    """The environment in turns; an invalid action is refused at once.

    Args:
        scenario: See `CoverageParallelEnv`.
        **settings: See `CoverageParallelEnv`.
    """
    return ChecksAtOnce(raw_env(scenario, **settings))

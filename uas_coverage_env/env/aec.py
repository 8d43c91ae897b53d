"""The multi-agent environment in turns: one agent acts after the other (PettingZoo AEC)."""

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from pettingzoo import AECEnv
from pettingzoo.utils import BaseWrapper
from pettingzoo.utils.conversions import parallel_to_aec

from uas_coverage_env.env.parallel import CoverageParallelEnv
from uas_coverage_env.scenario import ScenarioLike


class ChecksAtOnce(BaseWrapper[str, NDArray[np.float32], Any]):
    """Refuses an invalid action when it is given, not when the last agent has acted.

    It stands where PettingZoo's own environments have `ClipOutOfBoundsWrapper`, which accepts
    infinity and prints; finite numbers out of bounds are clipped by the environment itself.
    """

    def step(self, action: Any) -> None:
        """Take the turn of `agent_selection`.

        Raises:
            ValueError: The action is invalid; names agent and value, and nothing has changed.
        """
        agent = self.agent_selection
        if self.agents and not (self.terminations[agent] or self.truncations[agent]):
            cast(CoverageParallelEnv, self.unwrapped).check_action(agent, action)
        super().step(action)


def raw_env(
    scenario: ScenarioLike = "village", **settings: Any
) -> AECEnv[str, NDArray[np.float32], Any]:
    """The environment in turns, without checks of its own.

    Args:
        scenario: See `CoverageParallelEnv`.
        **settings: See `CoverageParallelEnv`.
    """
    return parallel_to_aec(CoverageParallelEnv(scenario, **settings))


def env(
    scenario: ScenarioLike = "village", **settings: Any
) -> AECEnv[str, NDArray[np.float32], Any]:
    """The environment in turns; an invalid action is refused at once.

    Args:
        scenario: See `CoverageParallelEnv`.
        **settings: See `CoverageParallelEnv`.
    """
    return ChecksAtOnce(raw_env(scenario, **settings))

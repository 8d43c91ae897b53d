"""The multi-agent environment in turns: one agent acts after the other (PettingZoo AEC)."""

from typing import Any, Unpack, cast

import numpy as np
from numpy.typing import NDArray
from pettingzoo import AECEnv
from pettingzoo.utils import BaseWrapper, OrderEnforcingWrapper
from pettingzoo.utils.conversions import parallel_to_aec_wrapper

from uas_coverage_env.env.api.parallel import CoverageParallelEnv
from uas_coverage_env.env.episode.settings import MissionKeywords, takes_settings
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario.source import ScenarioLike
from uas_coverage_env.world import Command, SwarmState


class InTurns(parallel_to_aec_wrapper[str, NDArray[np.float32], Any]):
    """PettingZoo's form in turns, with the spaces of the environment as they are.

    PettingZoo makes new mappings and warns; libraries read them all the same.
    """

    @property
    def observation_spaces(self) -> dict[str, Any]:
        """See `CoverageParallelEnv.observation_spaces`."""
        return self.env.observation_spaces

    @property
    def action_spaces(self) -> dict[str, Any]:
        """See `CoverageParallelEnv.action_spaces`."""
        return self.env.action_spaces


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


def in_turns(parallel: CoverageParallelEnv) -> AECEnv[str, NDArray[np.float32], Any]:
    """An environment in turns, without checks of its own."""
    return OrderEnforcingWrapper(InTurns(parallel))


@takes_settings
def raw_env(
    scenario: ScenarioLike = "village",
    *,
    render_mode: str | None = None,
    **settings: Unpack[MissionKeywords],
) -> AECEnv[str, NDArray[np.float32], Any]:
    """The environment in turns, without checks of its own.

    Args:
        scenario: See `CoverageParallelEnv`; likewise the others.
        render_mode: None, "rgb_array" or "human".
        action: "velocity", "acceleration", "wrench", "waypoint" (v1: "planar"); or an `ActionKind`.
        dynamics: "lpv", or "nonlinear": six degrees of freedom, powertrain, exact power.
        return_mode: The world flies a UAS home in time, whatever its actions.
        safety_filter: The world replaces commands after which a UAS could not brake in time.
        reward_weights: Mapping from reward term to weight; the other terms keep theirs.
        max_cycles: Time limit of the mission [steps]; None: the scenario's `max_steps`.
        observation: Blocks that the observation is made of, see `ObservationBlock`; the name of an
            observation (`default`, `local`, `grid`); None: those of the version.
        reward: Terms that the reward is made of, see `RewardTerm`; None: those of the version.
        disturbances: Blocks that act on the world, see `Disturbance`; None: those of the scenario;
            (): none.
        mask_in_observation: With discrete actions (`waypoint`), an observation is a dictionary of
            `observation` and `action_mask`, and the infos have no mask. For libraries that do not
            read infos.
        images_apart: An observation with pictures (`grid`) is a dictionary of `observation` and a
            uint8 `Box` (channels, rows, columns; 255 for 1) for each of them; a picture alone is
            that `Box`.
        flat_infos: Infos have `reward_terms_home` and so on instead of sub-dictionaries. For
            libraries that make an array of every info (TorchRL). None: as in the version.
    """
    return in_turns(CoverageParallelEnv(scenario, render_mode=render_mode, **settings))


@takes_settings
def env(
    scenario: ScenarioLike = "village",
    *,
    render_mode: str | None = None,
    **settings: Unpack[MissionKeywords],
) -> ChecksAtOnce:
    """The environment in turns; an invalid action is refused at once.

    Args:
        scenario: See `CoverageParallelEnv`; likewise the others.
        render_mode: None, "rgb_array" or "human".
        action: "velocity", "acceleration", "wrench", "waypoint" (v1: "planar"); or an `ActionKind`.
        dynamics: "lpv", or "nonlinear": six degrees of freedom, powertrain, exact power.
        return_mode: The world flies a UAS home in time, whatever its actions.
        safety_filter: The world replaces commands after which a UAS could not brake in time.
        reward_weights: Mapping from reward term to weight; the other terms keep theirs.
        max_cycles: Time limit of the mission [steps]; None: the scenario's `max_steps`.
        observation: Blocks that the observation is made of, see `ObservationBlock`; the name of an
            observation (`default`, `local`, `grid`); None: those of the version.
        reward: Terms that the reward is made of, see `RewardTerm`; None: those of the version.
        disturbances: Blocks that act on the world, see `Disturbance`; None: those of the scenario;
            (): none.
        mask_in_observation: With discrete actions (`waypoint`), an observation is a dictionary of
            `observation` and `action_mask`, and the infos have no mask. For libraries that do not
            read infos.
        images_apart: An observation with pictures (`grid`) is a dictionary of `observation` and a
            uint8 `Box` (channels, rows, columns; 255 for 1) for each of them; a picture alone is
            that `Box`.
        flat_infos: Infos have `reward_terms_home` and so on instead of sub-dictionaries. For
            libraries that make an array of every info (TorchRL). None: as in the version.
    """
    return ChecksAtOnce(raw_env(scenario, render_mode=render_mode, **settings))

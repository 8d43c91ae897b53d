"""The single-agent environment: one agent flies the whole swarm (Gymnasium)."""

from collections.abc import Mapping
from functools import reduce
from operator import add
from typing import Any, ClassVar, Unpack

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from uas_coverage_env.entities.state import FLYING, SWAPPING
from uas_coverage_env.env.api.documentation import Versioned
from uas_coverage_env.env.api.forms import observation_space, shown
from uas_coverage_env.env.api.spec import plain_spec
from uas_coverage_env.env.episode.express import joint_action_of
from uas_coverage_env.env.episode.infos import absent, flat
from uas_coverage_env.env.episode.sequence import MissionSequence
from uas_coverage_env.env.episode.settings import MissionKeywords, MissionSettings, takes_settings
from uas_coverage_env.env.observation.scales import K_WAYPOINTS
from uas_coverage_env.env.rendering.screen import RENDER_FPS, RENDER_MODES, Screen, offered
from uas_coverage_env.env.report import FIRST_TERM, STATUS
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.source import ScenarioLike
from uas_coverage_env.world import Command, SwarmState


class CoverageSwarmEnv(Versioned, gymnasium.Env[Any, NDArray[Any]]):
    """One agent flies several UAS that cover an area; `CoverageParallelEnv` for a single mind.

    Description:
        The mission of `CoverageParallelEnv`.

    Action Space:
        The actions of all UAS one after the other: `Box(-1, 1)` of 3 (velocity, acceleration) or 4
        (wrench) numbers for each UAS, or `MultiDiscrete` with one choice of 13 for each (waypoint).
        What is asked of a UAS that does not fly, or that the mission does not have, has no effect.

    Observation Space:
        The observations of all UAS one after the other, flying or not; zero for UAS that the
        mission does not have. With `mask_in_observation` a `Dict` of it and the masks; with
        `images_apart` of it and pictures, those of all UAS as channels of one. Of each UAS:

        {observations}

    Rewards:
        The sum over the UAS and over these terms, which is also the sum of `info["reward_terms"]`.

        {rewards}

    Infos:
        `reward_terms`, `covered` and `energy_Wh` of the swarm; `uas`, the infos of every UAS by
        name as in `CoverageParallelEnv`, with `status` -1 (absent) for UAS that the mission does
        not have; with the waypoint action `action_mask`, those of all UAS one after the other.

    Starting State:
        That of `CoverageParallelEnv`.

    Episode End:
        Terminated: no UAS flies any more, nor swaps its pack to fly again. Truncated: one still
        flies after `max_cycles` steps.

    Arguments:
        scenario: Name of a shipped scenario, path of a scenario file, a `Scenario` or its plain
            data; or what draws a scenario at each reset: the name of a family (`generated`), a
            `MissionSource`, or any function `generator(rng) -> Scenario`.
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
        render_mode: None, "rgb_array" or "human", see `CoverageParallelEnv`.

    Version History:
        v0: First version. After 0.3.0, wrenches beyond the vehicle's limits have a price.

        v1: Ways past obstacles are observed, velocities are fine near rest, waypoints can be passed
        over, and what is left open has a price (docs/versions.md).
    """

    metadata: ClassVar[dict[str, Any]] = {  # pyrefly: ignore[bad-override]
        "render_modes": offered(RENDER_MODES),
        "render_fps": RENDER_FPS,
    }

    @takes_settings
    def __init__(
        self,
        scenario: ScenarioLike = "village",
        *,
        render_mode: str | None = None,
        **settings: Unpack[MissionKeywords],
    ) -> None:
        self._spec: EnvSpec | None = None
        self._missions = MissionSequence(scenario, MissionSettings.of(settings, self.version))
        self._episode = self._missions.episode
        self._screen = Screen(self._episode.scenario, render_mode)
        self.render_mode = render_mode
        self._begun = False
        self._n_uas = n_uas = self._missions.source.room.n_uas
        self.observation_space = observation_space(self._episode.settings, n_uas)
        self.action_space = self._episode.actions.joint_space(n_uas)

    @property
    def spec(self) -> EnvSpec | None:
        """How Gymnasium made the environment; `spec.to_json()` holds the scenario, too."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        fixed = self._missions.source.fixed or self._episode.settings.max_steps is not None
        self._spec = plain_spec(spec, self._episode.max_steps if fixed else None)

    @property
    def scenario(self) -> Scenario:
        """The scenario flown; where it is drawn, `reset` comes first."""
        return self._missions.scenario

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin a new mission.

        Args:
            seed: Seeds `np_random`, with which missions are drawn, and what disturbances draw;
                None: both go on drawing.
            options: `scenario`, a scenario, its name or its file: what to fly instead of drawing.

        Raises:
            ValueError: The mission does not fit the spaces, or is none.
        """
        super().reset(seed=seed)
        self._episode = self._missions.begin(self.np_random, options, seed)
        self._begun = True
        if self.render_mode is not None:
            self._screen.begin(self._episode.scenario)
            self._see()
        return self._observation(), self._info(self._told(self._episode.report))

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Fly all UAS for one step.

        Args:
            action: Of `action_space`.

        Raises:
            ValueError: The action is invalid; names UAS and value. Nothing has changed.
            ResetNeeded: `reset` was not called before.
        """
        if not self._begun:
            raise ResetNeeded("step() before reset(): call reset() first")
        episode = self._episode
        rows = episode.actions.joint_rows(action, self._n_uas)
        for name, row, asked in zip(episode.names, rows, episode.asked, strict=False):
            episode.actions.accept(name, row, asked)
        report = episode.step()
        told = self._told(report)
        flies = any(row[STATUS] in (FLYING, SWAPPING) for row in report)
        truncated = flies and episode.steps >= episode.max_steps
        if self.render_mode is not None:
            self._see()
        reward = reduce(add, told["reward_terms"].values())
        return self._observation(), reward, not flies, truncated, self._info(told)

    @property
    def brief(self) -> MissionBrief:
        """What a planner may know of the mission: `planner.reset(env.brief, seed)`."""
        return MissionBrief.of(self.scenario)

    def swarm_state(self) -> SwarmState:
        """What a planner sees now, in arrays of its own: its commands can be learned from."""
        return self._episode.swarm_state()

    def actions_of(self, commands: Mapping[str, Command], *, clip: bool = False) -> NDArray[Any]:
        """The action that flies a planner's commands in the coming step, for imitation.

        Args:
            commands: One for each UAS that flies, see `CoverageParallelEnv.action_of`.
            clip: Whether a number beyond the range of the action becomes the end of it.

        Returns:
            Of `action_space`; zero for UAS that do not fly.

        Raises:
            ValueError: No action of this kind flies a command, or one that flies has none.
        """
        actions, moment = self._episode.actions, self._episode.moment()
        return joint_action_of(actions, moment, commands, clip, n_uas=self._n_uas).ravel()

    def action_masks(self) -> NDArray[np.bool_]:
        """The choices that exist now, of all UAS one after the other (sb3-contrib's MaskablePPO).

        Raises:
            ValueError: The action is no choice.
        """
        if not self._episode.settings.chooses:
            raise ValueError("only actions that are choices have masks; this one is continuous")
        return self._action_mask().astype(np.bool_)

    def render(self) -> Any:
        """The picture of the present state for "rgb_array"; the window for "human"."""
        if not self._begun:
            raise ResetNeeded("render() before reset(): call reset() first")
        self._screen.change(self._episode.scenario)
        return self._screen.render(self._episode.swarm_state())

    def close(self) -> None:
        """Close the window, if there is one; closing twice does no harm."""
        self._screen.close()

    def _see(self) -> None:
        self._screen.see(self._episode.positions_m)
        if self.render_mode == "human":
            self.render()

    def _observation(self) -> Any:
        """(U · V,) with rows of zeros for UAS that the mission does not have."""
        seen = self._episode.observation.ravel()
        missing = self._n_uas * self._episode.observation.shape[1] - len(seen)
        seen = np.pad(seen, (0, missing)) if missing else seen
        settings = self._episode.settings
        masks = self._action_mask() if settings.mask_in_observation else None
        return shown(settings, seen, masks, self._n_uas)

    def _action_mask(self) -> NDArray[np.int8]:
        """(U · choices,) of all UAS."""
        # a UAS that the mission does not have has no waypoint to choose
        nothing = np.full(K_WAYPOINTS, -1)
        missing = self._episode.settings.kind.masks(nothing).astype(np.int8)
        masks = [self._episode.infos.action_mask(i) for i in range(len(self._episode.names))]
        return np.concatenate(masks + [missing] * (self._n_uas - len(masks)))

    def _told(self, report: list[list[int]]) -> dict[str, Any]:
        episode = self._episode
        # not Python's `sum`, which rounds in another way than a kernel since 3.12
        sums = [reduce(add, column) for column in zip(*episode.amounts, strict=True)]
        uas = {
            name: episode.infos.of(i, row, episode.amounts[i])
            for i, (name, row) in enumerate(zip(episode.names, report, strict=True))
        }
        for name in self._missions.source.names[len(uas) :]:
            uas[name] = absent(uas[episode.names[0]], episode.settings.version.infos)
        terms = dict(zip(episode.settings.term_names, sums[FIRST_TERM:], strict=True))
        told: dict[str, Any] = {"reward_terms": terms}
        for field in episode.settings.version.infos:
            if field.of_amounts:
                told[field.name] = sums[field.column]
            elif field.of_swarm:
                told[field.name] = uas[episode.names[0]][field.name]
        told["uas"] = uas
        if episode.settings.chooses and not episode.settings.mask_in_observation:
            told["action_mask"] = self._action_mask()
        return told

    def _info(self, told: dict[str, Any]) -> dict[str, Any]:
        return flat(told) if self._episode.settings.flat_infos else told

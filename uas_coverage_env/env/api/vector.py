"""Many missions as one environment: one agent per mission flies its whole swarm (Gymnasium)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from uas_coverage_env.entities.state import ABSENT
from uas_coverage_env.env.api.documentation import Versioned
from uas_coverage_env.env.api.forms import observation_space, shown
from uas_coverage_env.env.api.spec import plain_spec
from uas_coverage_env.env.batch.batch import CoverageBatch
from uas_coverage_env.env.batch.memory import (
    SWARM_FIRST_TERM,
    SWARM_REWARD,
    swarm_column,
)
from uas_coverage_env.env.episode.infos import flat
from uas_coverage_env.env.episode.sequence import check_options
from uas_coverage_env.env.episode.settings import MissionKeywords, takes_settings
from uas_coverage_env.env.rendering.screen import RENDER_FPS, offered
from uas_coverage_env.env.rendering.tiles import BATCH_RENDER_MODES, Tiles
from uas_coverage_env.env.report import FILTERED, STATUS
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.source import ScenarioLike
from uas_coverage_env.world import Command

_MODES = {
    AutoresetMode.NEXT_STEP: "next_step",
    AutoresetMode.SAME_STEP: "same_step",
    AutoresetMode.DISABLED: "disabled",
}
_OF_EACH_MISSION = ("action_masks", "brief", "scenario", "swarm_state")

Arrays = tuple[
    Any,
    NDArray[np.float64],
    NDArray[np.bool_],
    NDArray[np.bool_],
    dict[str, Any],
]


class CoverageVectorEnv(Versioned, VectorEnv[Any, NDArray[Any], NDArray[Any]]):
    """`num_envs` missions of `CoverageSwarmEnv`, flown by one compiled call.

    Spaces, order, observations, rewards, terminations and truncations are those of
    `SyncVectorEnv` over copies of `CoverageSwarmEnv`, bit for bit.

    Scenarios:
        `scenario` may be a sequence of scenarios, each with any number of UAS, waypoints and
        obstacles. Every mission begins with a draw from it that depends on the seed of its
        sub-environment and its number since then alone; `infos["scenario"]` says which it is.
        `reset(options={"scenario": indices})` flies these instead.

        Where `scenario` is the name of a family, a `MissionSource` or a function
        `generator(rng) -> Scenario`, every mission is drawn when it begins, after an autoreset
        too: sub-environment i flies what `CoverageSwarmEnv` draws after `reset(seed=s + i)`, one
        mission after the other; `call("scenario")` has them. Drawing happens in Python and takes
        some 20 ms for a generated scenario: where most of a training would be drawing, draw a
        sequence beforehand.
        `reset(options={"scenario": ...})` takes one scenario (its name, its file), or a sequence
        with one for each sub-environment, None where it draws.

        Where fleets differ, the single spaces have room for the largest: the observation of a UAS
        that a mission does not have is zero, and its part of an action has no effect.

    Autoreset:
        `autoreset_mode` as Gymnasium defines it: `NEXT_STEP` (default), `SAME_STEP` (`final_obs`
        and `final_info` in the infos), `DISABLED` (`reset(options={"reset_mask": mask})`; a step
        with a mission that has ended raises `ResetNeeded`).

    Infos:
        Arrays with the number of the sub-environment as first axis, each with its mask `_name`:
        `reward_terms` (a dictionary of these), `covered` and `energy_Wh` of the swarm, `scenario`,
        `action_mask` with the waypoint action; and of all UAS (num_envs, U): `status` (`UasStatus`,
        -1 where a mission has no such UAS), `contact` (`ContactKind`), `contact_with`,
        `limits_exceeded`, `returning` as in `CoverageParallelEnv`, and `filtered` with the safety
        filter.

    Args:
        num_envs: How many.
        scenario: A scenario, its name or file; a sequence of these; or what draws them, see above.
        autoreset_mode: An `AutoresetMode`, or its value.
        threads: How many of numba's threads share the missions, see `CoverageBatch`.
        copy: Whether observations are arrays of their own. False: they are overwritten by the step
            after the next, which spares a copy.
        max_episode_steps: Gymnasium's name for the setting `max_cycles`; the smaller holds.
        render_mode: None; "rgb_array": `render` returns a tuple of pictures, 512 x 512 pixels each,
            as Gymnasium's wrappers ask for; "rgb_array_tiled": one array (H, W, 3) that shows the
            first 16 missions side by side; "human": a window with these (extra `human`).
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

    Raises:
        ValueError: An argument is none of what is allowed; says what is.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012  # as Gymnasium declares it
        "render_modes": offered(BATCH_RENDER_MODES),
        "render_fps": RENDER_FPS,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    @takes_settings
    def __init__(
        self,
        num_envs: int = 1,
        scenario: ScenarioLike | Sequence[str | Path | Scenario] = "village",
        *,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        copy: bool = True,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        **settings: Unpack[MissionKeywords],
    ) -> None:
        try:
            mode = AutoresetMode(autoreset_mode)
        except ValueError as error:
            allowed = ", ".join(mode.value for mode in AutoresetMode)
            raise ValueError(
                f"autoreset_mode is {autoreset_mode!r}; it is one of {allowed}"
            ) from error
        if max_episode_steps is not None:
            cycles = settings.get("max_cycles") or max_episode_steps
            settings["max_cycles"] = min(cycles, max_episode_steps)
        self._spec: EnvSpec | None = None
        self._batch = CoverageBatch(
            num_envs,
            scenario,
            autoreset=_MODES[mode],
            threads=threads,
            version=self.version,
            **settings,
        )
        self.metadata = {**self.metadata, "autoreset_mode": mode}
        self.autoreset_mode = mode
        self.num_envs = self._batch.num_envs
        self.render_mode = render_mode
        self._tiles = Tiles(self.num_envs, render_mode)
        self.copy = copy
        self._begun = False
        self._same_step = mode == AutoresetMode.SAME_STEP
        self._masks_seen = self._batch.settings.mask_in_observation
        self._all = np.ones(self.num_envs, dtype=np.bool_)
        self._all.flags.writeable = False
        self._attributes: dict[str, tuple[Any, ...]] = {}
        n_uas = self._batch.n_uas
        self.single_observation_space = observation_space(self._batch.settings, n_uas)
        self.single_action_space = self._batch.actions.joint_space(n_uas)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    @property
    def spec(self) -> EnvSpec | None:
        """How Gymnasium made the environment; `spec.to_json()` holds the scenarios, too."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        limits = {scenario.max_steps for scenario in self._batch.pool.scenarios}
        fixed = self._batch.settings.max_steps is not None or not self._batch.pool.draws
        self._spec = plain_spec(spec, limits.pop() if fixed and len(limits) == 1 else None)

    @property
    def batch(self) -> CoverageBatch:
        """What flies: states, reports and scenarios as arrays."""
        return self._batch

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Begin new missions.

        Args:
            seed: A number s seeds sub-environment i with s + i; or one seed for each, None where
                it goes on drawing as it did. Only the draw of scenarios is random.
            options: `reset_mask`, (num_envs,) of bool, which to begin anew; `scenario`, what to fly
                instead of drawing, see above. Others are ignored.

        Raises:
            ValueError: An argument is wrong.
        """
        if isinstance(seed, int):
            super().reset(seed=seed)
        options = options or {}
        check_options(options, "reset_mask", "scenario")
        mask = options.get("reset_mask")
        if mask is None:
            mask = self._all
        elif not isinstance(mask, np.ndarray) or not mask.any():
            raise ValueError(f"reset_mask is {mask!r}; give an array with one true value at least")
        observation = self._batch.reset(seed, mask=mask, scenarios=options.get("scenario"))
        self._tiles.forget(np.flatnonzero(mask).tolist())
        self._watch()
        learners, swarm = self._batch.learners, self._batch.lanes.swarm
        return self._shown(observation), self._infos(
            learners.report, swarm, learners.candidates, mask
        )

    def step(self, actions: NDArray[Any]) -> Arrays:
        """Fly every mission for one step.

        Args:
            actions: Of `action_space`.

        Raises:
            ValueError: An action is invalid; names sub-environment (lane), UAS and value. Nothing
                has changed.
            ResetNeeded: `reset` was not called before, or not after a mission ended (`DISABLED`).
        """
        observation = self._batch.step(actions)
        self._watch()
        lanes = self._batch.lanes
        learners = self._batch.learners
        infos = self._infos(learners.report, lanes.swarm, learners.candidates, self._all)
        ended = lanes.terminated | lanes.truncated
        rewards = lanes.swarm[:, SWARM_REWARD].copy()
        if self._same_step and ended.any():
            rewards[ended] = self._batch.missions.final.swarm[ended, SWARM_REWARD]
            self._add_final(infos, ended)
        return (
            self._shown(observation),
            rewards,
            lanes.terminated.copy(),
            lanes.truncated.copy(),
            infos,
        )

    def action_masks(self) -> NDArray[np.bool_]:
        """(num_envs, U · choices) the choices that exist now.

        Raises:
            ValueError: The action is no choice.
        """
        if not self._batch.chooses:
            raise ValueError("only actions that are choices have masks; this one is continuous")
        return self._batch.action_masks().reshape(self.num_envs, -1)

    def actions_of(
        self, commands: Sequence[Mapping[str, Command]], *, clip: bool = False
    ) -> NDArray[Any]:
        """The actions that fly planners' commands, see `CoverageSwarmEnv.actions_of`.

        Args:
            commands: Of each mission; empty where it has ended.
            clip: Whether a number beyond the range of the action becomes the end of it.

        Returns:
            Of `action_space`.

        Raises:
            ValueError: No action of this kind flies a command, or one that flies has none.
        """
        return self._batch.actions_of(commands, clip=clip).reshape(self.num_envs, -1)

    def render(self) -> Any:
        """A tuple of pictures, one of each mission, or one picture of many, see `render_mode`.

        Raises:
            ResetNeeded: `reset` was not called before.
        """
        if self.render_mode is not None and not self._begun:
            raise ResetNeeded("render() before reset(): call reset() first")
        return self._tiles.render(self._batch.swarm_state)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """What every sub-environment answers, a tuple.

        Args:
            name: `scenario`, `brief`, `action_masks`, `swarm_state`, what was set, or what all
                share.
            *args: For a function.
            **kwargs: For a function.

        Raises:
            AttributeError: There is nothing of this name.
        """
        if name in self._attributes:
            return self._attributes[name]
        if name in _OF_EACH_MISSION:
            answer = {
                "action_masks": lambda: tuple(self.action_masks()),
                "brief": lambda: tuple(map(self._batch.brief_of, range(self.num_envs))),
                "scenario": lambda: tuple(map(self._batch.scenario_of, range(self.num_envs))),
                "swarm_state": lambda: tuple(map(self._batch.swarm_state, range(self.num_envs))),
            }[name]
            return answer(*args, **kwargs)
        return (getattr(self, name),) * self.num_envs

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """See `call`."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Give every sub-environment an attribute for `get_attr`: a list has one value for each.

        Raises:
            ValueError: The name belongs to all of them, or the number of values is wrong.
        """
        if name in _OF_EACH_MISSION or hasattr(self, name):
            raise ValueError(f"{name} is shared by all missions; make another environment")
        if not isinstance(values, list | tuple):
            values = [values] * self.num_envs
        if len(values) != self.num_envs:
            raise ValueError(f"{len(values)} values of {name} for {self.num_envs} environments")
        self._attributes[name] = tuple(values)

    def close_extras(self, **kwargs: Any) -> None:
        """Close the window, if there is one."""
        if hasattr(self, "_tiles"):  # else its making has failed, and Gymnasium closes it
            self._tiles.close()

    def _shown(self, observation: NDArray[np.float32]) -> Any:
        seen = observation.reshape(self.num_envs, -1)
        seen = seen.copy() if self.copy else seen
        masks = self.action_masks() if self._masks_seen else None
        return shown(self._batch.settings, seen, masks, self._batch.n_uas)

    def _infos(
        self,
        report: NDArray[np.int64],
        swarm: NDArray[np.float64],
        candidates: NDArray[np.int64],
        mask: NDArray[np.bool_],
    ) -> dict[str, Any]:
        """Infos with their masks; zero where the mask is not set."""
        if not mask.all():
            report, swarm = report * mask[:, None, None], swarm * mask[:, None]
        else:
            report, swarm = report.copy(), swarm.copy()
        terms: dict[str, Any] = {}
        for column, name in enumerate(self._batch.settings.term_names, SWARM_FIRST_TERM):
            terms[name] = swarm[:, column]
        absent = report[:, :, STATUS] == ABSENT
        infos: dict[str, Any] = {"reward_terms": terms}
        for field in self.version.infos:
            if field.of_amounts:
                infos[field.name] = swarm[:, swarm_column(field.column)]
            elif field.of_swarm:
                told = report[:, 0, field.column]
                infos[field.name] = told > 0 if field.flag else told
        infos["scenario"] = self._batch.lanes.scenario * mask
        for field in self.version.infos:
            if not (field.of_amounts or field.of_swarm):
                column = report[:, :, field.column]
                told = column > 0 if field.flag else column
                infos[field.name] = np.where(absent, field.absent, told) if field.absent else told
        if self._batch.filters:
            infos["filtered"] = report[:, :, FILTERED] > 0
        if self._batch.chooses and not self._masks_seen:
            infos["action_mask"] = self._masks_of(candidates) * mask[:, None].astype(np.int8)
        if self._batch.settings.flat_infos:
            infos = flat(infos)
        else:
            terms.update({f"_{name}": mask for name in terms})
        infos.update({f"_{name}": mask for name in infos})
        return infos

    def _masks_of(self, candidates: NDArray[np.int64]) -> NDArray[np.int8]:
        masks = self._batch.actions.kind.masks(candidates)
        return masks.reshape(self.num_envs, -1).astype(np.int8)

    def _add_final(self, infos: dict[str, Any], ended: NDArray[np.bool_]) -> None:
        final = self._batch.missions.final
        final_obs = np.full(self.num_envs, None, dtype=object)
        masks = self._masks_of(final.candidates) if self._masks_seen else None
        for lane in np.flatnonzero(ended):
            seen = final.observation[lane].ravel().copy()
            mask = None if masks is None else masks[lane]
            final_obs[lane] = shown(self._batch.settings, seen, mask, self._batch.n_uas)
        infos["final_obs"], infos["_final_obs"] = final_obs, ended
        infos["final_info"] = self._infos(final.report, final.swarm, final.candidates, ended)
        infos["_final_info"] = ended

    def _watch(self) -> None:
        """Remember where the UAS are, for pictures with their paths; show them in the window."""
        if self.render_mode is None:
            return
        batch = self._batch
        self._begun = True
        self._tiles.see(batch.lanes.mission.tolist(), batch.scenario_of, batch.worlds.x[:, :, :3])
        if self.render_mode == "human":
            self.render()

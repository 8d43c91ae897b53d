"""Missions as Stable-Baselines3 wants them: every UAS of every mission is a lane of one `VecEnv`.

All UAS share one policy. Wrappers around a PettingZoo environment do the same, but cannot be seeded
and never say that an episode was cut, so that the value of its last state is lost.
"""

import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices

from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env import ActionKind, CoverageBatch
from uas_coverage_env.env.api.forms import observation_space, shown
from uas_coverage_env.env.batch.state_dict import check_like, check_values
from uas_coverage_env.env.rendering.tiles import Tiles
from uas_coverage_env.env.report import STATUS
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.source import ScenarioLike


class CoverageVecEnv(VecEnv):
    """`num_missions` missions of U UAS each: lane m · U + i is UAS i of mission m.

    Episodes of a lane:
        The episode of a UAS ends when it has landed or is lost (terminated), or when the mission is
        cut while it flies (truncated: `infos[lane]["TimeLimit.truncated"]` is True, and learners
        add the value of what comes after). In both cases `dones` is True, and the info has
        `terminal_observation` and, as `Monitor` would write it, `episode` (return, length, time).

        A UAS that has ended before its mission waits: its reward is 0, its observation stays, its
        actions have no effect, and `alive` is False before a step, `flew` after it. A mission
        begins anew in the step in which it ends; then `dones` is True for the waiting ones, too, so
        that nothing is carried over from the mission before, but there is no `episode` to count.
        The same holds for UAS that the scenario of a mission does not have, where scenarios of
        different fleets are mixed; their observation is zero. `training.rollouts` keeps all of
        these rows from learners, and from the count of steps.

    Seeds:
        `seed(s)` seeds the draw of scenarios of mission m with s + m, at the next reset; the
        missions themselves hold nothing random.

    Observations are overwritten in the step after the next; Stable-Baselines3 has copied them by
    then.

    Args:
        num_missions: How many.
        scenario: A scenario, its name or file, a sequence of these to draw from, or what draws
            them, see `CoverageVectorEnv`.
        action: A name of `uas_coverage_env.env.ACTION_NAMES`, or an `ActionKind`.
        render_mode: None; "rgb_array": `render` returns one picture of the first 16 missions side
            by side, as `VecVideoRecorder` asks for; "human": a window with it (extra `human`).
        **settings: See `uas_coverage_env.env.CoverageBatch`: dynamics, return_mode, safety_filter,
            reward_weights, max_cycles, observation, mask_in_observation and images_apart (then
            "MultiInputPolicy"; "CnnPolicy" for a picture alone).

    Attributes:
        autoreset_mode: A mission that ends begins anew in the same step.
        batch: What flies.
        num_missions: As given.
        n_uas: U, of the largest fleet.

    Raises:
        ValueError: An argument is none of what is allowed.
    """

    def __init__(
        self,
        num_missions: int,
        scenario: ScenarioLike | Sequence[str | Path | Scenario] = "village",
        *,
        action: str | ActionKind = "velocity",
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        self.batch = CoverageBatch(
            num_missions, scenario, action=action, autoreset="same_step", **settings
        )
        self.num_missions = self.batch.num_envs
        self.n_uas = self.batch.n_uas
        shape = (self.num_missions, self.n_uas)
        self._returns = np.zeros(shape)
        self._lengths = np.zeros(shape, dtype=np.int64)
        self._flew = np.zeros(shape, dtype=np.bool_)
        self._actions: NDArray[Any] = np.zeros(0)
        self._begun_s = time.perf_counter()
        self._attributes: dict[str, list[Any]] = {}
        tiled = "rgb_array_tiled" if render_mode == "rgb_array" else render_mode
        self._tiles = Tiles(self.num_missions, tiled)
        self._shows = render_mode
        super().__init__(
            self.num_missions * self.n_uas,
            observation_space(self.batch.settings),
            self.batch.actions.space(),
        )

    autoreset_mode = AutoresetMode.SAME_STEP

    @property
    def alive(self) -> NDArray[np.bool_]:
        """(num_envs,) where the UAS is flying, and so acts in the coming step."""
        return self.batch.deciding.reshape(-1)

    @property
    def flew(self) -> NDArray[np.bool_]:
        """(num_envs,) where the UAS flew in the latest step: rows that hold a decision."""
        return self._flew.reshape(-1)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the draw of scenarios at the next reset; None: with a number of no meaning."""
        if seed is None:
            seed = int(np.random.default_rng().integers(2**32))
        self._seeds = [int(seed) + lane // self.n_uas for lane in range(self.num_envs)]
        return self._seeds

    def reset(self) -> Any:
        """Begin new missions in all lanes."""
        seeds = self._seeds[:: self.n_uas]
        observation = self.batch.reset(seeds)
        self._reset_seeds()
        self._reset_options()
        self._returns[:] = 0.0
        self._lengths[:] = 0
        self._tiles.forget(range(self.num_missions))
        self._watch()
        return self._flat(observation)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take the actions of all lanes, (num_envs, size), or (num_envs,) choices."""
        self._actions = actions

    def step_wait(
        self,
    ) -> tuple[Any, NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Fly all missions for one step.

        Raises:
            ValueError: An action is not finite or of a wrong shape; nothing has changed.
        """
        batch = self.batch
        flew = batch.deciding
        observation = batch.step(self._actions.reshape(self.num_missions, -1))
        self._flew = flew
        self._watch()
        lanes = batch.lanes
        over = (lanes.terminated | lanes.truncated)[:, None]
        # of a mission that is over, the world shows the next one already
        flies = np.where(over, batch.missions.final.report[:, :, STATUS] == FLYING, batch.flying)
        ended = (flew & ~flies) | over
        self._returns += lanes.rewards
        self._lengths += flew
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        if ended.any():
            for lane, i in np.argwhere(ended).tolist():
                info = infos[lane * self.n_uas + i]
                info["terminal_observation"] = self._last_seen(lane, i, bool(over[lane, 0]))
                info["TimeLimit.truncated"] = bool(flies[lane, i])
                if flew[lane, i]:
                    info["episode"] = self._episode(lane, i)
            self._returns[ended] = 0.0
            self._lengths[ended] = 0
        rewards = lanes.rewards.astype(np.float32).reshape(-1)
        return self._flat(observation), rewards, ended.reshape(-1), infos

    def action_masks(self) -> NDArray[np.bool_]:
        """(num_envs, choices) which choices exist now, for sb3-contrib's MaskablePPO.

        Raises:
            AttributeError: The action is not "waypoint".
        """
        self._check_choices()
        masks = self.batch.action_masks()
        return masks.reshape(self.num_envs, -1)

    def state_dict(self) -> dict[str, NDArray[Any]]:
        """All that changes from step to step, in arrays: enough to go on bit for bit."""
        return {
            **self.batch.state_dict(),
            "episode_returns": self._returns.copy(),
            "episode_lengths": self._lengths.copy(),
        }

    def load_state_dict(self, state: Mapping[str, NDArray[Any]]) -> Any:
        """Go on where an environment of the same arguments was.

        Returns:
            The observations of all lanes, as the latest step or reset gave them.

        Raises:
            ValueError: See `CoverageBatch.load_state_dict`.
        """
        own = {"episode_returns": self._returns, "episode_lengths": self._lengths}
        given = {name: array for name, array in state.items() if name in own}
        check_like(given, own)
        check_values(given, {"episode_lengths": (0, np.inf)})
        self.batch.load_state_dict({k: v for k, v in state.items() if k not in own})
        for name, array in own.items():
            array[:] = state[name]
        return self._flat(self.batch.observation)

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute of some lanes: `scenario`, `alive`, `flew`, one that was set, or a common.

        Raises:
            AttributeError: There is no such attribute.
        """
        lanes = list(self._get_indices(indices))
        if attr_name in self._attributes:
            return [self._attributes[attr_name][lane] for lane in lanes]
        if attr_name == "scenario":
            return [self.batch.scenario_of(lane // self.n_uas) for lane in lanes]
        if attr_name in ("alive", "flew"):
            of_lanes = getattr(self, attr_name).tolist()
            return [of_lanes[lane] for lane in lanes]
        if attr_name == "render_mode":
            return [self._shows] * len(lanes)
        if attr_name == "action_masks":
            self._check_choices()
        value = getattr(self, attr_name)
        return [value] * len(lanes)

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Give some lanes an attribute for `get_attr`; it has no effect on the missions.

        Raises:
            AttributeError: The name is one of the environment's own, which all lanes share.
        """
        if attr_name == "scenario" or hasattr(self, attr_name):
            raise AttributeError(f"{attr_name} belongs to all environments; make others")
        values = self._attributes.setdefault(attr_name, [None] * self.num_envs)
        for lane in self._get_indices(indices):
            values[lane] = value

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: VecEnvIndices = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Call a method for some lanes: `action_masks` is the only one.

        Raises:
            AttributeError: There is no such method.
        """
        if method_name != "action_masks":
            raise AttributeError(
                f"environments have no method {method_name!r}; they have action_masks"
            )
        masks = self.action_masks(*method_args, **method_kwargs)
        return [masks[lane] for lane in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type[Any], indices: VecEnvIndices = None) -> list[bool]:
        """Whether lanes have what a wrapper adds: episodes are told as `Monitor` tells them."""
        return [wrapper_class is Monitor for _ in self._get_indices(indices)]

    def render(self, mode: str | None = None) -> Any:
        """One picture of the first missions for "rgb_array"; the window for "human".

        Args:
            mode: Without effect: `render_mode` is said once.
        """
        return self._tiles.render(self.batch.swarm_state)

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """What `render` shows, as the only picture."""
        return [self.render()]

    def close(self) -> None:
        """Close the window, if there is one."""
        self._tiles.close()

    def _watch(self) -> None:
        """Remember where the UAS are, for pictures with their paths; show them in the window."""
        if self._shows is None:
            return
        batch = self.batch
        self._tiles.see(batch.lanes.mission.tolist(), batch.scenario_of, batch.worlds.x[:, :, :3])
        if self._shows == "human":
            self.render()

    def _last_seen(self, lane: int, i: int, over: bool) -> Any:
        """What a UAS that ends has seen last; of a mission that is over, the next one is flown."""
        batch = self.batch
        last = batch.missions.final.observation if over else batch.observation
        seen = last[lane, i].copy()
        if batch.settings.mask_in_observation:
            kept = batch.missions.final.candidates if over else batch.learners.candidates
            return shown(batch.settings, seen, batch.actions.kind.masks(kept[lane, i]))
        return shown(batch.settings, seen)

    def _flat(self, observation: NDArray[np.float32]) -> Any:
        seen = observation.reshape(self.num_envs, -1)
        settings = self.batch.settings
        return shown(settings, seen, self.action_masks() if settings.mask_in_observation else None)

    def _episode(self, lane: int, i: int) -> dict[str, float]:
        return {
            "r": float(self._returns[lane, i]),
            "l": int(self._lengths[lane, i]),
            "t": time.perf_counter() - self._begun_s,
        }

    def _check_choices(self) -> None:
        if not self.batch.chooses:
            raise AttributeError("only actions that are choices have masks; this one is continuous")

    def _get_indices(self, indices: VecEnvIndices) -> Iterable[int]:
        return super()._get_indices(indices)

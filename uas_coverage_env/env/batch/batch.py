"""Many missions side by side in arrays: one compiled call flies all of them for one step."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Unpack

import numba
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from uas_coverage_env.entities.state import FLYING, STATE
from uas_coverage_env.env.actions.given import accept_of_lanes
from uas_coverage_env.env.batch.call import BatchCall
from uas_coverage_env.env.batch.checkpoint import changing, checked
from uas_coverage_env.env.batch.drawn import pool_of
from uas_coverage_env.env.batch.memory import (
    AUTORESET,
    DISABLED,
    DRAW,
    FLY,
    REST,
    SAME_STEP,
    SubEnvironments,
    lanes_at_once,
    new_missions,
)
from uas_coverage_env.env.batch.scenes import change_scenes, install_scenes
from uas_coverage_env.env.batch.source import lane_seeds
from uas_coverage_env.env.batch.state_dict import (
    check_like,
    fields_of,
    records_of,
)
from uas_coverage_env.env.episode.act import refuse_what_it_wrote
from uas_coverage_env.env.episode.express import Moment, joint_action_of
from uas_coverage_env.env.episode.memory import LEARNERS, TABLES, Learners
from uas_coverage_env.env.episode.observe import observing_of
from uas_coverage_env.env.episode.settings import MissionKeywords, MissionSettings, takes_settings
from uas_coverage_env.env.episode.step import ACCEPTED
from uas_coverage_env.env.versions import V0, Version, version_named
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.source import ScenarioLike
from uas_coverage_env.simulation.world import swarm_state
from uas_coverage_env.world import Command, SwarmState, WorldState
from uas_coverage_env.world.arena import ARENA

_MOST_LANES = 2**20


class CoverageBatch:
    """Missions in L lanes; what flies in one is, bit for bit, what `CoverageParallelEnv` flies.

    Every lane draws the scenario of each of its missions by its own seed and the number of the
    mission alone: neither the number of lanes nor that of threads changes a result. From a sequence
    of scenarios kernels draw; a family or another generator is asked in Python when a mission
    begins, for that lane alone.

    Where scenarios differ in their number of UAS, the arrays have room for the largest: rows of UAS
    that a scenario does not have are zero, never fly, and what is asked of them has no effect.

    Args:
        num_envs: L.
        scenario: A scenario, its name or its file; a sequence of these, see `ScenarioPool`; or what
            draws them, see `DrawnPool`.
        autoreset: A name of `AUTORESET`.
        threads: How many of numba's threads share the lanes, `NUMBA_NUM_THREADS` at most. They wait
            for work by spinning: on a busy machine set `OMP_WAIT_POLICY=passive`.
        version: Of the environments, or its name.
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

    Attributes:
        settings: How missions are flown and paid.
        num_envs: L.
        n_uas: U, of the largest scenario.
        pool: The scenarios.
        missions: What happened, see `Missions`; the arrays are written by every step.
        autoreset: As in `batch_memory`.
        call: Calls the compiled step.

    Raises:
        ValueError: An argument is none of what is allowed; says what is.
    """

    @takes_settings
    def __init__(
        self,
        num_envs: int,
        scenario: ScenarioLike | Sequence[str | Path | Scenario] = "village",
        *,
        autoreset: str = "next_step",
        threads: int = 1,
        version: Version | str = V0,
        **settings: Unpack[MissionKeywords],
    ) -> None:
        _check_count("num_envs", num_envs, _MOST_LANES)
        if threads != 1:
            _check_count("threads", threads, numba.get_num_threads())
        if autoreset not in AUTORESET:
            raise ValueError(f"autoreset is {autoreset!r}; it is one of {', '.join(AUTORESET)}")
        self.settings = MissionSettings.of(settings, version_named(version))
        self.num_envs = int(num_envs)
        self.pool = pool_of(scenario, self.settings, self.num_envs)
        self.n_uas = self.pool.sizes["U"]
        self.actions = self.pool.actions
        self.chooses = self.settings.chooses
        self.filters = self.settings.safety_filter
        self.autoreset = AUTORESET[autoreset]
        at_once = lanes_at_once(self.num_envs, self.n_uas, int(threads))
        self.missions = new_missions(self.pool.sizes, self.num_envs, int(threads) * at_once)
        shape = (self.num_envs, self.n_uas, self.settings.observation_size)
        self._observations = (np.zeros(shape, np.float32), np.zeros(shape, np.float32))
        self._observing = observing_of(self.settings.observation, self.settings.version.observation)
        # else kernels do, which neither draw nor change scenes
        self._begins_here = self.pool.draws or (self.pool.changes and self.autoreset == SAME_STEP)
        self._begun = False
        # `_draw_next` comes between the end of a mission and the next
        begins_later = self._begins_here and self.autoreset == SAME_STEP
        ends = DISABLED if begins_later else self.autoreset
        self.call = BatchCall(
            self.settings, self.pool, self.missions, self._observing, ends, int(threads), at_once
        )

    @property
    def worlds(self) -> WorldState:
        """The states of the world, with an axis of lanes in front."""
        return self.missions.worlds

    @property
    def learners(self) -> Learners:
        """What learners add to them, likewise."""
        return self.missions.learners

    @property
    def lanes(self) -> SubEnvironments:
        """What the lanes are doing."""
        return self.missions.lanes

    @property
    def observation(self) -> NDArray[np.float32]:
        """(L, U, V) the latest; overwritten by the step after the next."""
        return self._observations[0]

    @property
    def flying(self) -> NDArray[np.bool_]:
        """(L, U) which UAS fly now, an array of its own."""
        return self.worlds.uas["status"] == FLYING

    @property
    def deciding(self) -> NDArray[np.bool_]:
        """(L, U) which UAS decide in the coming step: they fly, in a mission that goes on."""
        ended = self.lanes.terminated | self.lanes.truncated
        return self.flying & ((self.autoreset == SAME_STEP) | ~ended)[:, None]

    def action_masks(self) -> NDArray[np.bool_]:
        """(L, U, choices) the choices that exist now."""
        return self.actions.kind.masks(self.learners.candidates)

    def seed(self, seed: int | Sequence[int | None]) -> None:
        """Seed the lanes, each of which counts its missions from 0 again.

        Args:
            seed: A number s gives lane i the seed s + i; or one seed for each lane, None where it
                goes on as it is.

        Raises:
            ValueError: A seed is negative or too large, or their number is wrong.
        """
        for lane, value in enumerate(lane_seeds(seed, self.num_envs)):
            if value is not None:
                self.lanes.seed[lane] = value
                self.lanes.mission[lane] = -1

    def reset(
        self,
        seed: int | Sequence[int | None] | None = None,
        *,
        mask: NDArray[np.bool_] | None = None,
        scenarios: Any = None,
    ) -> NDArray[np.float32]:
        """Begin missions.

        Args:
            seed: See `seed`; None: the lanes go on drawing, at first from seeds of no meaning.
            mask: (L,) in which lanes; None: in all.
            scenarios: What to fly instead of drawing; None: draw. Of a sequence of scenarios (L,)
                indices; where a family or another generator draws, one scenario (its name, its
                file) for all of these lanes, or a sequence of L of them, None in lanes that draw.

        Returns:
            (L, U, V) see `observation`.

        Raises:
            ValueError: An argument is wrong.
        """
        if mask is None:
            mask = np.ones(self.num_envs, dtype=np.bool_)
        elif mask.shape != (self.num_envs,) or mask.dtype != np.bool_:
            raise ValueError(
                f"mask has shape {mask.shape} and dtype {mask.dtype}; "
                f"give one truth value for each of {self.num_envs} environments"
            )
        if not self._begun and not mask.all():
            raise ResetNeeded("reset of some environments before any: reset all environments first")
        chosen = self.pool.chosen(scenarios, self.num_envs)
        if seed is not None:
            self.seed(seed)
        self._run(self.pool.orders(mask, self.lanes, chosen))
        self._begun = True
        return self.observation

    def step(self, actions: Any) -> NDArray[np.float32]:
        """Fly all lanes for one step; what came of it is in `lanes`.

        Args:
            actions: (L, U, size) numbers, or (L, U) choices; as (L, -1) too.

        Returns:
            (L, U, V) see `observation`.

        Raises:
            ValueError: An action is invalid; names lane, UAS and value. Nothing has changed.
            ResetNeeded: `reset` was not called before, or a lane that has ended was not reset.
        """
        lanes = self.lanes
        if not self._begun:
            raise ResetNeeded("step() before reset(): call reset() first")
        if self.autoreset == DISABLED:
            ended = lanes.terminated | lanes.truncated
            if ended.any():
                raise ResetNeeded(
                    f"the mission of environment {int(ended.argmax())} has ended: reset those that "
                    f"have ended before the next step, or choose another autoreset mode"
                )
        accept_of_lanes(self.actions, actions, self.learners.asked)
        orders = lanes.orders.copy()
        if self.pool.draws:
            # what is drawn begins after the step of the others, which may still be refused
            refused = self._run(np.where(orders == DRAW, REST, orders))
        else:
            refused = self._run(lanes.orders)
        if refused != ACCEPTED:
            lane, i = divmod(refused, self.n_uas)
            raise ValueError(
                f"action of UAS {i} in environment {lane} is "
                f"{self.learners.asked[lane, i].tolist()}; give finite numbers"
            )
        if self.pool.changes:
            flew = orders == FLY
            change_scenes(self.pool, self.missions, flew, self._observing, self.observation)
        if self._begins_here:
            self._draw_next(orders == DRAW)
        if self.call.is_own:
            names = [f"UAS {i}" for i in range(self.n_uas)]
            refuse_what_it_wrote(self.actions.kind, self.learners.asked, names)
        return self.observation

    def state_dict(self) -> dict[str, NDArray[Any]]:
        """All that changes from step to step, in arrays of their own, by name.

        Of missions that are drawn it has the states of the generators that drew them.

        Raises:
            ValueError: A mission was given to `reset`, not drawn.
        """
        return fields_of(self._changing())

    def load_state_dict(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Go on where a batch of the same arguments was when its `state_dict` was taken.

        Raises:
            ValueError: An array is missing, surplus, of another shape or dtype, or holds what no
                mission of this batch can have.
        """
        own = self._changing()
        check_like(state, fields_of(own))
        state = records_of(state, own)
        drawn, changed = checked(self.pool, state)
        self.pool.install(drawn)
        for name, array in own.items():
            array[...] = state[name]
        install_scenes(self.pool, self.lanes.scenario, self.lanes.scene, changed)
        # the other array of observations is not what it was
        self.missions.settled[:] = False
        self._begun = bool((self.lanes.mission >= 0).all())

    def _changing(self) -> dict[str, NDArray[Any]]:
        return changing(self.pool, self.missions, self.observation)

    def swarm_state(self, lane: int) -> SwarmState:
        """What a planner of this lane sees now, in arrays of their own."""
        arena = ARENA.mission(self.pool.arrays.arenas, int(self.lanes.scene[lane]))
        return swarm_state(self.scenario_of(lane), arena, self.state_of(lane))

    def actions_of(
        self, commands: Sequence[Mapping[str, Command]], *, clip: bool = False
    ) -> NDArray[Any]:
        """The actions that fly planners' commands in the coming step, for imitation.

        Args:
            commands: Of each lane one for each UAS that flies; empty where a mission has ended.
            clip: Whether a number beyond the range of the action becomes the end of it.

        Returns:
            (L, U, size) float32 or (L, U) choices, see `CoverageParallelEnv.action_of`; zero where
            a UAS does not fly.

        Raises:
            ValueError: No action of this kind flies a command, or one that flies has none.
        """
        if len(commands) != self.num_envs:
            raise ValueError(f"commands for {len(commands)} of {self.num_envs} environments")
        rows = []
        for lane, given in enumerate(commands):
            moment = self._moment(lane)
            rows.append(joint_action_of(self.actions, moment, given, clip, n_uas=self.n_uas))
        return np.stack(rows)

    def _moment(self, lane: int) -> Moment:
        """The mission of a lane now; its arrays are views."""
        s = int(self.lanes.scene[lane])
        arena = ARENA.mission(self.pool.arrays.arenas, s)
        sizes = ARENA.sizes_of(arena)
        return Moment(
            tuple(uas.name for uas in self.pool.scene_of(s).uas),
            arena,
            STATE.lane(self.worlds, lane, sizes).as_observed(),
            TABLES.mission(self.pool.arrays.tables, s),
            LEARNERS.lane(self.learners, lane, sizes),
            self.settings.dynamics == "nonlinear",
        )

    def state_of(self, lane: int) -> WorldState:
        """The state of the world of a lane; its arrays are views."""
        arena = ARENA.mission(self.pool.arrays.arenas, int(self.lanes.scene[lane]))
        return STATE.lane(self.worlds, lane, ARENA.sizes_of(arena))

    def brief_of(self, lane: int) -> MissionBrief:
        """What a planner may know of the mission of a lane."""
        return MissionBrief.of(self.scenario_of(lane))

    def scenario_of(self, lane: int) -> Scenario:
        """The scenario that a lane flies; where events have changed the scene, as it is now."""
        return self.pool.scene_of(int(self.lanes.scene[lane]))

    def _draw_next(self, begins: NDArray[np.bool_]) -> None:
        """Begin drawn missions, as the kernel begins those of a `ScenarioPool`."""
        lanes, final = self.lanes, self.missions.final
        if self.autoreset == SAME_STEP:
            begins = lanes.terminated | lanes.truncated
        if not begins.any():
            return
        orders = self.pool.orders(begins, lanes, None)
        if self.autoreset != SAME_STEP:
            self._run(orders, in_place=True)
            return
        for kept, array in (
            (final.observation, self.observation),
            (final.report, self.learners.report),
            (final.candidates, self.learners.candidates),
            (final.swarm, lanes.swarm),
        ):
            kept[begins] = array[begins]
        ends = [array.copy() for array in (lanes.terminated, lanes.truncated, lanes.rewards)]
        self._run(orders, in_place=True)
        # this step is the last of a mission and shows the first sample of the next
        lanes.terminated[:], lanes.truncated[:], lanes.rewards[:] = ends

    def _run(self, orders: NDArray[np.int64], *, in_place: bool = False) -> int:
        before, free = self._observations
        if in_place:
            free = before
        refused = self.call(orders, before, free)
        if refused == ACCEPTED and not in_place:
            self._observations = free, before
        return refused


def _check_count(name: str, count: Any, most: int) -> None:
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or not 1 <= count <= most:
        raise ValueError(f"{name} is {count!r}; give a whole number from 1 to {most}")

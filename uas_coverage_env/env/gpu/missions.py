"""Many missions on a GPU: the batch's missions, in the memory of the GPU.

In double precision, as on the processor; the GPU's own roots and exponentials may differ in the
last digit. Without a GPU, numba's simulator runs it: `NUMBA_ENABLE_CUDASIM=1`, for tests.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from uas_coverage_env.env.actions.given import accept_of_lanes
from uas_coverage_env.env.batch.checkpoint import changing, checked
from uas_coverage_env.env.batch.memory import DRAW, SWARM_REWARD, Missions, new_missions
from uas_coverage_env.env.batch.pool import MissionPool, ScenarioPool
from uas_coverage_env.env.batch.scenes import SceneChanges, SceneLane, install_scenes
from uas_coverage_env.env.batch.source import lane_seeds
from uas_coverage_env.env.batch.state_dict import check_like, fields_of, records_of
from uas_coverage_env.env.episode.act import acting_of
from uas_coverage_env.env.episode.memory import TABLES
from uas_coverage_env.env.episode.observe import observing_of
from uas_coverage_env.env.episode.pay import paying_of
from uas_coverage_env.env.episode.settings import MissionKeywords, MissionSettings
from uas_coverage_env.env.gpu.device import (
    as_device_array,
    check_gpu,
    is_on_device,
    lane_on_host,
    on_device,
    on_host,
    with_missions,
    write,
    write_lane,
)
from uas_coverage_env.env.gpu.kernel import (
    GIVEN,
    MARKS,
    Given,
    Marks,
    is_guided,
    new_rooms,
    step_with,
    take_actions,
)
from uas_coverage_env.env.gpu.refused import Asked, refuse
from uas_coverage_env.env.observation.layout import observation_bounds
from uas_coverage_env.env.versions import V0, Version
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.families import installed_families
from uas_coverage_env.scenario.source import ScenarioLike, loaded_scenario
from uas_coverage_env.world.arena import ARENA

THREADS_PER_BLOCK: int = 64


class CudaMissions:
    """N missions on the GPU; what flies in one is what a batch flies.

    A mission that has ended begins anew in the step after, whatever it is asked. Nothing leaves the
    GPU in a step, unless the scene of missions changes (events): the arrays below are those that
    the step writes, always at the same place. PyTorch, CuPy and others read them there
    (`torch.as_tensor(missions.observation, device="cuda")`, `__cuda_array_interface__`). A step
    overwrites them, after what their default stream was given before.

    Args:
        num_envs: N.
        scenario: Name of a shipped scenario, path of a scenario file, or a scenario; or a sequence
            of these, from which each lane draws as a lane of a batch does.
        version: Of the environments.
        autoreset_mode: "NextStep".
        threads: 1.
        render_mode: None.
        **settings: See `MissionSettings`; what does not run on a GPU is refused (`refused.py`).

    Attributes:
        num_envs: N.
        n_uas: U.
        single_observation_space: Of a mission: the rows of its UAS, one after the other.
        single_action_space: Likewise.
        observation_space: Of all missions.
        action_space: Likewise.
        observation: (N, U · V) float32.
        reward: (N,) float64, of the swarm.
        rewards: (N, U) float64, of each UAS.
        terminated: (N,) bool, no UAS flies any more.
        truncated: (N,) bool, one still flies after the last step allowed.
        ended: (N,) bool, either.
        report: (N, U, columns) int64, see `uas_coverage_env.env.report`.
        refused: (N,) bool, see `step`.
        acted: (N,) int64, agent-steps flown since the beginning.
        asked: (N, U · size) float64, the actions of the coming step; to be written in place.
        missions: All arrays of the batch, see `Missions`; to be read only.
        settings: How missions are flown and paid.
        launches: What a step launches, in turn.
        numbers: What each of them is launched with.
        rooms: Of guidance, one for each UAS of each mission; none where there is no guidance.

    Raises:
        ValueError: An argument is none of what is allowed.
        ImportError: numba-cuda is not installed.
        RuntimeError: There is no GPU.
    """

    def __init__(
        self,
        num_envs: int,
        scenario: ScenarioLike | Sequence[str | Path | Scenario] = "village",
        *,
        version: Version = V0,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        render_mode: str | None = None,
        **settings: Unpack[MissionKeywords],
    ) -> None:
        if isinstance(num_envs, bool) or not isinstance(num_envs, int) or num_envs < 1:
            raise ValueError(f"num_envs is {num_envs!r}; give a whole number from 1 on")
        self.settings = told = MissionSettings.of(settings, version)
        flat_infos = settings.get("flat_infos")
        if isinstance(scenario, str | Path | Scenario) and scenario not in installed_families():
            scenario = [scenario]
        if isinstance(scenario, Sequence) and not isinstance(scenario, str):
            scenario = tuple(map(loaded_scenario, scenario))
        asked = Asked(scenario, told, flat_infos, autoreset_mode, threads, render_mode)
        refuse(asked)
        assert isinstance(scenario, tuple)
        self.num_envs = num_envs
        self._pool = pool = ScenarioPool(scenario, told, lanes=num_envs)
        self._asked = asked
        self._refuse_overhangs()
        check_gpu()
        self.n_uas = n_uas = pool.sizes["U"]
        low, high = (np.tile(bound, n_uas) for bound in observation_bounds(told.observation))
        self.single_observation_space = spaces.Box(low, high, dtype=np.float32)
        self.single_action_space = pool.actions.joint_space(n_uas)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

        here = new_missions(pool.sizes, num_envs, at_once=num_envs)
        # there is no end of a mission to keep: the next one begins in another step
        here = here._replace(final=here.final._make(array[:0] for array in here.final))
        shape = (num_envs, n_uas, told.observation_size)
        self.missions: Missions = on_device(here)
        self._marks: Marks = on_device(MARKS.zeros({"L": num_envs}))
        self._pool_there: MissionPool = on_device(pool.arrays)
        self._rows: Any = on_device(np.zeros(shape, np.float32))
        # all kernels are part of the step
        self._parts = (
            on_device(acting_of(pool.actions.kind, (pool.actions.kind,))),
            on_device(paying_of(told.reward, told.weights, told.reward)),
            on_device(observing_of(told.observation, told.observation)),
        )
        self.rooms = on_device(new_rooms(pool.sizes, num_envs * n_uas if is_guided(pool) else 0))
        self.launches = step_with(pool)
        self.numbers: Any = self._handed_over()
        self._observing = observing_of(told.observation, version.observation)  # on the host
        self._begun = False

        lanes, learners = self.missions.lanes, self.missions.learners
        self.observation = self._rows.reshape(num_envs, n_uas * told.observation_size)
        self.reward: Any = lanes.swarm[:, SWARM_REWARD]
        self.rewards: Any = lanes.rewards
        self.terminated: Any = lanes.terminated
        self.truncated: Any = lanes.truncated
        self.report: Any = learners.report
        self.asked: Any = learners.asked.reshape(num_envs, n_uas * pool.actions.size)
        self.ended: Any = self._marks.ended
        self.refused: Any = self._marks.refused
        self.acted: Any = self._marks.acted

    def reset(self, *, seed: int | Sequence[int | None] | None = None) -> Any:
        """Begin a new mission in every lane.

        Args:
            seed: A number s gives lane i the seed s + i, or one for each; of what disturbances
                draw. None: the lanes go on counting their missions.

        Returns:
            See `observation`.

        Raises:
            ValueError: A seed is none.
        """
        if seed is not None:
            lanes = self.missions.lanes
            here = on_host(lanes.seed), on_host(lanes.mission)
            for lane, value in enumerate(lane_seeds(seed, self.num_envs)):
                if value is not None:
                    here[0][lane], here[1][lane] = value, -1
            write(lanes.seed, here[0])
            write(lanes.mission, here[1])
        write(self.missions.lanes.orders, np.full(self.num_envs, DRAW))
        self._launch()
        self._begun = True
        return self.observation

    def step(self, actions: Any = None) -> Any:
        """Fly all missions for one step, or begin those that have ended.

        Args:
            actions: Of `action_space`, on the GPU or on the host; None: what is in `asked`. Where
                those of a mission that flies are not finite, or no choices, nothing is flown, and
                `refused` is set; so it is where a kind of action of your own wrote what cannot be
                flown, and the UAS brakes.

        Returns:
            See `observation`.

        Raises:
            ValueError: The actions have a wrong type or shape.
            ResetNeeded: `reset` was not called before.
        """
        if not self._begun:
            raise ResetNeeded("step() before reset(): call reset() first")
        if is_on_device(actions):
            given = as_device_array(actions)
            if given.shape != self.asked.shape:
                raise ValueError(f"actions have shape {given.shape}; give {self.asked.shape}")
            take_actions[self._blocks(of_uas=False)](given, self.asked)
        elif actions is not None:
            here = np.zeros(self.missions.learners.asked.shape)
            accept_of_lanes(self._pool.actions, actions, here)
            write(self.missions.learners.asked, here)
        self._launch()
        if self._pool.changes:
            self._change_scenes()
        return self.observation

    def scenario_of(self, lane: int) -> Scenario:
        """The scenario that a lane flies; where events have changed the scene, as it is now."""
        return self._pool.scene_of(int(lane_on_host(self.missions.lanes.scene, lane)[0]))

    def state_dict(self) -> dict[str, NDArray[Any]]:
        """All that changes from step to step, on the host, by name: that of a batch."""
        own = changing(self._pool, self.missions, self._rows)
        return fields_of({name: on_host(array) for name, array in own.items()})

    def load_state_dict(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Go on where missions of the same arguments were when their `state_dict` was taken.

        They may have been a batch's.

        Raises:
            ValueError: An array is missing, surplus, of another shape or dtype, or holds what no
                mission here can have.
        """
        pool, lanes = self._pool, self.missions.lanes
        own = changing(pool, self.missions, self._rows)
        here = {name: on_host(array) for name, array in own.items()}
        check_like(state, fields_of(here))
        state = records_of(state, here)
        _, changed = checked(pool, state)
        scene = np.zeros(self.num_envs, np.int64)
        install_scenes(pool, state["scenario"], scene, changed)
        for name, array in own.items():
            write(array, state[name])
        write(lanes.scene, scene)
        write(self.ended, state["terminated"] | state["truncated"])
        self._pool_there = on_device(pool.arrays)
        self.numbers = self._handed_over()
        self._begun = bool((state["mission"] >= 0).all())

    def _launch(self) -> None:
        for kernel, of_uas in self.launches:
            kernel[self._blocks(of_uas)](self.numbers)

    def _blocks(self, of_uas: bool) -> tuple[int, int]:
        """How many blocks of how many threads are launched."""
        n_threads = self.num_envs * (self.n_uas if of_uas else 1)
        return -(-n_threads // THREADS_PER_BLOCK), THREADS_PER_BLOCK

    def _handed_over(self) -> Any:
        given = Given(
            self._pool_there, self.missions, self._marks, *self._parts, self.rooms, self._rows
        )
        return on_device(GIVEN.numbers_of(given))

    def _refuse_overhangs(self) -> None:
        """Refuse to guide UAS past what there is no room for."""
        overhangs = self._pool.arrays.arenas.arrays.rules["overhangs"].any()
        refuse(self._asked._replace(overhangs=is_guided(self._pool) and bool(overhangs)))

    def _change_scenes(self) -> None:
        """Lay out anew on the host, as a batch does, the scenes that change at this sample."""
        missions, pool = self.missions, self._pool
        lanes = missions.lanes
        there = SceneLane(
            lanes.scene, lanes.changes, missions.worlds, missions.learners, self._rows
        )
        scenes, changed = SceneChanges(pool, self._observing), []
        for lane in np.flatnonzero(on_host(self._marks.due)).tolist():
            here = lane_on_host(there, lane)
            one = SceneLane(
                here.scene,
                here.changes[0],
                here.world._make(array[0] for array in here.world),
                here.learners._make(array[0] for array in here.learners),
                here.observation[0],
            )
            if scenes.change(lane, one):
                write_lane(there, lane, here)
                changed.append(int(here.scene[0]))
        if changed:
            self._refuse_overhangs()
            arenas, tables = pool.arrays.arenas, pool.arrays.tables
            self._pool_there = self._pool_there._replace(
                arenas=with_missions(self._pool_there.arenas, ARENA, arenas, changed),
                tables=with_missions(self._pool_there.tables, TABLES, tables, changed),
            )
            self.numbers = self._handed_over()

"""Many missions of one scenario on a GPU: the kernels of the world compiled for CUDA.

Numba compiles the same functions for a GPU that it compiles for the processor; one thread of the
GPU flies one mission. What cannot run there is what makes arrays: guidance (the waypoint action),
return mode and safety filter. For all else the step is that of `CoverageParallelEnv`, in double
precision; the GPU's own roots and exponentials may differ in the last digit.

Without a GPU, numba's simulator runs it: `NUMBA_ENABLE_CUDASIM=1`, for tests.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.random import SEEDS
from uas_coverage_env.env.batch.checkpoint import checked
from uas_coverage_env.env.batch.pool import MissionPool, ScenarioPool
from uas_coverage_env.env.batch.scenes import SceneChanges, SceneLane, install_scenes
from uas_coverage_env.env.batch.state_dict import check_like, check_values, fields_of, records_of
from uas_coverage_env.env.episode.act import acting_of
from uas_coverage_env.env.episode.memory import TABLES
from uas_coverage_env.env.episode.observe import observing_of
from uas_coverage_env.env.episode.pay import paying_of
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.gpu.device import (
    lane_on_host,
    on_device,
    on_host,
    with_missions,
    write,
    write_lane,
)
from uas_coverage_env.env.gpu.kernel import Missions, new_missions, step_with
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.families import installed_families
from uas_coverage_env.world.arena import ARENA
from uas_coverage_env.world.events import goes_home

THREADS_PER_BLOCK: int = 64


def _check_is_one(scenario: Any) -> None:
    """Refuse what draws missions.

    Raises:
        ValueError: It is not one scenario.
    """
    if not isinstance(scenario, str | Path | Scenario) or scenario in installed_families():
        raise ValueError(
            f"scenario is {str(scenario)[:80]!r}; missions that are drawn do not run on a GPU, "
            "give one scenario, such as generate_scenario(seed=1)"
        )


class CudaMissions:
    """N missions of one scenario on the GPU.

    A lane whose mission has ended begins the next one in the step after, whatever it is asked.

    Args:
        num_envs: N.
        scenario: Name of a shipped scenario, path of a scenario file, or a scenario.
        seed: Of all that disturbances draw; lane i has the seed `seed` + i.
        **settings: See `MissionSettings`; what does not run on a GPU is refused.

    Attributes:
        missions: `Missions` on the device; to be read only, but for `learners.asked`.

    Raises:
        ValueError: An argument is none of what is allowed.
        numba.cuda.CudaSupportError: There is no GPU.
    """

    def __init__(
        self,
        num_envs: int,
        scenario: str | Path | Scenario = "village",
        *,
        seed: int = 0,
        **settings: Any,
    ) -> None:
        if isinstance(num_envs, bool) or not isinstance(num_envs, int) or num_envs < 1:
            raise ValueError(f"num_envs is {num_envs!r}; give a whole number from 1 on")
        whole = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
        if not whole or not 0 <= seed <= SEEDS - num_envs:
            raise ValueError(f"seed is {seed!r}; give a whole number from 0 to 2**64 - num_envs")
        _check_is_one(scenario)
        given = MissionSettings.of(settings)
        if given.kind.goes_to or given.return_mode or given.safety_filter:
            raise ValueError(
                "actions that go to places (waypoint), return_mode and safety_filter do not run on "
                "a GPU; take another action and leave both switches off"
            )
        pool = ScenarioPool(scenario, given, lanes=num_envs)
        if goes_home(pool.scenarios[0]):
            raise ValueError(
                f"scenario {pool.scenarios[0].name!r} has an event that sends UAS home, which does "
                f'not run on a GPU; let them do another thing (then = "hover")'
            )
        self._launched = step_with(given, pool.features, pool.sizes["true vehicles"] > 0)
        # all kernels are part of the step: a GPU calls nothing at an address
        acting = acting_of(given.kind, (given.kind,))
        paying = paying_of(given.reward, given.weights, given.reward)
        observing = observing_of(given.observation, given.version.observation)
        self._pool = pool
        self._observing = observing
        self.missions: Missions = on_device(new_missions(pool, num_envs, seed))
        self._blocks = -(-num_envs // THREADS_PER_BLOCK)
        self._pool_there: MissionPool = on_device(pool.arrays)
        self._arguments = (
            on_device(acting),
            on_device(paying),
            on_device(observing_of(given.observation, given.observation)),
            self.missions,
        )

    def step(self, asked: Any = None) -> None:
        """Fly all lanes for one step.

        Args:
            asked: (N, U, size) actions, on the host or on the device; None: what is in
                `missions.learners.asked`. Of a lane with one that is not finite nothing is flown,
                and `missions.refused` is set.
        """
        if asked is not None:
            self.missions.learners.asked[:] = asked
        self._launched[self._blocks, THREADS_PER_BLOCK](self._pool_there, *self._arguments)
        if self._pool.changes:
            self._change_scenes()

    def scenario_of(self, lane: int) -> Scenario:
        """The scenario that a lane flies; where events have changed the scene, as it is now."""
        return self._pool.scene_of(int(lane_on_host(self.missions.scene, lane)[0]))

    def state_dict(self) -> dict[str, NDArray[Any]]:
        """All that changes from step to step, on the host, by name."""
        return fields_of({name: on_host(array) for name, array in self._changing().items()})

    def load_state_dict(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Go on where missions of the same arguments were when their `state_dict` was taken.

        Raises:
            ValueError: An array is missing, surplus, of another shape or dtype, or holds what no
                mission here can have.
        """
        pool, own = self._pool, self._changing()
        here = {name: on_host(array) for name, array in own.items()}
        check_like(state, fields_of(here))
        state = records_of(state, here)
        check_values(state, {"mission": (0, np.iinfo(np.int64).max - 1)})
        scenario = np.zeros(len(state["mission"]), dtype=np.int64)
        _, changed = checked(pool, {**state, "scenario": scenario})
        for name, array in own.items():
            if array.size:
                write(array, state[name])
        scene = scenario.copy()
        install_scenes(pool, scenario, scene, changed)
        write(self.missions.scene, scene[:, np.newaxis])
        self._pool_there = on_device(pool.arrays)

    def _changing(self) -> dict[str, Any]:
        missions = self.missions
        arrays = missions.worlds._asdict() | missions.learners._asdict()
        del arrays["asked"]  # of the coming step
        for name in ("rewards", "ended", "refused", "acted", "seed", "mission", "changes"):
            arrays[name] = getattr(missions, name)
        return {**arrays, "observation": missions.first_observations.observation}

    def _change_scenes(self) -> None:
        """Lay out anew on the host, as a batch does, the scenes that change at this sample."""
        missions, pool = self.missions, self._pool
        there = SceneLane(
            missions.scene,
            missions.changes,
            missions.worlds,
            missions.learners,
            missions.first_observations.observation,
        )
        scenes, changed = SceneChanges(pool, self._observing), []
        for lane in np.flatnonzero(on_host(missions.due)).tolist():
            here = lane_on_host(there, lane)
            if scenes.change(lane, here):
                write_lane(there, lane, here)
                changed.append(int(here.scene[0]))
        if changed:
            arenas, tables = pool.arrays.arenas, pool.arrays.tables
            self._pool_there = self._pool_there._replace(
                arenas=with_missions(self._pool_there.arenas, ARENA, arenas, changed),
                tables=with_missions(self._pool_there.tables, TABLES, tables, changed),
            )

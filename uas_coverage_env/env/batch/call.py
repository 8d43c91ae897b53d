"""The compiled step of a batch, and what it is called with."""

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.autopilot.assist import assistants
from uas_coverage_env.compiled.kernels import machine_code
from uas_coverage_env.env.batch.kernel import (
    GIVEN,
    Given,
    block_code,
    step_batch,
    step_batch_in_threads,
)
from uas_coverage_env.env.batch.memory import Missions
from uas_coverage_env.env.batch.source import LaneMissions
from uas_coverage_env.env.episode.act import acting_of, is_own
from uas_coverage_env.env.episode.memory import Observing
from uas_coverage_env.env.episode.pay import paying_of
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.episode.step import Rules
from uas_coverage_env.simulation.flight import feature_code


class BatchCall:
    """Calls `step_batch`, compiled at the first call.

    Args:
        settings: How missions are flown and paid.
        pool: The scenarios.
        missions: Written by every call.
        observing: What is observed.
        autoreset: NEXT_STEP, SAME_STEP, DISABLED or WAITS.
        threads: How many of numba's threads share the lanes.
        at_once: See `lanes_at_once`; `missions` has scratch for as many of each thread.
    """

    def __init__(
        self,
        settings: MissionSettings,
        pool: LaneMissions,
        missions: Missions,
        observing: Observing,
        autoreset: int,
        threads: int,
        at_once: int,
    ) -> None:
        self._settings, self._pool, self._missions = settings, pool, missions
        self._observing, self._autoreset, self._threads = observing, autoreset, threads
        self.at_once = at_once
        self._by_scene = np.arange(len(missions.settled))
        self._kernel: Callable[..., int] | None = None
        self._block = 0
        self._given: tuple[Given, NDArray[np.int64]] | None = None

    def __getstate__(self) -> dict[str, Any]:
        # neither machine code nor its addresses travel
        return {**self.__dict__, "_kernel": None, "_given": None}

    @property
    def is_own(self) -> bool:
        """Whether the kind of action is none of the version; False before the first call."""
        return self._given is not None and is_own(self._given[0].flight.rules.acting)

    def __call__(
        self,
        orders: NDArray[np.int64],
        before: NDArray[np.float32],
        observation: NDArray[np.float32],
    ) -> int:
        """See `step_batch`."""
        if self._pool.arrays.arenas.sizes.shape[0] > 1:
            # as 16 bits they are sorted in a tenth of the time
            scenes = self._missions.lanes.scene.astype(np.uint16)
            self._by_scene = np.argsort(scenes, kind="stable")
        numbers = self.numbers
        if self._kernel is None:
            version = self._settings.version
            self._block = block_code(version, self._settings.observation_size)
        given = (
            numbers, orders, self._by_scene, self.at_once, self._autoreset, self._block,
            before, observation,
        )  # fmt: skip
        if self._kernel is None:
            kernel = step_batch if self._threads == 1 else step_batch_in_threads
            self._kernel = machine_code(kernel, given)
        if self._threads == 1:
            return self._kernel(*given)
        threads = numba.get_num_threads()
        numba.set_num_threads(self._threads)
        try:
            return self._kernel(*given)
        except SystemError as error:
            # what a kernel raises in a parallel loop comes wrapped
            raise error.__cause__ or error from None
        finally:
            numba.set_num_threads(threads)

    @property
    def numbers(self) -> NDArray[np.int64]:
        """What kernels are given of arrays that stay where they are, until a pool gets new ones."""
        pool = self._pool.arrays
        if self._given is None:
            given = Given.of(pool, self._missions, self._rules())
            self._given = given, GIVEN.numbers_of(given)
        elif pool is not self._given[0].pool and any(
            now is not kept for now, kept in zip(pool, self._given[0].pool, strict=True)
        ):
            given = Given.of(pool, self._missions, self._given[0].flight.rules)
            self._given = given, GIVEN.numbers_of(given)
        return self._given[1]

    def _rules(self) -> Rules:
        settings, pool, kind = self._settings, self._pool, self._pool.actions.kind
        goes_to = kind.goes_to or pool.goes_home
        called = assistants(settings.return_mode, settings.safety_filter, goes_to=goes_to)
        version = settings.version
        paying = paying_of(settings.reward, settings.weights, version.reward)
        nonlinear = settings.dynamics == "nonlinear"
        code = feature_code(pool.features, otherwise=nonlinear or pool.sizes["true vehicles"] > 0)
        acting = acting_of(kind, version.actions)
        return Rules(acting, int(nonlinear), called, code, paying, self._observing)

"""Where the time of a step goes: the parts of the real step of a batch, timed one by one.

Each block of lanes goes through the parts that the compiled step calls (`BlockParts`), called from
Python with a clock between them. A second batch flies the same missions by the step itself, in
turns with the first: both must come to the same, and their times can be compared.
"""

import time
from collections import defaultdict
from collections.abc import Callable

import numpy as np
from rich.table import Table

from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.batch.kernel import block_parts_with
from uas_coverage_env.env.batch.memory import FLY, NEXT_STEP
from uas_coverage_env.env.episode.observe import blocks_of_looks
from uas_coverage_env.env.episode.step import stages_with
from uas_coverage_env.env.versions import V0

N_STEPS = 60
"""Flown before the clock starts."""

WHOLE, SUM = "the whole step", "sum of its parts"

_STAGES = {
    "act": "actions into commands",
    "move": "inner loop, model, battery",
    "meet": "contacts with obstacles",
    "judge": "other contacts, breaches, coverage, landing",
    "pay": "reward and report",
}


_N_EMPTY = 100


def _timed(
    name: str, seconds: defaultdict[str, float], kernel: Callable[..., int], *given: object
) -> int:
    start_s = time.process_time()
    answer = kernel(*given)
    seconds[name] += time.process_time() - start_s
    return answer


class _Parts:
    """A batch whose blocks of lanes are led through the parts of a step."""

    def __init__(self, n_lanes: int) -> None:
        self.batch = batch = CoverageBatch(n_lanes)
        self.observation = batch.reset(0)
        self._before = np.zeros_like(self.observation)
        batch.missions.settled[:] = False
        self._given = batch.call.numbers
        self._n = batch.call.at_once
        self._parts = block_parts_with(V0, self.observation.shape[2])
        blocks = blocks_of_looks(V0.observation)
        looks = ["nearest waypoints", *(", ".join(each.name for each in group) for group in blocks)]
        flight = (getattr(stage, "kernel", stage) for stage in stages_with(V0).flight)
        names = [_STAGES[stage.__name__] for stage in flight]
        names += [f"observation: {name.replace('_', ' ')}" for name in looks]
        self._loops = dict(zip(names, self._parts.loops, strict=True))
        self._clock_s = self._cost_of_clock()

    def _cost_of_clock(self) -> float:
        """What it takes to call a part that has nothing to do, between two looks at the clock."""
        flown = np.zeros(1, np.int64)
        costs_s = []
        for loop in self._parts.loops * _N_EMPTY:
            seconds: defaultdict[str, float] = defaultdict(float)
            _timed("none", seconds, loop, self._given, flown, 0, 0, self.observation)
            costs_s += seconds.values()
        return min(costs_s)

    def step(self, actions: np.ndarray, seconds: defaultdict[str, float]) -> None:
        """One step; adds what its parts took."""
        lanes = self.batch.lanes
        self.batch.learners.asked[...] = actions
        self._before, self.observation = self.observation, self._before
        arrays = self._before, self.observation
        by_scene, flown = np.arange(len(actions)), np.zeros(self._n, np.int64)

        def timed(name: str, kernel: Callable[..., int], *given: object) -> int:
            seconds[name] -= self._clock_s
            return _timed(name, seconds, kernel, *given)

        for first in range(0, len(actions), self._n):
            block = self._given, lanes.orders, by_scene, first, min(self._n, len(actions) - first)
            n_flown = timed(
                "which lanes fly, what others saw last", self._parts.gather, *block, flown, *arrays
            )
            for name, loop in self._loops.items():
                timed(name, loop, self._given, flown, n_flown, 0, self.observation)
            timed("sums, ends, new missions", self._parts.finish, *block, NEXT_STEP, *arrays)


def nanoseconds(repeats: int, n_lanes: int) -> dict[str, float]:
    """Median time of each part per agent-step [ns], and of the whole step.

    Raises:
        AssertionError: What the parts have come to is not what the step has come to.
    """
    whole, parts = CoverageBatch(n_lanes), _Parts(n_lanes)
    whole.reset(0)
    rng = np.random.default_rng(0)
    shape = whole.learners.asked.shape
    taken: dict[str, list[float]] = {}
    for step in range(N_STEPS + repeats):
        actions = rng.uniform(-1, 1, shape).astype(np.float32)
        seconds: defaultdict[str, float] = defaultdict(float)
        flying = int(whole.flying[whole.lanes.orders == FLY].sum())
        start_s = time.process_time()
        whole.step(actions)
        took_s = time.process_time() - start_s
        parts.step(actions, seconds)
        if step >= N_STEPS:
            seconds[SUM] = sum(seconds.values())
            seconds[WHOLE] = took_s
            for name, each_s in seconds.items():
                taken.setdefault(name, []).append(each_s / flying * 1e9)
    assert np.array_equal(whole.observation, parts.observation)
    assert np.array_equal(whole.lanes.rewards, parts.batch.lanes.rewards)
    return {name: float(np.median(each)) for name, each in taken.items()}


def profile_table(repeats: int, n_lanes: int) -> Table:
    """The times as a table, with shares of the whole step."""
    times_ns = nanoseconds(repeats, n_lanes)
    table = Table("part", "ns per agent-step", "share")
    for name, time_ns in times_ns.items():
        table.add_row(name, f"{time_ns:.0f}", f"{time_ns / times_ns[WHOLE]:.0%}")
    return table

"""The arrays of many missions side by side, and what the numbers in them stand for."""

from collections.abc import Mapping
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import Memory, Pool, Values
from uas_coverage_env.compiled.random import SEEDS
from uas_coverage_env.entities.state import FLYING, STATE
from uas_coverage_env.env.episode.memory import LEARNERS, SCRATCH, Learners, Scratch
from uas_coverage_env.env.observation import K_WAYPOINTS
from uas_coverage_env.env.report import ENERGY, FIRST_TERM, REPORT_SIZE
from uas_coverage_env.world import WorldState

NEXT_STEP, SAME_STEP, DISABLED, WAITS = range(4)
"""When a mission that has ended begins anew: in the next step, in the same, or never by itself;
then a step with one that has ended is refused (DISABLED), or it rests and is paid nothing (WAITS).
"""

AUTORESET = {
    "next_step": NEXT_STEP,
    "same_step": SAME_STEP,
    "disabled": DISABLED,
    "rest": WAITS,
}
"""When a mission that has ended begins anew; with `rest` not at all, so that each lane flies one
mission and `(lanes.terminated | lanes.truncated).all()` says when all have ended."""

FLY, REST, DRAW = -3, -2, -1
"""What a lane does in the coming step: fly, nothing, or begin a mission that is drawn; a number
from 0 on begins a mission of that scenario."""

SWARM_ENERGY, SWARM_COVERED, SWARM_REWARD, SWARM_FIRST_TERM = range(4)
"""Columns of a swarm's report: sum of ENERGY, waypoints covered, the reward, and from
SWARM_FIRST_TERM on the sums of its terms."""


def swarm_column(column: int) -> int:
    """Where the sum of a column of the amounts stands."""
    return SWARM_ENERGY if column == ENERGY else column - FIRST_TERM + SWARM_FIRST_TERM


UAS_AT_ONCE = 256
"""So many UAS fly through a stage of the step before the next one begins: what they work on, and
the machine code of a stage, stay in the processor's cache."""

_SHARES = 4
"""In so many blocks at least each thread flies its lanes, so that none waits long for another."""


def lanes_at_once(num_envs: int, n_uas: int, threads: int) -> int:
    """How many lanes fly through a stage before the next one begins."""
    most = max(UAS_AT_ONCE // n_uas, 1)
    return most if threads == 1 else min(most, -(-num_envs // (_SHARES * threads)))


class MissionPool(NamedTuple):
    """All that missions of S scenarios need, for kernels."""

    arenas: Pool
    """Of `ARENA`."""
    starts: Pool
    """Of `STATE`: the worlds at t = 0."""
    tables: Pool
    """Of `TABLES`."""
    learners: Pool
    """Of `LEARNERS`: at t = 0."""
    first_observations: Pool
    """Of `FIRST_OBSERVATION`: at t = 0."""


class SubEnvironments(NamedTuple):
    """What L lanes are doing, with room for U UAS."""

    seed: Annotated[NDArray[np.uint64], "L"]
    """From which the scenarios are drawn."""
    mission: Annotated[NDArray[np.int64], "L", Values(-1, np.iinfo(np.int64).max - 1)]
    """Number of the mission since the lane was seeded, from 0 on."""
    scenario: Annotated[NDArray[np.int64], "L", Values(0, "S")]
    """Index in the pool of the mission."""
    scene: Annotated[NDArray[np.int64], "L"]
    """Index in the pool of what it flies now: the mission, or its scene since that has changed."""
    changes: Annotated[NDArray[np.int64], "L", "changes", Values(-1, 2**62)]
    """What has changed the scene of the mission, in order, see `simulation.scenes`; then -1."""
    orders: Annotated[NDArray[np.int64], "L", Values(FLY, DRAW)]
    """What it does in the coming step: FLY, or DRAW after an end (NEXT_STEP)."""
    rewards: Annotated[NDArray[np.float64], "L", "U"]
    """Of each UAS for the latest step."""
    swarm: Annotated[NDArray[np.float64], "L", "Q"]
    """Sums over the UAS, see SWARM_COVERED."""
    terminated: Annotated[NDArray[np.bool_], "L"]
    """No UAS flies any more, nor swaps packs."""
    truncated: Annotated[NDArray[np.bool_], "L"]
    """One still flies after the last step allowed."""


LANES = Memory(SubEnvironments)


class Final(NamedTuple):
    """The end of the last mission that ended in a lane; SAME_STEP only."""

    observation: Annotated[NDArray[np.float32], "L", "U", "V"]
    report: Annotated[NDArray[np.int64], "L", "U", REPORT_SIZE]
    swarm: Annotated[NDArray[np.float64], "L", "Q"]
    candidates: Annotated[NDArray[np.int64], "L", "U", K_WAYPOINTS]


FINAL = Memory(Final)


class Missions(NamedTuple):
    """All missions, a lane each.

    The arrays are as large as the largest scenario needs. Rows of UAS that a lane's scenario does
    not have are zero, with status ABSENT.
    """

    worlds: WorldState
    """With an axis of lanes in front."""
    learners: Learners
    """Likewise."""
    lanes: SubEnvironments
    final: Final
    scratch: Scratch
    """With an axis of the lanes that fly at once in front: all blocks of lanes that a thread flies
    share them, so they stay in its cache."""
    settled: NDArray[np.bool_]
    """(L, U) it does not fly, and what it saw last lies in both arrays of observations."""


def new_missions(sizes: Mapping[str, int], num_envs: int, at_once: int) -> Missions:
    """Missions of which none has begun, seeded with numbers of no meaning.

    Args:
        sizes: The largest of every named size, as `ScenarioPool.sizes`.
        num_envs: L.
        at_once: How many fly at once, in all threads.
    """
    sizes = {**sizes, "L": num_envs, "Q": SWARM_FIRST_TERM + sizes["R"]}
    missions = Missions(
        STATE.zeros(sizes, lanes=num_envs),
        LEARNERS.zeros(sizes, lanes=num_envs),
        LANES.zeros(sizes),
        FINAL.zeros(sizes),
        SCRATCH.zeros(sizes, lanes=at_once),
        np.zeros((num_envs, sizes["U"]), dtype=np.bool_),
    )
    seeds = np.random.default_rng().integers(SEEDS, size=num_envs, dtype=np.uint64)
    missions.worlds.uas["status"][:] = FLYING
    missions.lanes.seed[:] = seeds
    return missions

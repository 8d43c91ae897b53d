"""What missions cost that are drawn at reset, or whose scenes change, beside missions that do not.

    python benchmarks/drawing.py

Processor time: of a reset that draws a generated scenario, and of its parts; and of the steps of a
batch that draws its missions, beside a batch that was handed the same missions in a list. In most
steps no mission ends, and the median is of these. Then of the step after which the scenes of all
lanes change, in the same way; and how much memory a scene and a lane take.
"""

import argparse
import time
from collections.abc import Callable
from functools import partial
from statistics import median

import numpy as np

from uas_coverage_env import load_scenario, uas_coverage_v0
from uas_coverage_env.compiled.progress import COMPILATIONS
from uas_coverage_env.env import CoverageBatch, MissionSettings
from uas_coverage_env.env.episode.episode import Episode
from uas_coverage_env.env.episode.memory import TABLES
from uas_coverage_env.scenario import GeneratedScenarios, Scenario
from uas_coverage_env.world.arena import ARENA

FAMILY = GeneratedScenarios()


def milliseconds(work: Callable[[], object]) -> float:
    """Processor time of a piece of work [ms]."""
    begun_s = time.process_time()
    work()
    return 1e3 * (time.process_time() - begun_s)


def reset_table(n_missions: int) -> None:
    """Print what a reset takes."""
    env = uas_coverage_v0.parallel_env(scenario="generated")
    env.reset(seed=0)
    compiled = COMPILATIONS.n_compiled
    rng, settings = np.random.default_rng(0), MissionSettings()
    scenarios: list[Scenario] = []
    rows = {"a reset that draws": [milliseconds(env.reset) for _ in range(n_missions)]}
    rows["  of which the draw"] = [
        milliseconds(lambda: scenarios.append(FAMILY(rng))) for _ in range(n_missions)
    ]
    rows["  of which arrays"] = [
        milliseconds(partial(Episode, scenario, settings)) for scenario in scenarios
    ]
    env = uas_coverage_v0.parallel_env(scenario=scenarios[0])
    rows["a reset in a given scenario"] = [milliseconds(env.reset) for _ in range(n_missions)]
    print(f"{'processor time':32} {'median, ms':>10} {'90 %, ms':>10}")
    for name, times in rows.items():
        print(f"{name:32} {median(times):10.2f} {np.quantile(times, 0.9):10.2f}")
    print(f"compilations after the first reset: {COMPILATIONS.n_compiled - compiled}")


def step_table(num_envs: int, n_steps: int) -> None:
    """Print what steps of batches take, in turns."""
    drawing = CoverageBatch(num_envs, FAMILY, max_cycles=100_000)
    drawing.reset(seed=0)
    given = CoverageBatch(num_envs, drawing.pool.scenarios, max_cycles=100_000)
    given.reset(seed=0, scenarios=np.arange(num_envs))
    rng = np.random.default_rng(0)
    times: dict[str, list[float]] = {"drawn": [], "a list": []}
    shape = (num_envs, drawing.n_uas, drawing.actions.size)
    for _ in range(n_steps):
        actions = rng.uniform(-0.1, 0.1, shape)
        for name, batch in (("drawn", drawing), ("a list", given)):
            times[name].append(milliseconds(partial(batch.step, actions)))
    print(f"\n{f'step of {num_envs} missions':32} {'median, ms':>10} {'90 %, ms':>10}")
    for name, taken in times.items():
        print(f"{name:32} {median(taken):10.2f} {np.quantile(taken, 0.9):10.2f}")


def changing(num_envs: int) -> tuple[CoverageBatch, float]:
    """A batch in which all scenes have just changed, and what that step has taken [ms]."""
    added = {"kind": "waypoint_added", "at_s": 2.0, "position_m": (50.0, 50.0, -20.0)}
    scenario = load_scenario("village").model_dump(by_alias=True)
    scenario["events"] = ({**added, "radius_m": 8.0},)
    batch = CoverageBatch(num_envs, Scenario.model_validate(scenario))
    batch.reset(seed=0)
    actions = np.zeros((num_envs, batch.n_uas, batch.actions.size))
    batch.step(actions)
    return batch, milliseconds(partial(batch.step, actions))


def scene_table(num_envs: int, n_batches: int) -> None:
    """Print what scenes cost that change."""
    print(f"\n{f'scenes change, {n_batches} times':32} {'median, ms':>10} {'90 %, ms':>10}")
    for lanes in (1, num_envs):
        times = [changing(lanes)[1] for _ in range(n_batches)]
        name = f"a step of {lanes} missions"
        print(f"{name:32} {median(times):10.2f} {np.quantile(times, 0.9):10.2f}")
    batch, _ = changing(1)
    pool = batch.pool.arrays
    scene = (*ARENA.mission(pool.arenas, 1), *TABLES.mission(pool.tables, 1))
    lane = (*batch.worlds, *batch.learners, batch.observation)
    for name, arrays in (("a scene, kB", scene), ("a lane, kB", lane)):
        print(f"{name:32} {sum(array.nbytes for array in arrays) / 1e3:10.1f}")


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--missions", type=int, default=100, help="resets that are timed")
    parser.add_argument("--lanes", type=int, default=256, help="missions of a batch")
    parser.add_argument("--steps", type=int, default=100, help="steps of a batch that are timed")
    parser.add_argument("--batches", type=int, default=10, help="batches whose scenes change")
    given = parser.parse_args()
    reset_table(given.missions)
    step_table(given.lanes, given.steps)
    scene_table(given.lanes, given.batches)


if __name__ == "__main__":
    main()

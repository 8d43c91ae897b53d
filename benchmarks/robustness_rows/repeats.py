"""R5: the same seed flies the same, in any process, thread and batch."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np

from robustness_rows.missions import OPTIONS
from robustness_rows.row import Finding, Result, Row, Trial, markdown
from uas_coverage_env import generate_scenario, load_planner, rollout
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.scenario import with_disturbances

FIRST_SEED = 9000
_STEPS = 120
_STEPS_OF = {"milp-mpc": 15}
_LANES = (1, 2, 7)


def flight_hash(planner: str, level: str | None, seed: int) -> str:
    """SHA-256 of all states and inputs of a flight."""
    town = generate_scenario(seed, n_uas=2, n_waypoints=10, n_obstacles=5)
    town = with_disturbances(town, level, seed)
    name = planner.split()[0]
    steps = _STEPS_OF.get(name, _STEPS)
    flight = rollout(town, load_planner(name, OPTIONS[planner]), seed, max_steps=steps)
    return hashlib.sha256(flight.x.tobytes() + flight.u.tobytes()).hexdigest()


def flights(planner: str, level: str | None, seed: int) -> Result:
    """The hashes of a flight here, in two threads at a time, and in another process."""
    arguments = planner, level, seed
    hashes = {"here": flight_hash(*arguments)}
    with ThreadPoolExecutor(2) as threads:
        pair = [threads.submit(flight_hash, *arguments) for _ in range(2)]
        hashes |= {f"thread {k}": future.result() for k, future in enumerate(pair)}
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        hashes["process"] = process.submit(flight_hash, *arguments).result()
    return {"what": f"`{planner}`, {level or 'still'}", "hashes": hashes}


def batches(level: str | None, seed: int) -> Result:
    """The hashes of one lane's observations in batches of several sizes, one thread and two."""
    town = generate_scenario(seed, n_uas=2, n_waypoints=10, n_obstacles=5)
    town = with_disturbances(town, level, seed)
    hashes = {}
    for lanes in _LANES:
        for threads in (1, 2):
            batch = CoverageBatch(lanes, town, threads=threads, safety_filter=True)
            total = hashlib.sha256(batch.reset([seed] * lanes)[-1].tobytes())
            rng = np.random.default_rng(seed)
            for _ in range(_STEPS):
                actions = rng.uniform(-1.0, 1.0, (batch.n_uas, 3)).astype(np.float32)
                batch.step(np.broadcast_to(actions, (lanes, *actions.shape)).copy())
                total.update(batch.observation[-1].tobytes())
            hashes[f"{lanes} lanes, {threads} threads"] = total.hexdigest()
    return {"what": f"batch, {level or 'still'}", "hashes": hashes}


def trials(quick: bool) -> list[Trial]:
    """Every planner and the batch, in still air and disturbed."""
    seeds = range(FIRST_SEED, FIRST_SEED + (1 if quick else 30))
    return [
        trial
        for seed in seeds
        for level in (None, "moderate")
        for trial in (
            *(Trial(f"{name} {level} {seed}", flights, (name, level, seed)) for name in OPTIONS),
            Trial(f"batch {level} {seed}", batches, (level, seed)),
        )
    ]


def finding(results: Mapping[str, Result]) -> Finding:
    """What is flown has failed where two hashes of it differ."""
    rows: dict[str, list[int]] = {}
    failed = 0
    for result in results.values():
        different = len(set(result.get("hashes", {}).values())) != 1
        failed += different
        counts = rows.setdefault(result.get("what", "exception"), [0, 0, 0])
        for k, more in enumerate((1, len(result.get("hashes", {})), different)):
            counts[k] += more
    table = markdown(
        ("what", "missions", "flights of them", "missions that differ"),
        [(what, *counts) for what, counts in sorted(rows.items())],
    )
    return Finding(len(results), failed, table)


ROW = Row(
    "R5",
    "The same seed flies the same",
    "missions",
    "the same hash of all states and inputs: here, in two threads at a time, in a new process; of "
    "all observations of a lane: in batches of " + ", ".join(map(str, _LANES)) + " lanes on one "
    "thread and on two",
    trials,
    finding,
    lambda quick: (
        f"towns of two UAS from {FIRST_SEED} on, {_STEPS} steps, "
        f"{_STEPS_OF['milp-mpc']} of the MILP planner"
    ),
    "Other machines and other versions of the libraries, GPUs, and planners with a clock.",
)

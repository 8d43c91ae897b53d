"""R3 and R4: hostile calls of the environment; random policies with return mode and filter."""

from __future__ import annotations

import hashlib
from collections import Counter, defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np
import return_mode
from gymnasium import spaces

from robustness_rows.row import Finding, Result, Row, Trial, errors, markdown, share
from uas_coverage_env import generate_scenario, uas_coverage_v0
from uas_coverage_env.entities.outcome import CONTACT_NAMES
from uas_coverage_env.env.actions.kinds import ACTION_NAMES

FIRST_SEED = 8000
EPISODES_OF_A_TOWN = 10
_STEPS = 60

Rng = np.random.Generator
Actions = dict[Any, Any]


def _good(rng: Rng, space: spaces.Space[Any]) -> Any:
    """An action that has to be taken, beyond the bounds that are clipped too."""
    if isinstance(space, spaces.Discrete):
        return int(rng.integers(space.n))
    assert space.shape is not None
    return rng.uniform(-2.0, 2.0, space.shape).astype(np.float32)


def _hostile(rng: Rng, good: Actions, space: spaces.Space[Any]) -> Actions:
    """Actions that have to be refused, made of those that would be taken."""
    agent = str(rng.choice(sorted(good)))
    bad: list[Any] = [
        None, "north", b"north", {}, object(), 10**400, [[0.0, 0.0], [0.0]], np.zeros(0),
        np.zeros(2), np.zeros((3, 1)), np.zeros((4, 1)), [0.0, "1", 0.0], np.nan, 1 + 1j,
    ]  # fmt: skip
    if isinstance(space, spaces.Discrete):
        bad += [-1, int(space.n), 1.5, True, "1", np.float32(1.0), np.array([1]), [1]]
    else:
        assert space.shape is not None
        (size,) = space.shape
        bad += [
            np.full(size, np.nan), np.full(size, -np.inf), np.array([np.inf] + [0.0] * (size - 1)),
            np.array([1 + 1j] * size), np.array(["a"] * size), np.array([None] * size),
            np.zeros(size + 1), 0.0,
        ]  # fmt: skip
    choice = int(rng.integers(len(bad) + 3))
    if choice < len(bad):
        return good | {agent: bad[choice]}
    if choice == len(bad):
        return {name: action for name, action in good.items() if name != agent}
    return good | {("nobody", 7)[choice - len(bad) - 1]: np.zeros(3)}


def _digest(parts: list[Any]) -> str:
    total = hashlib.sha256()
    for part in parts:
        total.update(np.ascontiguousarray(part).tobytes())
    return total.hexdigest()


def attack(seed: int) -> Result:
    """Some episodes of a town beside a twin that never sees a hostile call.

    A call has failed where it is accepted, raises anything but a ValueError, or leaves a trace: the
    twin's observations, rewards and ends are compared after every step.
    """
    rng = np.random.default_rng([seed, 3])
    town = generate_scenario(seed, n_uas=int(rng.integers(1, 4)), n_waypoints=6, n_obstacles=3)
    kind = str(rng.choice(sorted(ACTION_NAMES)))
    envs = [uas_coverage_v0.parallel_env(town, action=kind) for _ in range(2)]
    tally: Counter[str] = Counter()
    for episode in range(EPISODES_OF_A_TOWN):
        for env in envs:
            env.reset(seed=seed + episode)
        tally["episodes"] += 1
        found = _episode(rng, *envs)
        tally.update(found)
        tally["episodes failed"] += any(
            count for name, count in found.items() if name not in ("calls", "refused")
        )
    return {"action": kind, "tally": dict(tally)}


def _episode(rng: Rng, attacked: Any, twin: Any) -> Counter[str]:
    tally: Counter[str] = Counter()
    space = twin.action_space(twin.possible_agents[0])
    for _ in range(_STEPS):
        if not twin.agents:
            break
        good = {name: _good(rng, space) for name in twin.agents}
        bad = _hostile(rng, good, space)
        tally["calls"] += 1
        try:
            attacked.step(bad)
            tally["accepted"] += 1
        except ValueError:
            tally["refused"] += 1
        except Exception as error:
            tally[f"{type(error).__name__} instead of ValueError"] += 1
        ours, theirs = attacked.step(good), twin.step(good)
        for mine, other in zip(ours[:4], theirs[:4], strict=True):
            same = list(mine) == list(other)
            digests = (_digest(list(mine.values())), _digest(list(other.values())))
            tally["traces"] += not (same and digests[0] == digests[1])
        tally["not finite"] += not all(np.isfinite(one).all() for one in ours[0].values())
    return tally


def attacks(quick: bool) -> list[Trial]:
    """Towns in which episodes with hostile calls are flown."""
    return [
        Trial(f"town {seed}", attack, (seed,))
        for seed in range(FIRST_SEED, FIRST_SEED + (50 if quick else 10_000))
    ]


def attacks_found(results: Mapping[str, Result]) -> Finding:
    """Per kind of action; an episode fails by one call."""
    cells: dict[str, Counter[str]] = defaultdict(Counter)
    for result in results.values():
        if "error" not in result:
            cells[result["action"]].update(result["tally"])
    names = ["episodes", "calls", "refused", "traces", "not finite"]
    others = {name for tally in cells.values() for name in tally if tally[name]}
    names += sorted(others - {*names, "episodes failed"})
    rows = [(kind, *(f"{tally[n]:,}" for n in names)) for kind, tally in sorted(cells.items())]
    episodes, failed = (
        sum(tally[name] for tally in cells.values()) for name in ("episodes", "episodes failed")
    )
    broken = EPISODES_OF_A_TOWN * len(errors(results))
    return Finding(episodes + broken, failed + broken, markdown(("action", *names), rows))


HOSTILE = Row(
    "R3",
    "Hostile calls of the environment",
    "episodes",
    "each call with an action that is none (not finite, of a wrong type or shape, missing, for an "
    "agent that never was) is refused by a ValueError and leaves no trace, and nothing that is "
    "observed is not finite",
    attacks,
    attacks_found,
    lambda quick: (
        f"generated towns from {FIRST_SEED} on, each with an action kind that its seed draws and "
        f"{EPISODES_OF_A_TOWN} episodes of {_STEPS} steps, a hostile call before each step"
    ),
    "Hostile arguments of `reset`, Gymnasium's and the AEC interface, and batches.",
)


AIRS: Mapping[str, tuple[float, str | None]] = {
    "still": (0.0, None),
    "4 m/s": (4.0, None),
    "7 m/s": (7.0, None),
    "light": (0.0, "light"),
    "moderate": (0.0, "moderate"),
}
"""Name -> constant wind [m/s], and level of wind and wrong models."""


def fly(family: str, policy: str, seed: int, air: str) -> Result:
    """One mission of `return_mode.py`."""
    return {"air": air, "tally": dict(return_mode.fly(family, policy, seed, *AIRS[air]))}


def flights(quick: bool) -> list[Trial]:
    """Families and policies, in still air and in a wind that is known to none."""
    return [
        Trial(f"{family} {policy} {seed} {air}", fly, (family, policy, seed, air))
        for seed in range(return_mode.FIRST_SEED, return_mode.FIRST_SEED + (1 if quick else 40))
        for air in AIRS
        for policy in return_mode.POLICIES
        for family in return_mode.FAMILIES
    ]


def flights_found(results: Mapping[str, Result]) -> Finding:
    """Per air, UAS lost and to what."""
    cells: dict[str, Counter[str]] = defaultdict(Counter)
    for result in results.values():
        if "error" not in result:
            cells[result["air"]].update(result["tally"])
    rows, tried, lost = [], 0, len(errors(results))
    for air in AIRS:
        if not (tally := cells[air]):
            continue
        kinds = {name: tally[name] for name in (*CONTACT_NAMES, "still flying") if tally[name]}
        here = sum(kinds.values())
        what = ", ".join(f"{kind} {count}" for kind, count in kinds.items()) or "–"
        counts = [tally["missions"], share(here, tally["flights"]), what]
        rows.append([air, *counts, f"{tally['uas_steps']:,}", tally["breaches"]])
        tried, lost = tried + tally["flights"], lost + here
    headings = ("air", "missions", "UAS lost", "to what", "UAS samples", "in breach")
    return Finding(tried, lost, markdown(headings, rows))


RANDOM = Row(
    "R4",
    "Random policies with return mode and safety filter",
    "UAS",
    "no contact with anything, and home before the battery is empty",
    flights,
    flights_found,
    lambda quick: (
        f"from {return_mode.FIRST_SEED} on, every family and policy of `benchmarks/return_mode.py`"
    ),
    "Moving obstacles (`benchmarks/safety_filter.py` has them), and strong wind, in which some are "
    "lost (`docs/safety_filter.md`). In m/s, the wind is constant, and unknown to planner and "
    "file.",
)

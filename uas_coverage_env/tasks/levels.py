"""The levels, as data."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from uas_coverage_env.env.versions import version_named
from uas_coverage_env.features.motor import MotorDegraded
from uas_coverage_env.features.radio import RadioLost
from uas_coverage_env.registration import version_names
from uas_coverage_env.scenario import Family, Scenario
from uas_coverage_env.scenario.families import BUILT_IN
from uas_coverage_env.tasks.lessons import LESSONS
from uas_coverage_env.tasks.task import Task, level_name

_BOTH = ("s500_v2", "hexacopter")
_WINDOW = (20.0, 120.0)  # when something fails [s]


def faults(rng: np.random.Generator, scenario: Scenario) -> Scenario:
    """One UAS has a damaged motor from some time on, another hears nothing for a while."""
    first, second = rng.choice(len(scenario.uas), size=2).tolist()
    at_s = np.ceil(rng.uniform(*_WINDOW, size=2)).tolist()
    events = (
        MotorDegraded(
            kind="motor_degraded",
            at_s=at_s[0],
            uas=scenario.uas[first].name,
            thrust_share=0.9,
            power_factor=1.3,
        ),
        RadioLost(kind="radio_lost", at_s=at_s[1], uas=scenario.uas[second].name, for_s=15.0),
    )
    return scenario.model_copy(update={"events": events})


def _families(*names: str, **size: object) -> tuple[Family, ...]:
    families = (BUILT_IN[name] for name in names)
    return tuple(family.sized(**size) for family in families if isinstance(family, Family))


LEVELS: Mapping[str, Task] = {
    task.level: task
    for task in (
        Task(
            level="easy",
            meaning="one UAS on an open field",
            families=_families("open-field", n_uas=(1, 1), n_waypoints=(9, 9)),
            return_mode=True,
            safety_filter=True,
            action="waypoint",
            max_steps=150,
        ),
        Task(
            level="medium",
            meaning="two or three UAS in towns, along rivers and in irregular areas",
            families=_families(
                "streets", "courtyards", "river", "irregular",
                n_uas=(2, 3), n_waypoints=(12, 20),
            ),
            return_mode=True,
            safety_filter=True,
        ),
        Task(
            level="hard",
            meaning="mixed fleets of three to six among walls and moving obstacles, in a light "
            "wind, with charges that do not always suffice",
            families=_families(
                "streets", "walls", "traffic", "low-charge",
                n_uas=(3, 6), n_waypoints=(20, 32), vehicles=_BOTH,
            ),
            return_mode=False,
            safety_filter=False,
            disturbances="light",
        ),
        Task(
            level="extreme",
            meaning="mixed fleets of eight to sixteen in a moderate wind; a motor fails, and a "
            "radio",
            families=_families(
                "streets", "walls", "traffic", "low-charge",
                n_uas=(8, 16), n_waypoints=(40, 64), vehicles=_BOTH,
            ),
            return_mode=False,
            safety_filter=False,
            disturbances="moderate",
            faults=faults,
        ),
        Task(
            level="air-taxi",
            meaning="two or three air taxis that fly one way, from vertiport to vertiport",
            families=_families("air-taxi", n_uas=(2, 3), n_waypoints=(4, 8)),
            return_mode=True,
            safety_filter=True,
            # of some 20 kWh each
            reward_weights={"energy": 2e-5},
        ),
        Task(
            level="indoor",
            meaning="two or three small UAS at one height in rooms along a corridor, in which a "
            "person walks",
            families=_families("indoor", n_uas=(2, 3), n_waypoints=(8, 14)),
            return_mode=True,
            safety_filter=True,
        ),
    )
}  # fmt: skip
"""Name -> level, from easy to hard and then of other sizes, in the first version of the
environments."""


@cache
def level_names() -> tuple[str, ...]:
    """The names of all levels: those of the first version, then `easy-v1` and so on."""
    return tuple(level_name(level, version) for version in version_names() for level in LEVELS)


@cache
def level_named(name: str) -> Task:
    """The level of a name: `hard`, or `hard-v1` for that of another version.

    With lessons behind a colon, `hard:landing` or `hard:landing+few`, it is the level with these
    made easier, to learn on (`LESSONS`).

    Raises:
        ValueError: There is none.
    """
    level, colon, lessons = name.partition(":")
    if level not in level_names():
        raise ValueError(f"level is {level!r}; it is one of {', '.join(level_names())}")
    if colon:
        return _with_lessons(level_named(level), lessons)
    if name in LEVELS:
        return LEVELS[name]
    level, _, version = name.rpartition("-")
    return replace(LEVELS[level], version=version_named(version))


def _with_lessons(task: Task, names: str) -> Task:
    for name in names.split("+"):
        if name not in LESSONS:
            raise ValueError(f"lesson is {name!r}; it is one of {', '.join(LESSONS)}")
        lesson = LESSONS[name]
        easier = task.easier if lesson.of is None else (*task.easier, lesson.of)
        task = replace(task, lesson=names, easier=easier, **lesson.task)
    return task

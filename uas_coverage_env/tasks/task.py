"""A task: missions of a level, how they are flown and paid, and which seeds are for what."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache, reduce
from typing import Any

import numpy as np

from uas_coverage_env.env.versions import V0, Version
from uas_coverage_env.registration import level_id
from uas_coverage_env.scenario import Family, MissionSource, Scenario
from uas_coverage_env.scenario.levels import with_disturbances

Rng = np.random.Generator

SPLITS: Mapping[str, range] = {
    "training": range(10_000_000, 10_001_000),
    "validation": range(20_000_000, 20_000_050),
    "test": range(30_000_000, 30_000_050),
}
"""What the seeds of missions are for. Learn on the first, choose on the second; scores that are
published are of the third, on which nothing is chosen."""

LEARNERS_CHOICE = (
    *("action", "observation", "reward", "reward_weights", "mask_in_observation", "images_apart"),
)
"""Settings that are a learner's affair: how it acts, what it sees and what it is paid for."""

_LIBRARIES_CHOICE = ("flat_infos", "render_mode")
_KEPT = 2048


@dataclass(frozen=True)
class Task:
    """One level. What is on is part of it: none of it can be said otherwise.

    Attributes:
        level: Its name, lower case, without its version.
        meaning: What it is, in a sentence.
        families: Each mission is of one of them; all are equally likely.
        return_mode: Whether the world brings UAS home in time.
        safety_filter: Whether the world keeps commands clear of harm.
        action: Kind of action that the environment has unless a learner wants another one.
        max_steps: Time limit [steps]; None: that of each scenario.
        disturbances: Level of wind and wrong models; None: still air.
        faults: What goes wrong in a mission: (rng, scenario) -> the scenario with its events.
        reward_weights: Weights that are not the default ones.
        version: Of its environments. Missions are the same in all of them.
        lesson: Names of what is easier than on the level, to learn on; empty: nothing is.
        easier: What makes its missions so: from a mission of the level to one of the lesson.
    """

    level: str
    meaning: str
    families: tuple[Family, ...]
    return_mode: bool
    safety_filter: bool
    action: str = "velocity"
    max_steps: int | None = None
    disturbances: str | None = None
    faults: Callable[[Rng, Scenario], Scenario] | None = None
    reward_weights: Mapping[str, float] = field(default_factory=dict)
    version: Version = V0
    lesson: str = ""
    easier: tuple[Callable[[Scenario], Scenario], ...] = ()

    @property
    def name(self) -> str:
        """Its name: `hard`, or with version and lesson `hard-v1:landing`."""
        name = level_name(self.level, self.version.name)
        return f"{name}:{self.lesson}" if self.lesson else name

    @property
    def id(self) -> str:
        """Under which Gymnasium knows it."""
        return level_id(self.level, self.version.name)

    def scenario(self, seed: int) -> Scenario:
        """The mission of a seed; the same each time."""
        return _mission(self, seed)

    def scenarios(self, split: str, n: int | None = None) -> dict[int, Scenario]:
        """The first missions of a split, by their seeds.

        Args:
            split: training, validation or test.
            n: How many; None: all.

        Raises:
            ValueError: There is no such split, or it has fewer missions; or that of the tests is
                asked of a lesson.
        """
        seeds = self._seeds_of(split)
        if n is not None and not 1 <= n <= len(seeds):
            raise ValueError(f"missions is {n}; give 1 to {len(seeds)}")
        return {seed: self.scenario(seed) for seed in seeds[:n]}

    def missions(self, split: str = "training") -> MissionSource:
        """What environments draw their missions from.

        Raises:
            ValueError: There is no such split, or that of the tests is asked of a lesson.
        """
        return MissionSource(
            _Draw(self, self._seeds_of(split)),
            n_uas=max(family.size.n_uas[1] for family in self.families),
            n_waypoints=max(family.size.n_waypoints[1] for family in self.families),
            n_moving=max(family.n_moving for family in self.families),
        )

    def _seeds_of(self, split: str) -> range:
        if self.lesson and split == "test":
            raise ValueError(f"{self.name} is a lesson, to learn on; it has no test missions")
        return seeds_of(split)

    def settings(self, **chosen: Any) -> dict[str, Any]:
        """Keyword arguments of an environment; with `version`, unless it is the first.

        Args:
            **chosen: What a learner may choose (`LEARNERS_CHOICE`).

        Raises:
            ValueError: Something else is given.
        """
        allowed = (*LEARNERS_CHOICE, *_LIBRARIES_CHOICE)
        for name, value in chosen.items():
            if name not in allowed:
                raise ValueError(
                    f"{name}={value!r}: {self.id} says it itself; it takes {', '.join(allowed)}, "
                    f"and split"
                )
        given: dict[str, Any] = {
            "action": self.action,
            "return_mode": self.return_mode,
            "safety_filter": self.safety_filter,
            "max_cycles": self.max_steps,
        }
        if "reward" not in chosen:
            given["reward_weights"] = dict(self.reward_weights)
        if self.version is not V0:
            given["version"] = self.version
        return {**given, **chosen}


@dataclass(frozen=True)
class _Draw:
    """Draws missions of a split; no inner function, so that environments can be pickled."""

    task: Task
    seeds: range

    def __call__(self, rng: Rng) -> Scenario:
        return self.task.scenario(int(rng.integers(self.seeds.start, self.seeds.stop)))


def level_name(level: str, version: str) -> str:
    """The name of a level in a version: that of the first goes without it."""
    return level if version == V0.name else f"{level}-{version}"


def seeds_of(split: str) -> range:
    """The seeds of a split.

    Raises:
        ValueError: There is no such split.
    """
    if split not in SPLITS:
        raise ValueError(f"split is {split!r}; it is one of {', '.join(SPLITS)}")
    return SPLITS[split]


@lru_cache(maxsize=_KEPT)
def _mission_of(level: "_ByIdentity", seed: int) -> Scenario:
    task = level.task
    rng = np.random.default_rng(seed)
    family = task.families[int(rng.integers(len(task.families)))]
    scenario = with_disturbances(family(rng), task.disturbances, seed)
    if task.faults is not None:
        scenario = task.faults(rng, scenario)
    return reduce(lambda mission, easier: easier(mission), task.easier, scenario)


@dataclass(frozen=True)
class _ByIdentity:
    """A task as a key: it holds functions and mappings, which have no hash of their own."""

    key: int
    task: Task = field(compare=False)


def _mission(task: Task, seed: int) -> Scenario:
    return _mission_of(_ByIdentity(id(task), task), seed)

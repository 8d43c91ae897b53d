"""Where the missions of an environment come from: one scenario, or one drawn at each reset."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from uas_coverage_env.files.strict_toml import InputError, parse
from uas_coverage_env.scenario.families import Family, installed_families
from uas_coverage_env.scenario.families.family import FamilyOfSeeds
from uas_coverage_env.scenario.families.generated import GeneratedScenarios
from uas_coverage_env.scenario.load import is_path, load_scenario, scenario_names
from uas_coverage_env.scenario.model import Scenario
from uas_coverage_env.scenario.room import MOVING, SPARE, Room

ScenarioGenerator = Callable[[np.random.Generator], Scenario]
"""Draws a scenario, the same one from a generator of random numbers in the same state."""

_EXAMPLES = 32
# What an `EnvSpec` that was written as JSON has of a family of generated scenarios.
_RANGES = {field.name for field in fields(GeneratedScenarios)}
_LEAST = Room(1, 1, 0)
_NOUNS = ("UAS", "waypoints", "moving obstacles")


@dataclass(frozen=True)
class _Always:
    """The generator that draws one scenario."""

    scenario: Scenario

    def __call__(self, rng: np.random.Generator) -> Scenario:
        return self.scenario


class MissionSource:
    """Draws missions with a generator and refuses those that do not fit the spaces.

    The spaces are made for the largest mission. It is said here; or known, of a family; or found
    out by drawing 32 missions when the source is made. The largest fleet of a family, or among
    these 32, is then the largest that may come; there is room for twice the waypoints and moving
    obstacles, and for four of the latter at least.

    UAS i of a drawn mission is agent i of the environment and bears its name: `uas_1`, `uas_2`...

    Args:
        generator: A function that takes a `numpy.random.Generator` and returns a `Scenario`.
        n_uas: The largest fleet; None: find out.
        n_waypoints: The most waypoints; None: find out.
        n_moving: The most moving obstacles; None: find out.

    Attributes:
        generator: As given.
        room: The most that a mission may have.
        names: (U,) of the largest fleet.
        example: A mission like those to come.
        examples: What was drawn to find out, the example among them.

    Raises:
        ValueError: An argument is none of what is allowed, or the generator returns no scenario.
    """

    def __init__(
        self,
        generator: ScenarioGenerator,
        *,
        n_uas: int | None = None,
        n_waypoints: int | None = None,
        n_moving: int | None = None,
    ) -> None:
        if not callable(generator):
            raise ValueError(f"generator is {generator!r}; give a function rng -> Scenario")
        said = {"n_uas": n_uas, "n_waypoints": n_waypoints, "n_moving": n_moving}
        for (name, count), least in zip(said.items(), _LEAST, strict=True):
            if count is not None and (type(count) is not int or count < least):
                raise ValueError(f"{name} is {count!r}; give a whole number from {least} on")
        self.generator = generator
        rng = np.random.default_rng(0)
        examples = [self._drawn(rng) for _ in range(_EXAMPLES if None in said.values() else 1)]
        most = Room(*map(max, zip(*map(Room.of, examples), strict=True)))
        spare = SPARE * most.n_waypoints, max(MOVING, SPARE * most.n_moving)
        found = Room(most.n_uas, *spare)
        self.room = found._replace(**{k: count for k, count in said.items() if count is not None})
        self._first = first = examples[0]
        self.names = tuple(
            first.uas[i].name if self.fixed else f"uas_{i + 1}" for i in range(self.room.n_uas)
        )
        self.examples = tuple(self.fitted(example) for example in examples)
        self.example = self.examples[0]

    @classmethod
    def of(cls, missions: Any) -> "MissionSource":
        """What an environment's `scenario=` means.

        Args:
            missions: A scenario, its name, its file or its plain data; the name of a family; a
                source; or any `ScenarioGenerator`.

        Raises:
            InputError: There is no scenario or family of this name, or the file is wrong.
            ValueError: It is none of what is allowed.
        """
        if isinstance(missions, Mapping) and set(missions) == _RANGES:
            missions = GeneratedScenarios(**missions)
        if isinstance(missions, str):
            missions = installed_families().get(missions, missions)
        if isinstance(missions, MissionSource):
            return missions
        if isinstance(missions, Family | FamilyOfSeeds):
            return cls(missions, **missions.room._asdict())
        if callable(missions):
            generator: Any = missions
            return cls(generator)
        if not isinstance(missions, Scenario | Mapping) and not _may_name_one(missions):
            families = ", ".join(installed_families())
            raise InputError(
                f"unknown scenario {str(missions)[:80]!r}; take {', '.join(scenario_names())}, the "
                f"family {families}, one mission of a family as in generated:7, the path of a "
                f".toml file, or a function rng -> Scenario"
            )
        scenario = loaded_scenario(missions)
        n_uas, n_waypoints, n_moving = Room.of(scenario)
        room = Room(n_uas, n_waypoints, max(MOVING, n_moving))
        return cls(_Always(scenario), **room._asdict())

    @property
    def fixed(self) -> bool:
        """Whether all missions are flown in one scenario."""
        return isinstance(self.generator, _Always)

    def draw(self, rng: np.random.Generator) -> Scenario:
        """The scenario of the next mission.

        Raises:
            ValueError: The generator returned no scenario, or one that does not fit.
        """
        return self.example if self.fixed else self.fitted(self._drawn(rng))

    def fitted(self, scenario: str | Path | Scenario | Mapping[str, Any]) -> Scenario:
        """A scenario as this environment flies it: agents have their names.

        Args:
            scenario: A scenario, its name, its file or its plain data.

        Raises:
            InputError: There is no such scenario, or its file is wrong.
            ValueError: It does not fit.
        """
        scenario = loaded_scenario(scenario)
        if (scenario.planar is None) != (self._first.planar is None):
            one = "planar" if scenario.planar else "not planar"
            other = "not planar" if scenario.planar else "planar"
            raise ValueError(
                f"scenario {scenario.name!r} is {one} and {self._first.name!r} of the same "
                f"environment is {other}; actions have fewer numbers in the plane: fly them apart"
            )
        has = Room.of(scenario)
        for name, noun, count, most in zip(Room._fields, _NOUNS, has, self.room, strict=True):
            if count > most:
                raise ValueError(
                    f"scenario {scenario.name!r} has {count} {noun}, this environment has room "
                    f"for {most}: make it with MissionSource(generator, {name}={count})"
                )
        if all(uas.name == name for uas, name in zip(scenario.uas, self.names, strict=False)):
            return scenario
        fleet = (
            uas.model_copy(update={"name": name})
            for uas, name in zip(scenario.uas, self.names, strict=False)
        )
        return scenario.model_copy(update={"uas": tuple(fleet)})

    def _drawn(self, rng: np.random.Generator) -> Scenario:
        scenario = self.generator(rng)
        if not isinstance(scenario, Scenario):
            raise ValueError(
                f"generator {self.generator!r} returned {scenario!r} of type "
                f"{type(scenario).__name__}; it should return a Scenario"
            )
        return scenario


def _may_name_one(missions: object) -> bool:
    """Whether it has the form of a file, is a shipped scenario, or a family with a seed."""
    if isinstance(missions, str):
        return is_path(missions) or missions in scenario_names() or ":" in missions
    return isinstance(missions, Path)


ScenarioLike = str | Path | Scenario | Mapping[str, Any] | MissionSource | ScenarioGenerator
"""What environments take as `scenario=`, see `MissionSource.of`."""


def loaded_scenario(scenario: str | Path | Scenario | Mapping[str, Any]) -> Scenario:
    """A scenario of its name, its file or its plain data (a `scenario.json`, an `EnvSpec`).

    Raises:
        InputError: There is no such scenario, or something in it is wrong.
    """
    if isinstance(scenario, Scenario):
        return scenario
    if isinstance(scenario, Mapping):
        return parse(scenario, Scenario, "scenario")
    return load_scenario(scenario)

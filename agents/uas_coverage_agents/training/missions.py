"""Where a learner learns and is tried: missions of a level, of a family, or one scenario."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from uas_coverage_agents.policy.description import ScenarioFamily, Towns
from uas_coverage_agents.training.settings import Environment, LearnerSettings
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.versions import version_named
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard import PlannerSpec
from uas_coverage_env.leaderboard.scenario_sets import scenario_hash
from uas_coverage_env.leaderboard.sweep import Entry
from uas_coverage_env.scenario import Family, MissionSource, Scenario
from uas_coverage_env.scenario.families import installed_families
from uas_coverage_env.scenario.families.family import FamilyOfSeeds
from uas_coverage_env.scenario.families.generated import GeneratedScenarios
from uas_coverage_env.tasks.levels import level_named, level_names
from uas_coverage_env.tasks.scoring import entry_of
from uas_coverage_env.tasks.task import SPLITS, Task

_TOWNS, _UNSEEN_TOWNS = 1_000_000, 900_000
"""First seeds of generated towns: for learning, and for validation. Environments draw others."""

Origin = Task | Family | FamilyOfSeeds | Scenario


@dataclass(frozen=True)
class Missions:
    """What is flown while learning, and what the policy is tried on.

    Attributes:
        name: As it was asked for.
        origin: A level or a lesson of one, a family, or the only scenario.
        environment: What the learner chooses of its environments.
    """

    name: str
    origin: Origin
    environment: Environment

    @classmethod
    def of(cls, settings: LearnerSettings) -> "Missions":
        """What the settings of a training name.

        Raises:
            InputError: There is no such level, family or scenario, or it has no such choice.
        """
        name: str = settings.scenario
        origin = _level(name) if name.partition(":")[0] in level_names() else None
        families = installed_families()
        if origin is None and name in families:
            made = cls(name, _sized(families[name], settings.size), settings.environment)
        else:
            if settings.size:
                raise InputError(f"[size]: {name!r} is no family; leave it out")
            # what is none of all is answered with what there is
            made = cls(name, origin or MissionSource.of(name).example, settings.environment)
        try:
            MissionSettings.of(made.settings())
        except ValueError as error:
            raise InputError(f"[environment] on {name!r}: {error}") from error
        return made

    def source(self) -> MissionSource:
        """What environments draw from to learn."""
        if isinstance(self.origin, Task):
            return self.origin.missions("training")
        return MissionSource.of(self.origin)

    def settings(self, **more: Any) -> dict[str, Any]:
        """Keyword arguments of the environments.

        Args:
            **more: Instead of those that the learner has chosen.
        """
        chosen = {k: v for k, v in self.environment.model_dump().items() if v is not None} | more
        version = version_named(chosen.pop("version")) if "version" in chosen else None
        if isinstance(self.origin, Task):
            task = self.origin if version is None else replace(self.origin, version=version)
            return task.settings(**chosen)
        asked = {} if version is None else {"version": version}
        return {"return_mode": True, "safety_filter": True, **asked, **chosen}

    def mission(self, number: int) -> Scenario:
        """A mission to learn from, for learners that draw none themselves."""
        match self.origin:
            case Task():
                return self.origin.scenario(SPLITS["training"][number % len(SPLITS["training"])])
            case Family():
                return self.origin.of_seed(SPLITS["training"].start + number)
            case FamilyOfSeeds():
                return self.origin.of_seed(_TOWNS + number)
        return self.origin

    def unseen(self, number: int) -> tuple[int, Scenario]:
        """Seed and mission of those that nothing is learned from; the only scenario itself."""
        match self.origin:
            case Task():
                seed = SPLITS["validation"][number % len(SPLITS["validation"])]
                return seed, self.origin.scenario(seed)
            case Family():
                seed = SPLITS["validation"].start + number
                return seed, self.origin.of_seed(seed)
            case FamilyOfSeeds():
                seed = _UNSEEN_TOWNS + number
                return seed, self.origin.of_seed(seed)
        return 0, self.origin

    def validation(self, count: int) -> Mapping[int, Scenario]:
        """The first of those, by their seeds; of a level at most as many as its split has."""
        return dict(self.unseen(number) for number in range(count))

    def entries(self, spec: PlannerSpec, count: int) -> list[Entry]:
        """Validation flights of a planner, under the rules of the environments."""
        if isinstance(self.origin, Task):
            found = self.validation(count).items()
            return [entry_of(spec, self.origin, seed, scenario) for seed, scenario in found]
        rules = MissionSettings.of(self.settings())
        limited = {seed: rules.limited(each) for seed, each in self.validation(count).items()}
        return [
            Entry(
                scenario, scenario_hash(scenario), spec, seed, rules.dynamics,
                rules.safety_filter, rules.return_mode,
            )
            for seed, scenario in limited.items()
        ]  # fmt: skip

    @property
    def family(self) -> ScenarioFamily:
        """The same as a policy tells it."""
        towns = None
        if isinstance(self.origin, GeneratedScenarios):
            origin = self.origin
            ranges = origin.n_uas, origin.n_waypoints, origin.n_obstacles
            names = ("n_uas", "n_waypoints", "n_obstacles")
            towns = Towns(first_seed=_TOWNS, **dict(zip(names, ranges, strict=True)))
        return ScenarioFamily(name=self.name, towns=towns)


def _level(name: str) -> Task:
    try:
        return level_named(name)
    except ValueError as error:
        raise InputError(f"scenario {name!r}: {error}") from error


def _sized(family: Family | FamilyOfSeeds, size: Mapping[Any, Any]) -> Family | FamilyOfSeeds:
    if not size:
        return family
    try:
        return family.sized(**size) if isinstance(family, Family) else replace(family, **size)  # pyrefly: ignore[bad-specialization]
    except (TypeError, ValueError) as error:
        raise InputError(f"[size]: {' '.join(str(error).split())}") from error

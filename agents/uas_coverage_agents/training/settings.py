"""What is trained, as a small file: `learners/NAME.toml`, or one of your own; checked strictly."""

import inspect
import tomllib
from collections.abc import Callable, Collection, Sequence
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, BaseModel, Field

from uas_coverage_env.files.strict_toml import InputError, StrictModel, parse, read_toml
from uas_coverage_env.files.suggestions import did_you_mean
from uas_coverage_env.leaderboard.hashing import source_hash
from uas_coverage_env.plugins.installed import entry_points
from uas_coverage_env.plugins.named_objects import current_folder, object_named
from uas_coverage_env.plugins.users_code import described

GROUP = "uas_coverage.learners"
"""Entry points: a name -> a class that learns, see `LearnerSettings.algorithm`."""

FOLDER = Path(__file__).parent / "learners"

_FORMER = {
    "library": 'algorithm = "LIBRARY:CLASS"',
    "missions": "num_envs",
    "steps": "total_timesteps",
    "player": "[environment] and [learning]",
    "scenarios": "scenario and [size]",
}
"""Keys of version 0.3.0 -> what says the same now."""

_OF_ALL = {"summary", "algorithm", "scenario", "size", "rounds", "learning"}
"""Keys that every learner reads."""

_HARMLESS = ("torch.nn:", "uas_coverage_agents.training.")
"""Beginnings of names MODULE:NAME that a policy may bring without trust."""

M = TypeVar("M", bound=BaseModel)

Count = Annotated[int, Field(ge=1)]


def _ordered(counts: tuple[int, int]) -> tuple[int, int]:
    if not 0 <= counts[0] <= counts[1]:
        raise ValueError(f"[{counts[0]}, {counts[1]}]: give least and most, as in [2, 4]")
    return counts


Range = Annotated[tuple[int, int], AfterValidator(_ordered)]


class Environment(StrictModel):
    """What a learner chooses of its environments, by their own names.

    What is None is as the level says; elsewhere it is the environment's default, but for the
    assistants, which are on. `version` is that of the environments, v0 or v1: missions are the same
    in both.
    """

    version: Annotated[str, Field(pattern="^v[0-9]+$")] | None = None
    action: str | None = None
    observation: str = "default"
    reward_weights: dict[str, float] | None = None
    dynamics: Literal["lpv", "nonlinear"] | None = None
    return_mode: bool | None = None
    safety_filter: bool | None = None
    max_cycles: Count | None = None


class LearnerSettings(StrictModel):
    """One training; names are those of Gymnasium and Stable-Baselines3 where they have one.

    Attributes:
        summary: What it is, in a line.
        algorithm: The class that learns: a name of the entry points `uas_coverage.learners`, or
            MODULE:CLASS. See `uas_coverage_agents.training.learner` for what it has to have.
        policy: Its network: a name of the library, or MODULE:CLASS; None: the library's first.
        agent: "swarm": one agent flies the whole fleet. "each": one agent per UAS, all of which
            share the weights.
        critic: "own": the critic sees what the policy sees. "full": the whole mission.
        scenario: A level, with or without lessons (`hard`, `hard:landing`), a family, or a
            scenario; `--scenario` says another one.
        size: Of the missions of a family: `n_uas`, `n_waypoints`, `n_obstacles`, least and most.
        num_envs: Missions flown at the same time.
        total_timesteps: Flown steps to learn from: decisions of all agents together.
        device: "cuda": environments, network and learning lie on a GPU, for learners that can.
        rounds: How many; each ends with a checkpoint and begins with new missions.
        environment: What it chooses of its environments.
        learning: Arguments of the class, by its own names; else the library's defaults. A text
            MODULE:NAME stands for what has this name.
    """

    summary: str = ""
    algorithm: Annotated[str, Field(min_length=1)]
    policy: str | None = None
    agent: Literal["swarm", "each"] = "swarm"
    critic: Literal["own", "full"] = "own"
    scenario: Annotated[str, Field(min_length=1)] = "easy"
    size: dict[Literal["n_uas", "n_waypoints", "n_obstacles"], Range] = Field(default_factory=dict)
    num_envs: Count = 8
    total_timesteps: Count = 100_000
    device: Literal["cpu", "cuda"] = "cpu"
    rounds: Annotated[int, Field(ge=1, le=100_000)] = 10
    environment: Environment = Environment()
    learning: dict[str, Any] = Field(default_factory=dict)


def learner_names() -> tuple[str, ...]:
    """Names that `settings_of` knows: files of the package, and classes that are announced."""
    files = {path.stem for path in FOLDER.glob("*.toml")}
    return tuple(sorted(files | _announced().keys()))


def settings_of(
    name: str, *, scenario: str | None = None, changes: Sequence[str] = ()
) -> LearnerSettings:
    """The settings of a learner.

    Args:
        name: One of `learner_names()`, the path of a TOML file, or MODULE:CLASS, which is trained
            with the defaults.
        scenario: Another one than the settings say.
        changes: `key=value` pairs, the key as in `learning.gamma`, or `learning.phases.0.noise` and
            `learning.phases.*.noise` in a list of tables; the value as in TOML.

    Raises:
        InputError: There is none such, or something in it is wrong; one line.
    """
    source: str | Path = name
    if (FOLDER / f"{name}.toml").is_file() and name in learner_names():
        source = FOLDER / f"{name}.toml"
        settings = read_toml(source, LearnerSettings)
    elif name.endswith(".toml"):
        settings = _read(name)
    elif name in _announced() or ":" in name:
        settings = LearnerSettings(algorithm=name)
    else:
        known = learner_names()
        take = f"take {', '.join(known)}, the path of a .toml file, or MODULE:CLASS"
        raise InputError(f"unknown learner {name[:80]!r}; {did_you_mean(name, known, take)}")
    if scenario is None and not changes:
        return settings
    data = settings.model_dump(mode="json", exclude_unset=True)
    if scenario is not None:
        data["scenario"] = scenario
    for change in changes:
        _set(data, change)
    return parse(data, LearnerSettings, f"{source} with your --set and --scenario")


def _read(path: str) -> LearnerSettings:
    """A file of one's own; of keys of version 0.3.0 it is said what follows them."""
    try:
        return read_toml(path, LearnerSettings)
    except InputError as error:
        for name, now in _FORMER.items():
            if f" {name}: unknown key" in str(error):
                raise InputError(f"{path}: {name} is {now} now; see agents/README.md") from error
        raise


def _set(data: dict[str, Any], change: str) -> None:
    """Put one `key=value` into the nested tables; what is unknown the model refuses."""
    key, separator, text = (part.strip() for part in change.partition("="))
    if not separator or not key:
        raise InputError(f"--set {change!r}: should be KEY=VALUE, as in learning.gamma=0.99")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        value = text  # a plain word is text
    *tables, last = key.split(".")
    places: list[Any] = [data]
    for name in tables:
        places = [each for place in places for each in _inside(place, name)]
        if not all(isinstance(place, dict | list) for place in places):
            raise InputError(f"--set {change!r}: there is no table {name!r}")
    for place in places:
        if isinstance(place, list):
            raise InputError(f"--set {change!r}: {tables[-1]} is a list; give it as a whole")
        place[last] = value


def _inside(place: Any, name: str) -> list[Any]:
    """What a key names in a table; in a list of tables, the number of one of them, or `*`: all."""
    if not isinstance(place, list):
        return [place.setdefault(name, {})]
    if name == "*":
        return place
    return [place[int(name)]] if name.isdecimal() and int(name) < len(place) else [None]


def own_settings(settings: LearnerSettings, model: type[M], reads: Collection[str] = ()) -> M:
    """The table `[learning]` of a learner that has settings of its own.

    Args:
        settings: Of the training.
        model: What the table may hold.
        reads: Further keys that the learner reads.

    Raises:
        InputError: There is something else in it, or a key that this learner does not read.
    """
    if "device" not in reads:
        check_on_processor(settings)
    for name in settings.model_fields_set - {*_OF_ALL, "device", *reads}:
        raise InputError(f"{name} = {getattr(settings, name)!r}: {settings.algorithm} reads none")
    return parse(settings.learning, model, "[learning]")


def check_on_processor(settings: LearnerSettings) -> None:
    """For learners that know no other device.

    Raises:
        InputError: They are asked to learn on one.
    """
    if settings.device != "cpu":
        raise InputError(
            f"device = {settings.device!r}: {settings.algorithm} learns on the processor; "
            "ppo-waypoint and ppo-velocity learn on a GPU, too"
        )


def class_named(name: str) -> Any:
    """The class that learns.

    Args:
        name: See `LearnerSettings.algorithm`.

    Raises:
        InputError: There is none, or its package cannot be loaded; one line.
    """
    entry = _announced().get(name)
    if entry is None and ":" not in name:
        known = tuple(sorted(_announced()))
        instead = did_you_mean(name, known, f"take {', '.join(known)}, or MODULE:CLASS")
        raise InputError(f"algorithm {name[:80]!r} is unknown; {instead}")
    try:
        found = object_named("algorithm", entry.value if entry else name)
    except InputError:
        raise
    except ModuleNotFoundError as error:
        raise InputError(
            f"algorithm {name!r} needs the package {error.name}, which is not installed: "
            f"python -m pip install 'uas-coverage-env[learn]'"
        ) from error
    except Exception as error:  # whatever a user's module raises is one line
        raise InputError(f"algorithm {name!r} cannot be loaded: {described(error)}") from error
    if not isinstance(found, type):
        raise InputError(f"algorithm {name!r} is no class; name the class that learns")
    return found


def takes(function: Callable[..., Any], name: str) -> bool:
    """Whether a function has a parameter of this name: so a class says what it needs."""
    return name in inspect.signature(function).parameters


def named_objects(value: Any) -> Any:
    """Arguments in which each text MODULE:NAME has become what it names.

    Raises:
        InputError: There is no such module or name.
    """
    if isinstance(value, dict):
        return {key: named_objects(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [named_objects(each) for each in value]
    return object_named("[learning]", value) if names_an_object(value) else value


def names_an_object(value: Any) -> bool:
    """Whether it is a text MODULE:NAME."""
    if not isinstance(value, str) or value.count(":") != 1:
        return False
    module, _, name = value.partition(":")
    return all(part.isidentifier() for part in (*module.split("."), name))


def authors_own(settings: LearnerSettings) -> list[str]:
    """The texts MODULE:NAME of a training that are no class that an installed package announces.

    To make what they name runs code that the author of the settings has chosen.
    """
    announced = {*_announced(), *(entry.value for entry in _announced().values())}
    found: list[str] = []

    def look(value: Any) -> None:
        if isinstance(value, dict | list | tuple):
            for each in value.values() if isinstance(value, dict) else value:
                look(each)
        elif names_an_object(value) and not value.startswith(_HARMLESS):
            found.append(value)

    look([settings.algorithm, settings.policy, settings.learning])
    return [name for name in found if name not in announced]


def hashes_of_own(settings: LearnerSettings) -> dict[str, str]:
    """Module -> SHA-256 of the code that the author of the settings has written."""
    modules = {name.partition(":")[0].partition(".")[0] for name in authors_own(settings)}
    with current_folder():
        return {module: source_hash([module]) for module in sorted(modules - {"__main__"})}


def _announced() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP) if entry.group == GROUP}

"""Options that several commands have, and commands whose options are the fields of a record.

It is imported to list commands: what is heavy is imported when it is asked for.
"""

import inspect
import re
import shlex
from collections.abc import Callable, Container, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_type_hints

import typer

from uas_coverage_env.entities.codes import DynamicsName
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.runner.workers import Backend

Asked = TypeVar("Asked")
Made = TypeVar("Made")

LAST_SEED = 2**64 - 1
"""The largest seed of a flight."""

LAST_KEPT_SEED = 2**63 - 1
"""The largest seed of a flight that is kept in a store."""

JobsOption = Annotated[
    int | None,
    typer.Option(
        "--jobs", min=1, help="Flights side by side; default: one per core.", show_default=False
    ),
]
BackendOption = Annotated[
    Backend,
    typer.Option(
        "--backend", help="Processes here, or a Ray cluster (RAY_ADDRESS, else a local one)."
    ),
]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Delete the flights in --out.")]


def scenarios_like(incomplete: str) -> list[str]:
    """Scenarios by name; of those that are generated, all but the seed."""
    from uas_coverage_env.scenario import scenario_names
    from uas_coverage_env.scenario.families import installed_families

    known = (*scenario_names(), *(f"{family}:" for family in installed_families()))
    return [name for name in known if name.startswith(incomplete)]


def planners_like(incomplete: str) -> list[str]:
    """Planners by name."""
    from uas_coverage_env.flight import planner_names

    return [name for name in planner_names() if name.startswith(incomplete)]


ScenarioArgument = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="Name of a shipped scenario (see `scenario list`), `generated:SEED` or another that "
        "`compare` takes, or a scenario file.",
        autocompletion=scenarios_like,
    ),
]
PlannerOption = Annotated[
    str,
    typer.Option(
        help="Name (see `planner list`), `policy:DIR`, or MODULE:CLASS of your own.",
        autocompletion=planners_like,
    ),
]
PlannerOptions = Annotated[
    list[str] | None,
    typer.Option(metavar="KEY=VALUE", help="Option of the planner; may be repeated."),
]
SeedOption = Annotated[int, typer.Option(min=0, max=LAST_SEED, help="Seed of the planner.")]
DynamicsOption = Annotated[
    DynamicsName, typer.Option(help="The paper's linear model, or 6-DOF with exact power.")
]
FilterOption = Annotated[bool, typer.Option("--filter", help="Switch the safety filter on.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON, for machines.")]
FlightDirectory = Annotated[Path, typer.Argument(metavar="DIR", help="Flight directory.")]
SecondFlight = Annotated[
    Path | None, typer.Argument(metavar="DIR2", help="A second flight, shown beside it.")
]
ReplaceFlightOption = Annotated[
    bool, typer.Option("--overwrite", help="Replace the flight in --out.")
]
ReplaceFileOption = Annotated[
    bool, typer.Option("--overwrite", help="Replace the file where it exists.")
]
PlaceOption = Annotated[
    str | None,
    typer.Option(metavar="LAT,LON", help="Of the origin, for a scenario without [place]."),
]


def command_line(context: typer.Context, leave_out: Container[str] = ()) -> str:
    """A command as it was typed, without what is as it is by default.

    Args:
        context: Of the command.
        leave_out: Names of parameters.
    """
    words = ["uas-coverage", str(context.info_name)]
    for parameter in context.command.params:
        value = context.params.get(str(parameter.name))
        if parameter.name in leave_out or value in (None, (), [], False, parameter.default):
            continue
        values = value if isinstance(value, list | tuple) else [value]
        for each in values:
            words += parameter.opts[-1:] if value is True else [parameter.opts[-1], str(each)]
    return shlex.join(words)


def declared(command: Callable[[Asked], None]) -> Callable[..., None]:
    """A command as typer takes it: each field of the record that it takes is a parameter.

    Args:
        command: Takes one dataclass, whose fields are annotated as typer takes parameters.
    """
    (record,) = (hint for name, hint in get_type_hints(command).items() if name != "return")

    def run(**given: Any) -> None:
        command(record(**given))

    run.__name__, run.__doc__, run.__module__ = command.__name__, command.__doc__, __name__
    run.__annotations__ = get_type_hints(record, include_extras=True)
    setattr(run, "__signature__", inspect.signature(record))  # noqa: B010
    return run


def taken(record: Callable[..., Made], asked: Any, **more: Any) -> Made:
    """A record from what was asked: the fields of one name; what is None is left to its default.

    Args:
        record: A dataclass.
        asked: Another one, of a command.
        more: Fields that are not taken as they were asked for.
    """
    names = inspect.signature(record).parameters.keys() - more.keys()
    same = {name: value for name, value in vars(asked).items() if name in names}
    return record(**{name: value for name, value in same.items() if value is not None}, **more)


def typed_options(texts: Sequence[str]) -> dict[str, str]:
    """Options of a planner as they are typed: name -> value, as text.

    Args:
        texts: KEY=VALUE each.

    Raises:
        InputError: One is no such pair, or a key is given twice.
    """
    options: dict[str, str] = {}
    for text in texts:
        key, separator, value = (part.strip() for part in text.partition("="))
        if not key or not separator:
            raise InputError(f"--option {text!r}: should be KEY=VALUE, as in horizon=12")
        if key in options:
            raise InputError(f"--option {key} is given twice; give it once")
        options[key] = value
    return options


def check_file(path: Path, suffixes: tuple[str, ...] = (".toml",), *, overwrite: bool) -> None:
    """Make sure that a file can be written there, before what is in it is made.

    Raises:
        InputError: Another kind of file, or it exists, or its folder does not.
    """
    if path.suffix.lower() not in suffixes:
        raise InputError(f"{path}: should end in {' or '.join(suffixes)}")
    if path.exists() and not overwrite:
        raise InputError(f"{path}: exists; give another file or add --overwrite")
    if not path.parent.is_dir():
        raise InputError(f"{path.parent}: is no folder; make it first")


def scenario_name(path: Path) -> str:
    """A name for the scenario of a file, as the file is called."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", path.stem)[:64] or "area"

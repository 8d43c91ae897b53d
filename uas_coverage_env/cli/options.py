"""Options as they are typed: of planners, seeds, and of commands that fly many missions."""

import shlex
from collections.abc import Container, Sequence
from typing import Annotated

import typer

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.runner.jobs import Backend

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


def options_of(pairs: Sequence[str]) -> dict[str, str]:
    """Name -> value, as text.

    Args:
        pairs: KEY=VALUE each.

    Raises:
        InputError: One is no such pair, or a key is given twice.
    """
    options: dict[str, str] = {}
    for pair in pairs:
        key, separator, value = (part.strip() for part in pair.partition("="))
        if not key or not separator:
            raise InputError(f"--option {pair!r}: should be KEY=VALUE, as in horizon=12")
        if key in options:
            raise InputError(f"--option {key} is given twice; give it once")
        options[key] = value
    return options

"""Options as they are typed: of planners, seeds, and of commands that fly many missions."""

from collections.abc import Sequence
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

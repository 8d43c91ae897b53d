"""Commands that other packages add: entry-point group `uas_coverage.commands`.

An entry is a function as typer takes it; its name is that of the command. It is loaded whenever the
command line starts, so its module should import what is heavy only when the command runs.
"""

from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from typing import NoReturn

import typer

from uas_coverage_env.cli.output import one_line
from uas_coverage_env.files.strict_toml import InputError

GROUP = "uas_coverage.commands"


def add_plugin_commands(app: typer.Typer) -> None:
    """Add them all; one that cannot be loaded says so when it is called, and harms no other."""
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        try:
            command = entry.load()
        except (ImportError, AttributeError) as error:
            command = _refusal(entry, error)
        app.command(entry.name)(command)


def _refusal(entry: EntryPoint, error: Exception) -> Callable[[], NoReturn]:
    def refuse() -> NoReturn:
        """Not available here."""
        raise InputError(f"command {entry.name!r} cannot be loaded: {one_line(str(error))}")

    return refuse

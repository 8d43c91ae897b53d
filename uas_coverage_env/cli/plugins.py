"""Commands that other packages add: entry-point group `uas_coverage.commands`.

An entry is a function as typer takes it; its name is that of the command. It is loaded when the
command is called or listed, so its module should import what is heavy only when the command runs.
"""

from collections.abc import Callable
from functools import partial
from importlib.metadata import EntryPoint
from typing import Any, NoReturn

from uas_coverage_env.cli.lazy import CommandEntry, Located
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.plugins.installed import entry_points
from uas_coverage_env.plugins.users_code import described

GROUP = "uas_coverage.commands"


def plugin_entries() -> dict[str, CommandEntry]:
    """Name -> command; one that cannot be loaded says so when it is called, and harms no other."""
    entries = sorted(entry_points(group=GROUP), key=lambda entry: entry.name)
    return {entry.name: Located(entry.value, partial(_loaded, entry)) for entry in entries}


def _loaded(entry: EntryPoint) -> Any:
    try:
        return entry.load()
    except Exception as error:  # whatever another package raises harms no other command
        return _refusal(entry, error)


def _refusal(entry: EntryPoint, error: Exception) -> Callable[[], NoReturn]:
    def refuse() -> NoReturn:
        """Not available here."""
        raise InputError(f"command {entry.name!r} cannot be loaded: {described(error)}")

    return refuse

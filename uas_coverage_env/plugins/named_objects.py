"""What a user's own module holds, by the name MODULE:OBJECT."""

import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from uas_coverage_env.files.errors import InputError


def object_named(kind: str, name: str) -> Any:
    """Import what a name stands for.

    Args:
        kind: What it is to be, for errors: planner, block.
        name: MODULE:OBJECT, with a module that is installed or lies in the current folder.

    Raises:
        InputError: There is no such module or object; one line. Whatever else the module raises
            is not caught.
    """
    module_name, _, attribute = name.partition(":")
    if not all(part.isidentifier() for part in (*module_name.split("."), attribute)):
        raise InputError(f"{kind} {name!r} is no MODULE:CLASS")
    with current_folder():
        try:
            module = importlib.import_module(module_name)
        except ModuleNotFoundError as error:
            missing = error.name or ""
            if not f"{module_name}.".startswith(f"{missing}."):
                raise
            raise InputError(
                f"{kind} {name!r}: there is no module {missing!r}, neither installed nor in "
                "the current folder"
            ) from error
    try:
        return getattr(module, attribute)
    except AttributeError as error:
        raise InputError(f"{kind} {name!r}: {module_name!r} has no {attribute!r}") from error


@contextmanager
def current_folder() -> Iterator[None]:
    """Modules of the current folder can be imported, after those that are installed."""
    folder = os.getcwd()
    importlib.invalidate_caches()
    sys.path.append(folder)
    try:
        yield
    finally:
        sys.path.remove(folder)

"""What went wrong in a user's own code, and where in it, in one line."""

import os
import sysconfig
from collections.abc import Iterator
from textwrap import shorten
from traceback import walk_tb
from types import FunctionType

_OURS = "uas_coverage_"
_INSTALLED = tuple({os.path.realpath(path) + os.sep for path in sysconfig.get_paths().values()})
_MOST_CHARACTERS = 400


def described(error: Exception, package: str = "") -> str:
    """`ZeroDivisionError: division by zero (my_planners.py:14)`, on one line.

    Args:
        error: As it was caught.
        package: Whose code counts where no frame is a user's own.
    """
    reason = shorten(str(error), _MOST_CHARACTERS, placeholder=" ...")
    what = ": ".join(filter(None, (type(error).__name__, reason)))
    return what + place_of(error, package)


def place_of(error: Exception, package: str = "") -> str:
    """` (FILE:LINE)`, the innermost in code that is neither ours nor installed; else empty.

    Args:
        error: As it was caught.
        package: Whose innermost frame is taken where there is no such code; empty: none.
    """
    frames = list(_frames(error))
    users = [place for name, file, place in frames if not name.startswith(_OURS) and _own(file)]
    theirs = [place for name, _, place in frames if package and name.partition(".")[0] == package]
    for places in (users, theirs):
        if places:
            return f" ({places[-1]})"
    return ""


def place_of_function(function: FunctionType) -> str:
    """` (FILE:LINE)`, where a function begins."""
    code = function.__code__
    return f" ({_near(code.co_filename)}:{code.co_firstlineno})"


def _frames(error: Exception) -> Iterator[tuple[str, str, str]]:
    """Module, file and FILE:LINE of each frame, the innermost last."""
    for frame, line in walk_tb(error.__traceback__):
        file = frame.f_code.co_filename
        yield frame.f_globals.get("__name__", ""), file, f"{_near(file)}:{line}"


def _near(file: str) -> str:
    """The path from the current folder, where it is in there."""
    return os.path.relpath(file) if _below(file, os.getcwd() + os.sep) else file


def _own(file: str) -> bool:
    """Whether it is a file that was not installed."""
    return os.path.isfile(file) and not any(_below(file, folder) for folder in _INSTALLED)


def _below(file: str, folder: str) -> bool:
    return os.path.realpath(file).startswith(folder)

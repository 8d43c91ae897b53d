"""What installed packages announce, read again only where something has been installed since.

Each flight asks for the name of its planner and the versions that it is recorded with: to read the
files of all installed packages for that takes as long as a short flight.
"""

import os
import sys
from functools import lru_cache
from importlib import metadata

_Places = tuple[tuple[str, int], ...]


def entry_points(group: str) -> tuple[metadata.EntryPoint, ...]:
    """The entry points of a group.

    Args:
        group: Its name.
    """
    return _entry_points(group, _places())


def version_of(package: str) -> str | None:
    """The version of a package; None where it is not installed.

    Args:
        package: Its name.
    """
    return _version_of(package, _places())


def _places() -> _Places:
    """The folders that are searched, and when a package was last installed into each."""
    return tuple((place, _changed_ns(place)) for place in map(str, sys.path))


def _changed_ns(place: str) -> int:
    try:
        return os.stat(place or os.curdir).st_mtime_ns
    except OSError:
        return 0


@lru_cache(maxsize=32)
def _entry_points(group: str, places: _Places) -> tuple[metadata.EntryPoint, ...]:
    return tuple(metadata.entry_points(group=group))


@lru_cache(maxsize=64)
def _version_of(package: str, places: _Places) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None

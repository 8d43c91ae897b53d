"""What installed packages announce, read again only where something has been installed since."""

import os
import sys
from functools import lru_cache
from importlib import metadata


def entry_points(group: str) -> tuple[metadata.EntryPoint, ...]:
    """The entry points of a group.

    Each flight asks for the name of its planner, and to read the files of all installed packages
    takes as long as a short flight.

    Args:
        group: Its name.
    """
    return _read(group, tuple((place, _changed_ns(place)) for place in map(str, sys.path)))


@lru_cache(maxsize=32)
def _read(group: str, places: tuple[tuple[str, int], ...]) -> tuple[metadata.EntryPoint, ...]:
    """Of a group, as long as the folders that are searched stay the same."""
    return tuple(metadata.entry_points(group=group))


def _changed_ns(place: str) -> int:
    """When a package was last installed into a folder, or removed from it."""
    try:
        return os.stat(place or os.curdir).st_mtime_ns
    except OSError:
        return 0

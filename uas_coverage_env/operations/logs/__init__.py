"""Logs of flights that were flown: where each UAS was, and what its battery said."""

from collections.abc import Callable
from pathlib import Path

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.logs.logged import Logged, limited
from uas_coverage_env.operations.logs.mavlink import read_bin, read_tlog
from uas_coverage_env.operations.logs.table import read_table

READERS: dict[str, Callable[[Path], list[Logged]]] = {
    ".csv": read_table,
    ".bin": read_bin,
    ".tlog": read_tlog,
}
"""Ending of a file -> what reads it; a new format is a line here."""


def read_log(path: Path) -> list[Logged]:
    """What a log holds, one entry per UAS.

    Args:
        path: The file.

    Raises:
        InputError: It cannot be used.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"{path}: unknown kind of log; give {', '.join(READERS)}")
    return [limited(path, logged) for logged in reader(path)]

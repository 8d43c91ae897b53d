"""Readers of what was drawn or mapped: files as features, a module for each format."""

from pathlib import Path

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.plain_files import read_bytes

MOST_BYTES = 20_000_000


def content(path: Path) -> bytes:
    """What a file holds, if it is a plain one and not larger than anything drawn.

    Raises:
        InputError: It is not, or cannot be read.
    """
    try:
        return read_bytes(path, MOST_BYTES)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path") from None
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"{path}: cannot be read ({reason}); check the path") from None

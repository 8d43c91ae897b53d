"""Logs of flights that were flown: where each UAS was, and what its battery said."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.plain_files import read_bytes
from uas_coverage_env.operations.logs import csv_table, dataflash, telemetry, ulog
from uas_coverage_env.operations.logs.logged import Logged, limited
from uas_coverage_env.operations.logs.messages import Messages

_MOST_BYTES = 500_000_000


class Format(NamedTuple):
    """A kind of log.

    Attributes:
        of: What it is, in words.
        read: What reads it: a file, what it holds, and a battery monitor from 1 on, None for the
            first.
        messages: What is read of it -> what for.
    """

    of: str
    read: Callable[[Path, bytes, int | None], list[Logged]]
    messages: Mapping[str, str]


def _meanings(messages: Messages) -> dict[str, str]:
    return {name: message.meaning for name, message in messages.items()}


FORMATS: dict[str, Format] = {
    ".csv": Format(
        "a table, as `export --format csv` writes it", csv_table.read_table, csv_table.MEANINGS
    ),
    ".bin": Format("ArduPilot's data flash log", dataflash.read_bin, _meanings(dataflash.MESSAGES)),
    ".tlog": Format(
        "telemetry that a ground station has kept, of one or more vehicles",
        telemetry.read_tlog,
        _meanings(telemetry.MESSAGES),
    ),
    ".ulg": Format(
        "PX4's log", ulog.read_ulg, _meanings({**ulog.MESSAGES, "logged texts": ulog.TEXTS})
    ),
}
"""Ending of a file -> what reads it; a new format is a line here."""


def read_log(path: Path, battery: int | None = None) -> list[Logged]:
    """What a log holds, one entry per UAS.

    Args:
        path: The file.
        battery: Which battery monitor, from 1 on; None: the first that there is.

    Raises:
        InputError: It cannot be used.
    """
    kind = FORMATS.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"{path}: unknown kind of log; give {', '.join(FORMATS)}")
    content = read_bytes(path, _MOST_BYTES)  # a plain file, and no device to listen to
    if not content:
        raise InputError(f"{path}: is empty")
    try:
        found = kind.read(path, content, battery)
    except (ModuleNotFoundError, InputError):
        raise
    except Exception as error:  # parsers raise whatever a damaged file makes them
        raise InputError(f"{path}: cannot be read as a log: {error}") from error
    return [replace(limited(path, logged), source=str(path)) for logged in found]

"""Logs as CSV: t_s, latitude_deg, longitude_deg, height_m, and what else there is."""

import csv
import io
import math
from pathlib import Path

import numpy as np

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.plain_files import decoded
from uas_coverage_env.operations.logs.logged import Logged, Span

NEEDED = ("t_s", "latitude_deg", "longitude_deg", "height_m")
OPTIONAL = ("soc", "voltage_V", "current_A")
NAME, SORTIE = "uas", "sortie"
MEANINGS = {
    "t_s": "time",
    "latitude_deg": "position",
    "longitude_deg": "position",
    "height_m": "height above the ground of home",
    NAME: "whose row it is, if of several",
    SORTIE: "which flight it is of, if of several",
    "soc": "charge, 0 to 1",
    "voltage_V": "battery",
    "current_A": "battery",
}
"""Column -> what it is read for; they may stand in any order, and others are left alone."""


def read_table(path: Path, content: bytes, battery: int | None) -> list[Logged]:
    """What a table holds; columns may stand in any order, and others are left alone.

    Args:
        path: The file.
        content: What it holds.
        battery: None: a table has one.

    Raises:
        InputError: A column is missing, or a value is no number.
    """
    if battery not in (None, 1):
        raise InputError(f"{path}: has no battery monitor {battery}; a table has one")
    try:
        rows = list(csv.reader(io.StringIO(decoded(content))))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: is no table of text: {error}") from error
    header = [name.strip() for name in rows[0]] if rows else []
    missing = [name for name in NEEDED if name not in header]
    if missing:
        raise InputError(
            f"{path}: has no column {missing[0]}; its first line should name {', '.join(NEEDED)} "
            f"and may name {', '.join((NAME, SORTIE, *OPTIONAL))}"
        )
    doubled = [name for name in (*NEEDED, NAME, SORTIE, *OPTIONAL) if header.count(name) > 1]
    if doubled:
        raise InputError(f"{path}: has column {doubled[0]} twice; leave one out")
    names = [*NEEDED, *(name for name in (*OPTIONAL, SORTIE) if name in header)]
    columns = [header.index(name) for name in names]
    by_uas: dict[str, list[list[float]]] = {}
    for line, row in enumerate(rows[1:], start=2):
        if not row:
            continue
        if len(row) != len(header):
            raise InputError(f"{path}: line {line}: holds {len(row)} values, not {len(header)}")
        uas = row[header.index(NAME)].strip() if NAME in header else ""
        values = [
            _number(path, line, name, row[column])
            for name, column in zip(names, columns, strict=True)
        ]
        by_uas.setdefault(uas, []).append(values)
    if not by_uas:
        raise InputError(f"{path}: holds no sample")
    return [_logged(uas, names, np.array(values)) for uas, values in by_uas.items()]


def _number(path: Path, line: int, name: str, text: str) -> float:
    try:
        value = math.nan if "_" in text else float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{path}: line {line}: {name} {text[:40]!r} is no number")
    return value


def _logged(uas: str, names: list[str], values: np.ndarray) -> Logged:
    by_name = dict(zip(names, values.T, strict=True))
    t, latitude, longitude, height = (by_name.pop(name) for name in NEEDED)
    sortie = by_name.pop(SORTIE, None)
    armed = None
    if sortie is not None and len(set(sortie.tolist())) > 1:
        places = np.stack([latitude, longitude, height], axis=1)
        armed = tuple(
            Span(times[0], times[-1])
            for of in (sortie == number for number in sorted(set(sortie.tolist())))
            for times in [t[of][_moving(places[of])]]
        )
    return Logged(uas, t, latitude, longitude, height, armed=armed, **by_name)


def _moving(places: np.ndarray) -> slice:
    """The rows (N, 3) without those before the first move and after the last: packs are swapped."""
    moves = np.flatnonzero((np.diff(places, axis=0) != 0.0).any(axis=1))
    return slice(int(moves[0]), int(moves[-1]) + 2) if len(moves) else slice(0, 1)

"""Values of a file's rows and objects, none of them believed unchecked."""

import csv
import io
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from uas_coverage_env.files.plain_files import read_text
from uas_coverage_env.files.strict_toml import InputError, parse
from uas_coverage_env.scenario import Scenario

T = TypeVar("T")
M = TypeVar("M", bound=BaseModel)

_LONGEST_SHOWN = 40


def parsed(path: Path, model: type[M], *, context: Any = None) -> M:
    """A JSON file as a model."""
    return parse(read(path, _object), model, str(path), context=context)


def _object(text: str) -> dict[str, Any]:
    data = json.loads(text)
    if not isinstance(data, dict):
        raise ValueError("it should hold one object, { ... }")
    return data


def rows_of(text: str, header: Sequence[str]) -> list[list[str]]:
    """The rows of a table below its first line, which is to be `header`."""
    rows = list(csv.reader(io.StringIO(text)))
    if not rows or tuple(rows[0]) != tuple(header):
        raise ValueError(f"its first line should be {','.join(header)}")
    for line, row in enumerate(rows[1:], start=2):
        if len(row) != len(header):
            raise ValueError(f"line {line}: holds {len(row)} values, not {len(header)}")
    return rows[1:]


def note(found: NDArray[np.bool_], sample: int, i: int, uas: str) -> None:
    """Note that the row of a sample has come, which it may once: of two, one would be lost."""
    if found[sample, i]:
        raise ValueError(f"sample {sample} of {uas} is there twice")
    found[sample, i] = True


def each(rows: Sequence[list[str]], reader: Callable[[list[str]], T]) -> list[T]:
    """What a reader makes of each row; a mistake names the line."""
    made: list[T] = []
    for line, row in enumerate(rows, start=2):
        try:
            made.append(reader(row))
        except ValueError as error:
            raise ValueError(f"line {line}: {error}") from error
    return made


def step_of(time_s: str | float, scenario: Scenario) -> int:
    """The sample of a time in seconds, as text or number."""
    number = number_of(time_s)
    if not 0.0 <= number <= scenario.dt_s * (scenario.max_steps + 0.5):
        raise ValueError(
            f"{short(time_s)} s is not within the {scenario.max_steps} steps of the mission"
        )
    return round(number / scenario.dt_s)


def number_of(text: str | float) -> float:
    """A finite number."""
    try:
        number = float(text)
    except ValueError:
        raise ValueError(f"{short(text)} is no number") from None
    if not math.isfinite(number):
        raise ValueError(f"{short(text)} is not finite")
    return number


def whole_number(column: str, text: str, most: int) -> int:
    """A whole number from 0 to `most`; `column` is what a mistake calls it."""
    number = number_of(text)
    if not (number.is_integer() and 0 <= number <= most):
        raise ValueError(f"{column} is {short(text)}, not a whole number from 0 to {most}")
    return int(number)


def chosen(column: str, text: str, known: Mapping[str, int]) -> int:
    """The number of a name; `column` is what a mistake calls it."""
    if text not in known:
        raise ValueError(f"{column} is {short(text)}; there are {', '.join(known)}")
    return known[text]


def short(value: object) -> str:
    """A value as a mistake shows it."""
    return repr(value)[:_LONGEST_SHOWN]


def read(path: Path, reader: Callable[[str], T]) -> T:
    """What a reader makes of the text of a file; its mistakes name the file."""
    try:
        return reader(read_text(path))
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); is it a flight?") from error
    except (ValueError, RecursionError, csv.Error) as error:
        raise InputError(f"{path}: was damaged: {' '.join(str(error).split())}") from error

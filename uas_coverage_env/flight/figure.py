"""What a figure of a flight is; `figures` has them all."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from keyword import iskeyword
from math import isfinite
from typing import TYPE_CHECKING, Any, Literal, get_args

from uas_coverage_env.files.digits import three_digits
from uas_coverage_env.flight.record import FlightRecord
from uas_coverage_env.plugins.users_code import described

NOTHING = "-"
"""What is printed where there is no figure."""

_UNITS = {"m": "m", "Wh": "Wh", "s": "s", "mps": "m/s", "rad": "rad", "share": "%"}
_KINDS = {
    bool: "truth",
    int: "whole number from 0 to 1e12",
    float: "finite number",
    list: "list",
    dict: "mapping",
    str: "text",
}
_LARGEST = 10**12
_SCALES = {"%": 100.0, "ms": 1000.0}

Over = Literal["mean", "average", "total", "median", "least", "most"]
Table = Literal["outcome", "effort", ""]
Counts = Literal["all", "flown", "unharmed", "accomplished"]


@dataclass(frozen=True)
class Figure:
    """One figure of a flight.

    Attributes:
        name: With its unit, as in `energy_Wh`; a share, 0..1, ends in `_share`, or its unit is `%`.
        kind: `bool`, `int` (a count) or `float`: has a column in rows and tables, too. `list`: a
            row has its length, if `counted`. `dict` and `str` are of one flight only.
        of: The figure of a flight; None where it has none.
        meaning: In a line, for the docs.
        heading: Over it in tables, without its unit; empty: its name in words.
        unit: In which it is printed, where that is not the one that its name says: `%`, `ms`.
        digits: After the point.
        text: How one flight's figure is printed; None: by its kind and unit.
        key: In `summary.json`; None: its name. Empty: the file has it in another form.
        optional: Whether the file leaves it out where it is None.
        shown: Whether `show` has a line for it.
        absent: What rows hold of a flight without it, and of one that failed.
        over: How the figures of several flights are summed up; `mean` is the interquartile one,
            `average` the plain one.
        counts: Which flights then count: all (failed ones, too), those that were flown, `unharmed`
            ones without a violation, or those that accomplished their mission.
        table: Of `compare`, in which it stands; empty: in its files alone.
        counted: Of a list, whether rows hold its length.
        repeats: Whether a repeatable flight has the same again: what it took to compute has not.
    """

    name: str
    kind: type
    of: Callable[[FlightRecord], Any]
    meaning: str
    heading: str = ""
    unit: str = ""
    digits: int = 2
    text: Callable[[Any], str] | None = None
    key: str | None = None
    optional: bool = False
    shown: bool = True
    absent: bool | int | float | None = None
    over: Over = "mean"
    counts: Counts = "flown"
    table: Table = "effort"
    counted: bool = False
    repeats: bool = True

    def __post_init__(self) -> None:
        """Refuse what could not be kept under its name, or printed.

        Raises:
            ValueError: Of which attribute, and what is allowed.
        """
        if not self.name.isidentifier() or iskeyword(self.name) or self.name.startswith("_"):
            raise ValueError(f"name is {self.name!r}; give one that an attribute can have")
        choices = {"kind": _KINDS, "over": get_args(Over), "counts": get_args(Counts)}
        for field, allowed in {**choices, "table": get_args(Table)}.items():
            if getattr(self, field) not in allowed:
                names = ", ".join(getattr(each, "__name__", repr(each)) for each in allowed)
                raise ValueError(
                    f"{field} of {self.name} is {getattr(self, field)!r}; give {names}"
                )

    def computed(self, flight: FlightRecord) -> Any:
        """The figure of a flight, of its kind; None where the flight has none.

        Raises:
            FigureError: It cannot be computed, or is nothing that a file can hold.
        """
        try:
            value = self.of(flight)
            return None if value is None else self._kept(value)
        except Exception as error:
            raise FigureError(f"{self.name}: {described(error)}") from error

    def _kept(self, value: Any) -> Any:
        if self.kind not in (bool, int, float):
            json.dumps(value, allow_nan=False)
            return self.kind(value)
        number = self.kind(value)
        if (
            number != value
            or (self.kind is int and not 0 <= number <= _LARGEST)
            or not isfinite(number)
        ):
            raise ValueError(f"it is {value!r}, which is no {_KINDS[self.kind]}")
        return number

    @property
    def key_in_file(self) -> str:
        """Its key in `summary.json`; empty where it has none."""
        return self.name if self.key is None else self.key

    @property
    def in_rows(self) -> bool:
        """Whether rows have it: it is a number."""
        return self.kind in (bool, int, float) or self.counted

    @property
    def row_kind(self) -> Any:
        """The type of its column."""
        kind = int if self.kind is list else self.kind
        return kind | None if self.absent is None else kind

    @property
    def printed_unit(self) -> str:
        """The unit in which people read it; empty: none."""
        return self.unit or _UNITS.get(self.name.rpartition("_")[2], "")

    @property
    def scale(self) -> float:
        """What it is multiplied with for that."""
        return _SCALES.get(self.printed_unit, 1.0)

    @property
    def title(self) -> str:
        """The heading, without its unit."""
        stem, _, unit = self.name.rpartition("_")
        return self.heading or (stem if unit in _UNITS else self.name).replace("_", " ")

    @property
    def label(self) -> str:
        """The heading of one flight's figure, with its unit; a share says so itself."""
        unit = self.printed_unit
        return self.title if unit in ("", "%") else f"{self.title}, {unit}"

    def in_row(self, value: Any) -> bool | int | float | None:
        """What a row holds of its value."""
        if value is None:
            return self.absent
        return len(value) if self.kind is list else value

    def printed(self, value: Any) -> str:
        """Its value as a person reads it."""
        if value is None:
            return NOTHING
        if self.text is not None:
            return self.text(value)
        if self.kind is bool:
            return "yes" if value else "no"
        if self.kind is list:
            return str(len(value))
        if self.kind is not float:
            return str(value)
        if self.printed_unit == "%":
            return f"{value:.{self.digits}%}"
        if self.printed_unit == "ms":
            return three_digits(self.scale * value)
        return f"{value:.{self.digits}f}"


class ByName:
    """What has `figures`: each is an attribute of it, too."""

    if TYPE_CHECKING:

        @property
        def figures(self) -> Mapping[str, Any]:
            """By name."""

    def __getattr__(self, name: str) -> Any:
        """A figure."""
        if name.startswith("_") or name == "figures" or name not in self.figures:
            raise AttributeError(f"{type(self).__name__} has no figure {name!r}")
        return self.figures[name]


class FigureError(ValueError):
    """A figure of a flight could not be computed; says which, and why."""

"""A mixed-integer linear program that blocks fill with whole families of rows at a time.

Four verbs: `variables`, `subject_to`, `minimize`, `build`. Columns are handed around as integer
index arrays with the shape of the mathematics; a family of rows is one NumPy expression. The index
`ABSENT` stands for a variable that is known to be zero: its terms vanish, so that pruned variables
need no special case in the formulas. The index `ELIMINATED` stands for one that a reduced
formulation expresses through others: it is not zero, and using it is an error.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

ABSENT = -1
ELIMINATED = -2
INFINITY = float("inf")
Columns = NDArray[np.int64]
Term = tuple[ArrayLike, Columns]


@dataclass(frozen=True)
class BuiltMilp:
    """min cost·x + constant  subject to  row_lower <= A x <= row_upper, bounds, integrality.

    A is compressed by row.

    Attributes:
        cost: (C,) objective coefficients.
        constant: part of the objective that no column changes.
        lower: (C,) column bounds.
        upper: (C,) column bounds.
        integer: (C,) True where the column takes whole numbers.
        row_start: (R+1,) where each row's entries begin in `column` and `coefficient`.
        column: (K,) column of each entry.
        coefficient: (K,) value of each entry.
        row_lower: (R,) row bounds.
        row_upper: (R,) row bounds.
        row: (R,) number of each in `Milp.row_names()`, of which some may be left out here.
    """

    cost: NDArray[np.float64]
    constant: float
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    integer: NDArray[np.bool_]
    row_start: NDArray[np.int32]
    column: NDArray[np.int32]
    coefficient: NDArray[np.float64]
    row_lower: NDArray[np.float64]
    row_upper: NDArray[np.float64]
    row: NDArray[np.int64]

    def objective(self, values: NDArray[np.float64]) -> float:
        """Objective at `values` (C,)."""
        return float(self.cost @ values) + self.constant

    def violation(self, values: NDArray[np.float64]) -> float:
        """Largest violation of a bound, row or integrality at `values` (C,), by our arithmetic."""
        if not np.isfinite(values).all():
            return INFINITY
        worst = [0.0]
        if len(values):
            worst.append(float(np.max(self.lower - values)))
            worst.append(float(np.max(values - self.upper)))
        if self.integer.any():
            whole = values[self.integer]
            worst.append(float(np.max(np.abs(whole - np.round(whole)))))
        if len(self.row_lower):
            shape = (len(self.row_lower), len(values))
            rows = sparse.csr_matrix((self.coefficient, self.column, self.row_start), shape=shape)
            activity = np.asarray(rows @ values)
            excess = np.maximum(self.row_lower - activity, activity - self.row_upper)
            worst.append(float(np.max(excess)))
        return max(worst)


class MissingColumnsError(ValueError):
    """A block looks for columns of another one that is not there."""


class EliminatedColumnError(ValueError):
    """Rows or costs use a column that a reduced formulation expresses through others."""


class Milp:
    """Accumulates named groups of columns and rows; `build` turns them into one sparse program."""

    def __init__(self) -> None:
        self._columns: dict[str, Columns] = {}
        self._lower: list[NDArray[np.float64]] = []
        self._upper: list[NDArray[np.float64]] = []
        self._integer: list[NDArray[np.bool_]] = []
        self._implied: list[Columns] = []
        self._whole: list[Columns] = []
        self._n_columns = 0
        self._row_names: list[tuple[str, NDArray[np.int64]]] = []
        self._entries: list[tuple[NDArray[np.int64], Columns, NDArray[np.float64]]] = []
        self._row_lower: list[NDArray[np.float64]] = []
        self._row_upper: list[NDArray[np.float64]] = []
        self._n_rows = 0
        self._cost: list[tuple[Columns, NDArray[np.float64]]] = []
        self._constant = 0.0

    def variables(
        self,
        name: str,
        shape: tuple[int, ...],
        *,
        lower: ArrayLike = -INFINITY,
        upper: ArrayLike = INFINITY,
        integer: bool = False,
        where: NDArray[np.bool_] | None = None,
    ) -> Columns:
        """Add a group of columns and return their indices.

        Args:
            name: dotted name of the group, unique in the program.
            shape: shape of the returned index array.
            lower: bound, broadcast to `shape`.
            upper: bound, broadcast to `shape`.
            integer: whether the columns take whole numbers.
            where: (shape) mask; where False no column is made and the index is `ABSENT` (zero).

        Returns:
            Index array of the given shape.

        Raises:
            ValueError: if the name is taken or a lower bound exceeds its upper bound.
        """
        if name in self._columns:
            raise ValueError(f"columns '{name}' exist already")
        made = np.ones(shape, bool) if where is None else np.broadcast_to(where, shape)
        count = int(made.sum())
        columns = np.full(shape, ABSENT, np.int64)
        columns[made] = np.arange(self._n_columns, self._n_columns + count)
        low = np.broadcast_to(np.asarray(lower, float), shape)[made]
        high = np.broadcast_to(np.asarray(upper, float), shape)[made]
        if (low > high).any():
            raise ValueError(f"columns '{name}': a lower bound exceeds its upper bound")
        self._lower.append(low)
        self._upper.append(high)
        self._integer.append(np.full(count, integer))
        self._n_columns += count
        self._columns[name] = columns
        return columns

    def drop_integrality(self, columns: Columns) -> None:
        """Let columns take any value within their bounds: rows added now make them whole."""
        self._implied.append(columns[columns >= 0])

    def require_integrality(self, columns: Columns) -> None:
        """Let columns take whole numbers only, though they were added as continuous."""
        self._whole.append(columns[columns >= 0])

    def __contains__(self, name: str) -> bool:
        """Whether a group of columns of this name has been added."""
        return name in self._columns

    def columns(self, name: str) -> Columns:
        """Index array of a group added before; blocks find each other's columns by name.

        Raises:
            MissingColumnsError: the block that adds it is not in the program or comes later.
        """
        if name not in self._columns:
            raise MissingColumnsError(
                f"columns {name!r} are not there (yet); the block that adds them goes first"
            )
        return self._columns[name]

    def subject_to(
        self,
        name: str,
        *terms: Term,
        lower: ArrayLike = -INFINITY,
        upper: ArrayLike = INFINITY,
        where: NDArray[np.bool_] | None = None,
    ) -> None:
        """Add the rows  lower <= sum of the terms <= upper.

        A row all of whose terms vanish and that holds so (0 = 0) is not made.

        Args:
            name: dotted name of the family, for messages and LP files.
            terms: pairs (coefficients, columns), broadcast together; the last axis is summed, the
                leading axes of all terms broadcast to the shape of the family.
            lower: bound, broadcast to the shape of the family.
            upper: bound, broadcast to the shape of the family.
            where: mask in the shape of the family; rows are made only where it is True.

        Raises:
            EliminatedColumnError: if a term uses one.
        """
        shapes = [np.broadcast_shapes(np.shape(c), np.shape(k)) for c, k in terms]
        masks = () if where is None else (np.shape(where),)
        shape = np.broadcast_shapes(*(s[:-1] for s in shapes), *masks)
        made = np.ones(shape, bool) if where is None else np.broadcast_to(where, shape)
        count = int(made.sum())
        if count == 0:
            return
        low = np.broadcast_to(np.asarray(lower, float), shape)[made]
        high = np.broadcast_to(np.asarray(upper, float), shape)[made]
        entries, wanted = [], (low > 0.0) | (high < 0.0)
        for (coefficients, columns), full in zip(terms, shapes, strict=True):
            wide = (*shape, full[-1])
            picked = np.broadcast_to(columns, wide)[made]
            values = np.broadcast_to(np.asarray(coefficients, float), wide)[made]
            keep = (picked != ABSENT) & (values != 0.0)
            if (picked[keep] < 0).any():
                raise EliminatedColumnError(f"rows '{name}' use an eliminated column")
            entries.append((picked, values, keep))
            wanted |= keep.any(axis=1)
        rows = self._n_rows + np.cumsum(wanted) - 1
        for picked, values, keep in entries:
            repeated = np.broadcast_to(rows[:, None], picked.shape)
            self._entries.append((repeated[keep], picked[keep], values[keep]))
        self._row_lower.append(low[wanted])
        self._row_upper.append(high[wanted])
        self._row_names.append((name, np.argwhere(made)[wanted]))
        self._n_rows += int(wanted.sum())

    def minimize(self, coefficients: ArrayLike, columns: Columns) -> None:
        """Add coefficients · columns (broadcast together) to the objective.

        Raises:
            EliminatedColumnError: if one is used.
        """
        shape = np.broadcast_shapes(np.shape(coefficients), columns.shape)
        picked = np.broadcast_to(columns, shape).ravel()
        values = np.broadcast_to(np.asarray(coefficients, float), shape).ravel()
        keep = picked != ABSENT
        if (picked[keep] < 0).any():
            raise EliminatedColumnError("the objective uses an eliminated column")
        self._cost.append((picked[keep], values[keep]))

    def add_constant(self, value: float) -> None:
        """Add a constant to the objective."""
        self._constant += value

    def build(self) -> BuiltMilp:
        """Assemble everything added so far."""
        cost = np.zeros(self._n_columns)
        for picked, values in self._cost:
            np.add.at(cost, picked, values)
        rows, picked, values = (_joined([entry[k] for entry in self._entries]) for k in range(3))
        integer = _joined(self._integer).astype(bool)
        for columns in self._whole:
            integer[columns] = True
        for columns in self._implied:
            integer[columns] = False
        shape = (self._n_rows, self._n_columns)
        matrix = sparse.csr_matrix((values, (rows, picked)), shape=shape)
        matrix.sort_indices()
        return BuiltMilp(
            cost=cost,
            constant=self._constant,
            lower=_joined(self._lower),
            upper=_joined(self._upper),
            integer=integer,
            row_start=np.asarray(matrix.indptr, np.int32),
            column=np.asarray(matrix.indices, np.int32),
            coefficient=np.asarray(matrix.data, np.float64),
            row_lower=_joined(self._row_lower),
            row_upper=_joined(self._row_upper),
            row=np.arange(self._n_rows),
        )

    def column_names(self) -> list[str]:
        """Readable name of each column: its group and its index in the group."""
        names = [""] * self._n_columns
        for group, columns in self._columns.items():
            for index in np.argwhere(columns >= 0):
                names[columns[tuple(index)]] = f"{group}({','.join(map(str, index))})"
        return names

    def row_names(self) -> list[str]:
        """Readable name of each row: its family and its index in the family."""
        return [
            f"{family}({','.join(map(str, index))})"
            for family, indices in self._row_names
            for index in indices
        ]

    def lp_text(self) -> str:
        """The program in LP format, one row per line, for people and for golden files."""
        built, names = self.build(), self.column_names()
        lines = ["minimize", f" cost: {_expression(built.cost, range(len(names)), names)}"]
        if built.constant:
            lines.append(f"  {'+' if built.constant > 0 else '-'} {_number(abs(built.constant))}")
        lines.append("subject to")
        for row, name in enumerate(self.row_names()):
            span = slice(built.row_start[row], built.row_start[row + 1])
            left = _expression(built.coefficient[span], built.column[span], names)
            low, high = built.row_lower[row], built.row_upper[row]
            if low == high:
                lines.append(f" {name}: {left} = {_number(low)}")
            elif np.isinf(low):
                lines.append(f" {name}: {left} <= {_number(high)}")
            elif np.isinf(high):
                lines.append(f" {name}: {left} >= {_number(low)}")
            else:
                lines.append(f" {name}: {_number(low)} <= {left} <= {_number(high)}")
        lines.append("bounds")
        binary = built.integer & (built.lower == 0.0) & (built.upper == 1.0)
        for column, name in enumerate(names):
            low, high = built.lower[column], built.upper[column]
            if not binary[column]:
                lines.append(f" {_number(low)} <= {name} <= {_number(high)}")
        for title, group in (("binary", binary), ("general", built.integer & ~binary)):
            if group.any():
                lines.append(title)
                lines += [f" {names[column]}" for column in np.flatnonzero(group)]
        return "\n".join([*lines, "end", ""])

    def write_lp(self, path: str | Path) -> None:
        """Write `lp_text` to a file."""
        Path(path).write_text(self.lp_text(), encoding="utf-8")


def _joined(parts: list[NDArray]) -> NDArray:
    return np.concatenate(parts) if parts else np.zeros(0)


def _number(value: float) -> str:
    if np.isinf(value):
        return "inf" if value > 0 else "-inf"
    return f"{value:.6g}" if abs(value) > 1e-12 else "0"


def _expression(values, columns, names: list[str]) -> str:
    parts = []
    for value, column in zip(values, columns, strict=True):
        if value == 0.0:
            continue
        sign = "-" if value < 0 else "+"
        size = "" if abs(value) == 1.0 else f"{_number(abs(value))} "
        parts.append(f"{sign} {size}{names[column]}")
    return " ".join(parts) if parts else "0"

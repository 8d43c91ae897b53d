"""How policies got better while they were trained, from the tables that trainings leave."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from uas_coverage_env.files.plain_files import read_text
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.replay.figures.style import (
    columns_of,
    line_style,
    printed,
    uas_colour,
    width_in,
)

CURVE = "learning_curve.csv"

BASELINES = "baselines"
"""In the directory of a training: a folder for each planner that does not learn, with a curve of
one row, on the same missions."""

Curve = Mapping[str, Sequence[float] | NDArray[np.float64]]
"""Column of `learning_curve.csv` -> its values, a row for each time that the policy was tried."""

_STEPS, _RETURN = "steps", "return"
_FEW_STEPS = 50_000
_PANELS = (
    ("coverage", 100.0, "Covered, %"),
    ("violations", 1.0, "Violations per mission"),
    ("energy_Wh", 1.0, "Energy, Wh"),
    ("flight_steps", 1.0, "Steps until all are home"),
)


def training_figure(runs: Mapping[str, Curve]) -> Figure:
    """Coverage, violations, energy and duration over the flown steps, a line per training.

    The return is shown, too, where all tables have it. A table of one row is that of a planner that
    does not learn: a level line.

    Args:
        runs: What a training is called in the legend, "" for nothing -> its curve.
    """
    returns = all(_RETURN in curve for curve in runs.values()) and bool(runs)
    panels = (*_PANELS, *([(_RETURN, 1.0, "Return")] if returns else []))
    rows = 3 if returns else 2
    longest = max((float(curve[_STEPS][-1]) for curve in runs.values()), default=0.0)
    unit, unit_name = (1e3, "thousand") if 0.0 < longest < _FEW_STEPS else (1e6, "million")
    with printed():
        figure = Figure(figsize=(width_in(), 2.1 * rows), layout="constrained")
        grid = figure.subplots(rows, 2, sharex=True)
        for axis in grid.flat[len(panels) :]:
            axis.set_visible(False)
        for axis, (column, scale, label) in zip(grid.flat, panels, strict=False):
            for i, (name, curve) in enumerate(runs.items()):
                values = scale * np.asarray(curve[column], float)
                style: Any = {"color": uas_colour(i), "linestyle": line_style(i)}
                style["label"] = name or None
                if len(values) == 1:
                    axis.axhline(float(values[0]), **style)
                else:
                    steps = np.asarray(curve[_STEPS], float) / unit
                    axis.plot(steps, values, marker=".", markersize=4, **style)
            axis.set_ylabel(label)
            axis.margins(x=0.02)
        grid[0, 0].set_ylim(-3, 103)
        # where nothing is ever touched, the line lies at the foot of the panel, not in its middle
        highest = max(1.0, grid[0, 1].get_ylim()[1])
        grid[0, 1].set_ylim(-0.03 * highest, highest)
        for axis in grid[1]:
            axis.set_ylim(bottom=0)
        for axis in (grid[-1, 0], grid[1, 1]):
            axis.set_xlabel(f"Flown steps learned from, {unit_name}")
            axis.tick_params(labelbottom=True)
        if rows == 2:
            grid[1, 0].set_xlabel(f"Flown steps learned from, {unit_name}")
        figure.align_ylabels()
        if any(runs):
            handles, labels = grid[0, 0].get_legend_handles_labels()
            columns = columns_of(max(map(len, labels)), min(4, len(labels)))
            figure.legend(handles, labels, loc="outside upper center", ncols=columns)
    return figure


def learning_curve(directory: Path) -> dict[str, NDArray[np.float64]]:
    """The curve that `uas-coverage train` has left in a directory.

    Raises:
        InputError: There is none, or it cannot be read.
    """
    path = directory / CURVE
    wanted = [_STEPS, *(column for column, _, _ in _PANELS)]
    try:
        rows = list(csv.DictReader(io.StringIO(read_text(path)), strict=True))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read ({error})") from error
    if not rows:
        raise InputError(f"{path}: holds no row; the training has not come so far yet")
    if _RETURN in rows[0]:
        wanted.append(_RETURN)
    lacking = [column for column in wanted if column not in rows[0]]
    if lacking:
        raise InputError(f"{path}: has no column {lacking[0]}")
    curve = {column: np.empty(len(rows)) for column in wanted}
    for k, row in enumerate(rows):
        for column in wanted:
            curve[column][k] = _number(row[column], f"{path}, line {k + 2}, {column}")
    return curve


def baseline_curves(directory: Path) -> dict[str, dict[str, NDArray[np.float64]]]:
    """The planners that do not learn beside a training: name -> curve of one row.

    Raises:
        InputError: A curve cannot be read.
    """
    tables = sorted((directory / BASELINES).glob(f"*/{CURVE}"))
    return {table.parent.name: learning_curve(table.parent) for table in tables}


def with_baselines(directories: Mapping[str, Path]) -> dict[str, Curve]:
    """The curves of trainings and, once each, those of the baselines that lie beside them.

    Args:
        directories: What a training is called in the legend, "" where it is alone -> its directory.

    Raises:
        InputError: A curve cannot be read.
    """
    beside: dict[str, Curve] = {}
    for name, directory in directories.items():
        for planner, curve in baseline_curves(directory).items():
            known = beside.get(planner)
            if known is None:
                beside[planner] = curve
            elif any(known[column][0] != curve[column][0] for column in curve if column in known):
                beside[f"{planner}, {name}"] = curve  # other missions
    curves: dict[str, Curve] = {}
    for name, directory in directories.items():
        curves[name or (directory.resolve().name if beside else "")] = learning_curve(directory)
    return {**curves, **{name: each for name, each in beside.items() if name not in curves}}


def _number(text: str | None, place: str) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"{place}: {text!r} should be a finite number")
    return value

"""Rows with a single column are bounds of that column.

low <= a x <= high is low / a <= x <= high / a (turned round where a < 0): the same points, and a
row less. Intervals of the capabilities and the faces of a box-shaped fence are such rows. The
tightest of all bounds is kept. Where they cross there is no feasible point; then the program is
left as it is, for the solver to say so.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from uas_coverage_baselines.milp_mpc.model.milp import BuiltMilp


def rows_as_bounds(milp: BuiltMilp) -> BuiltMilp:
    """The same program with its one-column rows as bounds."""
    length = np.diff(milp.row_start)
    single = length == 1
    entry = milp.row_start[:-1][single]
    column, coefficient = milp.column[entry], milp.coefficient[entry]
    ends = np.stack([milp.row_lower[single], milp.row_upper[single]]) / coefficient
    lower, upper = milp.lower.copy(), milp.upper.copy()
    np.maximum.at(lower, column, ends.min(axis=0))
    np.minimum.at(upper, column, ends.max(axis=0))
    if (lower > upper).any():
        return milp
    kept = np.repeat(~single, length)
    return replace(
        milp,
        lower=lower,
        upper=upper,
        row_start=np.concatenate([[0], np.cumsum(length[~single])]).astype(np.int32),
        column=milp.column[kept],
        coefficient=milp.coefficient[kept],
        row_lower=milp.row_lower[~single],
        row_upper=milp.row_upper[~single],
        row=milp.row[~single],
    )

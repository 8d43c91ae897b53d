"""Boxes around all fixed obstacles side by side: what a UAS is far from is known at once.

Most obstacles are far from most UAS in most steps. What their boxes say about them takes the
processor as long for four of them as for one, as long as they lie in columns.
"""

import math

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.compiled.views import slice_view

BLOCK = 64
"""So many obstacles are looked at at once; kernels take more in several turns."""

EPS_M = 1e-6
"""More than rounding can change in a distance [m]."""

MIDDLE, PER_HALF, NEAR, RISE, HULL_MIDDLE, HULL_HALF, BOX, MEASURED = 0, 3, 6, 7, 8, 11, 14, 20
"""First rows of `obstacle_columns`; NEAR and RISE have one, BOX and MEASURED six (lower and upper
corner), the others three."""

N_COLUMNS = 26

_FAR_M = 1e9


@inlined_kernel
def padded(n_obstacles):
    """Number of columns for so many obstacles: the compiler's loops take 16 at a time."""
    return (n_obstacles + 15) // 16 * 16


def obstacle_columns(obstacles: NDArray[np.void]) -> NDArray[np.float64]:
    """What all obstacles are asked for in every step, field by field.

    Args:
        obstacles: (O,) of OBSTACLE_DTYPE.

    Returns:
        (N_COLUMNS, `padded` O) C-contiguous; obstacles beyond the last are far away from all.
    """
    n_obstacles = len(obstacles)
    columns = np.zeros((N_COLUMNS, padded(n_obstacles)))
    for far in (MIDDLE, HULL_MIDDLE, BOX, MEASURED):
        columns[far : far + 3] = _FAR_M
    columns[BOX + 3 : BOX + 6] = columns[MEASURED + 3 : MEASURED + 6] = -_FAR_M
    columns[PER_HALF : PER_HALF + 3] = 1.0
    columns[NEAR] = math.inf
    columns[NEAR, :n_obstacles] = obstacles["near_m"]
    columns[RISE, :n_obstacles] = obstacles["rise_m"]
    for first, field in (
        (MIDDLE, "middle_m"),
        (PER_HALF, "per_half_m"),
        (HULL_MIDDLE, "hull_middle_m"),
        (HULL_HALF, "hull_half_m"),
        (BOX, "lower_m"),
        (BOX + 3, "upper_m"),
        (MEASURED, "measured_lower_m"),
        (MEASURED + 3, "measured_upper_m"),
    ):
        columns[first : first + 3, :n_obstacles] = obstacles[field].T
    return columns


@inlined_kernel
def halves_away(low, high, middle, per_half):
    """How far a range is from the middle of a box's side, over half of that side."""
    return max(low - middle, middle - high) * per_half


@inlined_kernel
def write_lower_bounds(columns, first, n, x0, y0, z0, x1, y1, z1, bound_m):
    """Lower bounds of the clearance of a segment from some obstacles, by the boxes around both.

    The distance D is convex. From the middle of an obstacle's box to its walls, where it is
    near_m, it has risen by rise_m; farther out it rises at least as fast.

    Of the n columns from `first` on, at most BLOCK: written to `bound_m`, -inf where the boxes
    meet.
    """
    x_low, x_high = min(x0, x1), max(x0, x1)
    y_low, y_high = min(y0, y1), max(y0, y1)
    z_low, z_high = min(z0, z1), max(z0, z1)
    middle_x = slice_view(columns[MIDDLE], first, n)
    middle_y = slice_view(columns[MIDDLE + 1], first, n)
    middle_z = slice_view(columns[MIDDLE + 2], first, n)
    per_half_x = slice_view(columns[PER_HALF], first, n)
    per_half_y = slice_view(columns[PER_HALF + 1], first, n)
    per_half_z = slice_view(columns[PER_HALF + 2], first, n)
    near_m = slice_view(columns[NEAR], first, n)
    rise_m = slice_view(columns[RISE], first, n)
    for o in range(n):
        times = max(0.0, halves_away(x_low, x_high, middle_x[o], per_half_x[o]))
        times = max(times, halves_away(y_low, y_high, middle_y[o], per_half_y[o]))
        times = max(times, halves_away(z_low, z_high, middle_z[o], per_half_z[o]))
        far_m = near_m[o] + rise_m[o] * (times - 1.0) - EPS_M
        bound_m[o] = far_m if times > 1.0 else -math.inf


@inlined_kernel
def write_meetings(columns, box, first, n, x0, y0, z0, x1, y1, z1, meets):
    """Which obstacles' boxes a segment may meet.

    Arguments as for `write_lower_bounds`; `box` is BOX, outside of which every point is near_m
    away, or MEASURED; `meets` is 1 where the boxes meet, 0 elsewhere.
    """
    x_low, x_high = min(x0, x1), max(x0, x1)
    y_low, y_high = min(y0, y1), max(y0, y1)
    z_low, z_high = min(z0, z1), max(z0, z1)
    lower_x = slice_view(columns[box], first, n)
    lower_y = slice_view(columns[box + 1], first, n)
    lower_z = slice_view(columns[box + 2], first, n)
    upper_x = slice_view(columns[box + 3], first, n)
    upper_y = slice_view(columns[box + 4], first, n)
    upper_z = slice_view(columns[box + 5], first, n)
    for o in range(n):
        beyond = max(lower_x[o] - x_high, x_low - upper_x[o])
        beyond = max(beyond, max(lower_y[o] - y_high, y_low - upper_y[o]))
        beyond = max(beyond, max(lower_z[o] - z_high, z_low - upper_z[o]))
        meets[o] = 0.0 if beyond > 0.0 else 1.0

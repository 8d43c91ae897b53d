"""Corners of legs, as an autopilot cuts them."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.geometry.nearest import nearest_on_segment

FloatArray = NDArray[np.float64]


def distances_m(points: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """(N,) distances of points (N, 3) from a straight line between two places [m]."""
    return nearest_on_segment(points, a, b).distance_m


def cut_path(corners: FloatArray, stops: list[bool], corner_m: float) -> FloatArray:
    """(N, 3) the path when every corner without a stop is cut as far as it may be.

    Args:
        corners: (C, 3) [m].
        stops: (C - 1,) whether the autopilot stops at the end of each leg.
        corner_m: How far from a corner it may pass [m].
    """
    path = [corners[0]]
    for before, corner, after, stop in zip(corners, corners[1:], corners[2:], stops, strict=False):
        path += [corner] if stop else cut_corner(before, corner, after, corner_m)
    return np.array([*path, corners[-1]])


def cut_corner(
    before: FloatArray, corner: FloatArray, after: FloatArray, corner_m: float
) -> list[FloatArray]:
    """Where a straight cut that comes no closer to a corner than `corner_m` leaves both legs.

    Half a leg is left in any case: an autopilot turns while it brakes and while it accelerates.
    """
    ways = [before - corner, after - corner]
    lengths = [max(float(np.linalg.norm(way)), 1e-9) for way in ways]
    units = [way / length for way, length in zip(ways, lengths, strict=True)]
    depth = 0.5 * float(np.linalg.norm(units[0] + units[1]))  # of a cut of 1 m on both legs
    return [
        corner + unit * min(corner_m / max(depth, 1e-9), 0.5 * length)
        for unit, length in zip(units, lengths, strict=True)
    ]

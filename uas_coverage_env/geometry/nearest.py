"""Where a straight segment comes nearest to points."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_LEAST_M2 = 1e-9  # a segment whose squared length is less is a point


class Nearest(NamedTuple):
    """The nearest places of a segment.

    Attributes:
        distance_m: (N,) from the points [m].
        share: (N,) of the way along the segment, 0..1.
        place_m: (N, 3) where they are [m].
    """

    distance_m: FloatArray
    share: FloatArray
    place_m: FloatArray


def nearest_on_segment(points_m: FloatArray, start_m: FloatArray, end_m: FloatArray) -> Nearest:
    """The places of a straight segment that are nearest to points.

    Args:
        points_m: (N, 3) [m].
        start_m: (3,) [m].
        end_m: (3,) [m].
    """
    way_m = end_m - start_m
    share = np.clip((points_m - start_m) @ way_m / max(way_m @ way_m, _LEAST_M2), 0.0, 1.0)
    place_m = start_m + share[:, None] * way_m
    return Nearest(np.linalg.norm(place_m - points_m, axis=1), share, place_m)

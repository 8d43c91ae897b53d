"""The outline of a body seen from above."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from uas_coverage_env.geometry import ConvexPolytope


def outline_of(hull: ConvexPolytope) -> NDArray[np.float64]:
    """(C, 2) [m] north and east of the corners of a body's hull from above, in their order."""
    flat = hull.vertices_m[:, :2]
    return flat[ConvexHull(flat - flat.mean(axis=0)).vertices]

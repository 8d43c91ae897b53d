"""Coverage cost coefficients that look beyond the horizon.

A receding horizon skims rows of waypoints and leaves single ones behind that cost a long way
later. The paper lets the coefficients W_Phi be adjusted to prioritise waypoints (Sec. III-C.5);
here a waypoint gains by the seconds of flight it takes off the shortest tree that connects what
is open: much at the fringe of the open set, nothing in its middle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import cdist

FloatArray = NDArray[np.float64]


def seconds_saved(open_waypoints_m: FloatArray, speed_mps: float) -> FloatArray:
    """(W,) by how much the tree of the open waypoints shrinks when each one is covered [s].

    Args:
        open_waypoints_m: (W, 3), distinct.
        speed_mps: at which the tree is flown.
    """
    between = cdist(open_waypoints_m[:, :2], open_waypoints_m[:, :2]) / speed_mps
    whole = _tree_s(between)
    rest = np.array(
        [_tree_s(np.delete(np.delete(between, w, axis=0), w, axis=1)) for w in range(len(between))]
    )
    return np.maximum(whole - rest, 0.0)


def _tree_s(between: NDArray[np.floating]) -> float:
    if len(between) < 2:
        return 0.0
    # zero would mean no edge: waypoints above each other are a millisecond apart
    return float(minimum_spanning_tree(np.maximum(between, 1e-3)).sum())

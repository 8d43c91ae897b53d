"""Tube MPC: clearances that grow along the horizon by what disturbances may do to a plan.

The paper's future work. A plan is what is flown in still air; in wind the UAS is somewhere in a
tube around it (`world.tubes`), which grows along the horizon. A face of a hull, of the fence or of
another UAS then has to be farther away by the tube's extent across the face, which is a number for
each face and sample. One step later the tube begins anew, at no width: what was planned with room
for k steps needs room for k - 1, and the step has led off by no more than the difference.

A UAS that has come nearer than that keeps the distance it has: it need not be where it cannot get.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def across(normals: FloatArray) -> FloatArray:
    """(F,) extent of a horizontal disc of radius 1 across faces with these normals (F, 3)."""
    return np.hypot(normals[:, 0], normals[:, 1])


def kept(tube_m: FloatArray, spare_m: FloatArray) -> FloatArray:
    """(G, N+1) what of a tube is kept by those that have only so much room now.

    Args:
        tube_m: (G, N+1).
        spare_m: (G,) room beyond the clearance at the first sample.
    """
    return np.minimum(tube_m, np.maximum(spare_m, 0.0)[:, None])

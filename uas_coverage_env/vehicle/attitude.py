"""The attitude of a body whose tilts are on axes that do not turn, for what draws and looks."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.vehicle.layout import PHI, PSI, THETA


def body_attitude(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Roll, pitch and yaw of UAS that look where they fly, see `layout`.

    Args:
        x: (..., 14) states.

    Returns:
        (..., 3) [rad] in the usual order of turns: yaw, then pitch, then roll. The yaw goes on
        counting beyond a half turn, as PSI does.
    """
    phi, theta, psi = x[..., PHI], x[..., THETA], x[..., PSI]
    sp, cp, st, ct = np.sin(phi), np.cos(phi), np.sin(theta), np.cos(theta)
    zero = np.zeros_like(phi)
    # axes of the body before its turn, in NED; then those that point forward and right
    before = np.stack([ct, zero, -st], axis=-1), np.stack([sp * st, cp, sp * ct], axis=-1)
    cs, ss = np.cos(psi)[..., None], np.sin(psi)[..., None]
    forward = cs * before[0] + ss * before[1]
    right = cs * before[1] - ss * before[0]
    roll = np.arctan2(right[..., 2], cp * ct)
    pitch = -np.arcsin(np.clip(forward[..., 2], -1.0, 1.0))
    yaw = np.arctan2(forward[..., 1], forward[..., 0]) - psi
    yaw = psi + np.arctan2(np.sin(yaw), np.cos(yaw))
    return np.stack([roll, pitch, yaw], axis=-1)

"""The attitude of a body whose tilts are on axes that do not turn, for what draws and looks.

A state says pitch, then roll, then the turn about the body's own axis (`layout`); others
say yaw, then pitch, then roll.
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from uas_coverage_env.vehicle import layout as S

FloatArray = NDArray[np.float64]
_Axes = Literal["YXZ", "ZYX"]


def body_attitude(x: FloatArray) -> FloatArray:
    """Roll, pitch and yaw of UAS that look where they fly.

    Args:
        x: (..., 14) states.

    Returns:
        (..., 3) [rad]; the yaw goes on counting beyond a half turn, as PSI does.
    """
    yaw, pitch, roll = _turned("YXZ", x[..., [S.THETA, S.PHI, S.PSI]], "ZYX")
    return np.stack([roll, pitch, _near(yaw, x[..., S.PSI])], axis=-1)


def tilts_and_turn(attitude_rad: FloatArray) -> FloatArray:
    """PHI, THETA and PSI of UAS that look where they fly, from roll, pitch and yaw (..., 3)."""
    theta, phi, psi = _turned("ZYX", attitude_rad[..., ::-1], "YXZ")
    return np.stack([phi, theta, _near(psi, attitude_rad[..., 2])], axis=-1)


def _turned(before: _Axes, angles_rad: FloatArray, after: _Axes) -> FloatArray:
    """(3, ...) the angles about the axes `after` of the same rotation."""
    rotation = Rotation.from_euler(before, angles_rad.reshape(-1, 3))
    return np.moveaxis(rotation.as_euler(after).reshape(angles_rad.shape), -1, 0)


def _near(angle: FloatArray, other: FloatArray) -> FloatArray:
    """The same angle, within half a turn of another."""
    return other + np.angle(np.exp(1j * (angle - other)))

"""The attitude of a body whose tilts are on axes that do not turn, for what draws and looks.

A state says pitch, then roll, then the turn about the body's own axis (`layout`); others
say yaw, then pitch, then roll.
"""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.vehicle.layout import PHI, PSI, THETA

FloatArray = NDArray[np.float64]


def body_attitude(x: FloatArray) -> FloatArray:
    """Roll, pitch and yaw of UAS that look where they fly.

    Args:
        x: (..., 14) states.

    Returns:
        (..., 3) [rad]; the yaw goes on counting beyond a half turn, as PSI does.
    """
    down = _down(x[..., PHI], x[..., THETA])
    north, east = _before_the_turn(x[..., PHI], x[..., THETA])
    cos, sin = np.cos(x[..., PSI])[..., None], np.sin(x[..., PSI])[..., None]
    forward, right = cos * north + sin * east, cos * east - sin * north
    roll = np.arctan2(right[..., 2], down[..., 2])
    pitch = -np.arcsin(np.clip(forward[..., 2], -1.0, 1.0))
    yaw = np.arctan2(forward[..., 1], forward[..., 0])
    return np.stack([roll, pitch, _near(yaw, x[..., PSI])], axis=-1)


def tilts_and_turn(attitude_rad: FloatArray) -> FloatArray:
    """PHI, THETA and PSI of UAS that look where they fly, from roll, pitch and yaw (..., 3)."""
    roll, pitch, yaw = np.moveaxis(attitude_rad, -1, 0)
    # the axis down through the body, before and after the yaw
    ahead, aside, below = np.moveaxis(_down(roll, pitch), -1, 0)
    cos, sin = np.cos(yaw), np.sin(yaw)
    to_north, to_east = cos * ahead - sin * aside, sin * ahead + cos * aside
    phi, theta = -np.arcsin(np.clip(to_east, -1.0, 1.0)), np.arctan2(to_north, below)
    north, east = _before_the_turn(phi, theta)
    forward = np.stack([np.cos(pitch) * cos, np.cos(pitch) * sin, -np.sin(pitch)], axis=-1)
    psi = np.arctan2((forward * east).sum(axis=-1), (forward * north).sum(axis=-1))
    return np.stack([phi, theta, _near(psi, yaw)], axis=-1)


def _down(roll: FloatArray, pitch: FloatArray) -> FloatArray:
    """(..., 3) NED: the axis down through a body that has pitched and rolled."""
    across = np.cos(roll)
    return np.stack([across * np.sin(pitch), -np.sin(roll), across * np.cos(pitch)], axis=-1)


def _before_the_turn(phi: FloatArray, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(..., 3) NED: the axes of a tilted body that point to the north and to the east."""
    across, along = np.sin(phi), np.cos(theta)
    north = np.stack([along, np.zeros_like(phi), -np.sin(theta)], axis=-1)
    return north, np.stack([across * np.sin(theta), np.cos(phi), across * along], axis=-1)


def _near(angle: FloatArray, other: FloatArray) -> FloatArray:
    """The same angle, within half a turn of another."""
    return other + np.angle(np.exp(1j * (angle - other)))

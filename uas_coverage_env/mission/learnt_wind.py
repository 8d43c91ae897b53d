"""The wind that each UAS is in, found out by a planner from what it sees.

The inner loop does the same (`autopilot.belief`), but planners do not see what it learns. A
horizontal axis is position, velocity, tilt and rate, with the angular acceleration as input; drag
pulls the velocity towards that of the wind. What a velocity is off by after a step, the angular
acceleration being known from the rates, is the wind's.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.autopilot.belief import MOST_WIND, wind_growth
from uas_coverage_env.entities.state import FLYING, N_BELIEF, WIND
from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.governor import design_velocity_loop, horizontal_axis
from uas_coverage_env.vehicle.tube import belief_gain
from uas_coverage_env.world import Arena, SwarmState

FloatArray = NDArray[np.float64]

MEAN_HEIGHT_M = 20.0
"""The height of the mean wind of a fleet [m]."""

_MEAN_S = 30.0  # most turbulence is over sooner
# north and east: state of the axis, and what of it is negative forward
_STATES = ((S.X, S.VX, S.THETA, S.WY), (S.Y, S.VY, S.PHI, S.WX))
_FORWARD = np.array([[1.0, 1.0, -1.0, -1.0], [1.0, 1.0, 1.0, 1.0]])


def axes(x: FloatArray) -> FloatArray:
    """(..., 2, 4) position, velocity, tilt and rate north and east of states (..., 14)."""
    return np.asarray(x[..., _STATES] * _FORWARD)


def in_disturbances(arena: Arena) -> Arena:
    """The same arena, for kernels that fly as believed."""
    rules = arena.rules.copy()
    rules["disturbed"] = True
    return arena._replace(rules=rules)


class LearntWind:
    """Finds out the wind of each UAS, and the mean wind of the fleet.

    Args:
        brief: The mission.

    Attributes:
        belief: (U, N_BELIEF) as the world's kernels take it, the wind alone.
        mean_mps: (2,) at MEAN_HEIGHT_M, of all UAS and the last half minute, north and east [m/s].
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._axis = [horizontal_axis(vehicle, brief.dt_s) for vehicle in brief.vehicles]
        loops = [design_velocity_loop(vehicle, brief.dt_s) for vehicle in brief.vehicles]
        self._most_mps = [MOST_WIND * loop.reference_max_mps for loop in loops]
        self._gain = belief_gain(brief.dt_s)
        self.belief = np.zeros((len(brief.uas), N_BELIEF))
        self._before: SwarmState | None = None
        self._seen = np.zeros(len(brief.uas), np.int64)
        self.mean_mps, self._samples = np.zeros(2), 0
        self._mean_gain = 1.0 - math.exp(-brief.dt_s / _MEAN_S)

    @property
    def wind_mps(self) -> FloatArray:
        """(U, 2) north and east [m/s]."""
        return self.belief[:, WIND : WIND + 2]

    def see(self, swarm: SwarmState) -> None:
        """Learn from one more sample."""
        before, self._before = self._before, swarm
        if before is not None and swarm.step == before.step + 1:
            flying = np.flatnonzero((before.status == FLYING) & (swarm.status == FLYING)).tolist()
            for i in flying:
                self._learn(i, axes(before.x[i]), axes(swarm.x[i]))
            if flying:
                self._samples += 1
                gain = max(self._mean_gain, 1.0 / self._samples)
                grown = [wind_growth(-swarm.x[i, S.Z], MEAN_HEIGHT_M) for i in flying]
                wind_mps = (self.wind_mps[flying] / np.array(grown)[:, None]).mean(axis=0)
                self.mean_mps += gain * (wind_mps - self.mean_mps)

    def _learn(self, i: int, before: FloatArray, now: FloatArray) -> None:
        A, B = self._axis[i]
        alpha = (now[:, S.RATE] - before[:, S.RATE]) / B[S.RATE]  # whatever was flown
        off_mps = now[:, S.SPEED] - (before @ A[S.SPEED] + B[S.SPEED] * alpha)
        gain = max(self._gain, 1.0 / (1.0 + self._seen[i]))
        self._seen[i] += 1
        wind_mps = self.wind_mps[i]
        wind_mps += gain * (off_mps / (1.0 - A[S.SPEED, S.SPEED]) - wind_mps)
        wind_mps *= min(1.0, self._most_mps[i] / max(float(np.hypot(*wind_mps)), 1e-9))

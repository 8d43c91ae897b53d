"""How a plan of still air is flown in wind: what the wind is, and the commands that fly the plan.

A horizontal axis is position, velocity v, tilt and rate, with the angular acceleration as input;
drag pulls towards the wind's velocity w. With the tilt counted from that of a hover in the wind,
tilt + trim · w, these are the equations of still air: a plan that starts there is right in the
wind, which is found out as the inner loop finds it out. What it does beyond, the tube is for.

The inner loop asks for -gain · (v - r, tilt + trim (w - r), rate). Told the velocity r for which
that is the plan's angular acceleration, it flies the plan, within the governor's bounds, and holds
against the wind. Where a plan goes on that was made before, what it is off by is fed back, the
position too.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are

from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.vehicle import (
    PHI,
    TAU_X,
    TAU_Y,
    THETA,
    VX,
    VY,
    WX,
    WY,
    VehicleParams,
    X,
    Y,
    Z,
)
from uas_coverage_env.vehicle.governor import design_velocity_loop, horizontal_axis
from uas_coverage_env.vehicle.tube import belief_gain
from uas_coverage_env.world import FLYING, Mode, SwarmState, Velocity

FloatArray = NDArray[np.float64]

# north and east: state of the axis, what of it is negative forward, and the torque
_STATES = ((X, VX, THETA, WY), (Y, VY, PHI, WX))
_FORWARD = np.array([[1.0, 1.0, -1.0, -1.0], [1.0, 1.0, 1.0, 1.0]])
_HOLDING_COST = 10.0
_TORQUES = ((TAU_Y, -1.0, 1), (TAU_X, 1.0, 0))


@lru_cache(maxsize=64)
def position_gain(vehicle: VehicleParams, dt_s: float) -> FloatArray:
    """(4,) of position, velocity, tilt and rate: what holds a vehicle to a place in a plan.

    The linear-quadratic regulator that weighs a metre, a metre per second and 0.3 rad/s² alike.
    """
    A, B = horizontal_axis(vehicle, dt_s)
    cost, B = np.array([[_HOLDING_COST]]), B[:, None]
    P = solve_discrete_are(A, B, np.diag([1.0, 1.0, 0.0, 0.0]), cost)
    gain: FloatArray = np.linalg.solve(cost + B.T @ P @ B, B.T @ P @ A)[0]
    return gain


def axes(x: FloatArray) -> FloatArray:
    """(..., 2, 4) position, velocity, tilt and rate north and east of states (..., 14)."""
    return np.asarray(x[..., _STATES] * _FORWARD)


class InWind:
    """Finds out the wind of each UAS, and commands what a plan leads to in it.

    Args:
        brief: the mission.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._names = {uas.name: i for i, uas in enumerate(brief.uas)}
        self._vehicles, self._dt_s = brief.vehicles, brief.dt_s
        self._axis = [horizontal_axis(vehicle, brief.dt_s) for vehicle in brief.vehicles]
        self._loop = [design_velocity_loop(vehicle, brief.dt_s).gain for vehicle in brief.vehicles]
        self._hold = [position_gain(vehicle, brief.dt_s) for vehicle in brief.vehicles]
        self.wind_mps = np.zeros((len(brief.uas), 2))
        self._before: SwarmState | None = None
        self._seen = np.zeros(len(brief.uas), np.int64)

    def see(self, swarm: SwarmState) -> SwarmState:
        """Learn the wind from one more sample; returns it with tilts as in still air."""
        before, self._before = self._before, swarm
        if before is not None and swarm.step == before.step + 1:
            for i in np.flatnonzero((before.status == FLYING) & (swarm.status == FLYING)).tolist():
                self._learn(i, axes(before.x[i]), axes(swarm.x[i]))
        x = swarm.x.copy()
        for i, vehicle in enumerate(self._vehicles):
            lean_rad = vehicle.trim_tilt_rad_per_mps * self.wind_mps[i]
            x[i, THETA] -= lean_rad[0]
            x[i, PHI] += lean_rad[1]
        return replace(swarm, x=x)

    def _learn(self, i: int, before: FloatArray, now: FloatArray) -> None:
        A, B = self._axis[i]
        alpha = (now[:, 3] - before[:, 3]) / B[3]  # whatever was flown
        off_mps = now[:, 1] - (before @ A[1] + B[1] * alpha)
        gain = max(belief_gain(self._dt_s), 1.0 / (1.0 + self._seen[i]))
        self._seen[i] += 1
        self.wind_mps[i] += gain * (off_mps / (1.0 - A[1, 1]) - self.wind_mps[i])

    def velocities(
        self, plan: Plan, swarm: SwarmState, mode: Callable[[str], Mode]
    ) -> dict[str, Velocity]:
        """The velocities and heights that fly the first step of a plan, for every active UAS.

        Args:
            plan: for all of them.
            swarm: as `see` returns it.
            mode: of a UAS.
        """
        result: dict[str, Velocity] = {}
        for name in swarm.active:
            row, i = plan.of(name), self._names[name]
            vehicle, k = self._vehicles[i], self._loop[i]
            state = axes(swarm.x[i])
            alpha = np.array(
                [
                    sign * plan.u[row, 0, torque] / vehicle.airframe.inertia_kgm2[axis]
                    for torque, sign, axis in _TORQUES
                ]
            )
            alpha -= (state - axes(plan.x[row, 0])) @ self._hold[i]
            asked = alpha + state[:, 1:] @ k
            velocity_mps = asked / (k[0] + k[1] * vehicle.trim_tilt_rad_per_mps)
            north_mps, east_mps = self._within(i, velocity_mps)
            result[name] = Velocity(north_mps, east_mps, -float(plan.x[row, 1, Z]), mode=mode(name))
        return result

    def _within(self, i: int, velocity_mps: FloatArray) -> tuple[float, float]:
        most_mps = self._vehicles[i].limits.v_xy_max_mps
        share = min(1.0, most_mps / max(math.hypot(*velocity_mps), 1e-9))
        return float(share * velocity_mps[0]), float(share * velocity_mps[1])

"""How a plan of still air is flown in wind: what the wind is, and the commands that fly the plan.

A horizontal axis is position, velocity v, tilt and rate, with the angular acceleration as input;
drag pulls towards the wind's velocity w. With the tilt counted from that of a hover in the wind,
tilt + trim · w, these are the equations of still air: a plan that starts there is right in the
wind, which is found out as the inner loop finds it out. What it does beyond, the tube is for.

The inner loop asks for -gain · (v - r, tilt + trim (w - r), rate). Told the velocity r for which
that is the plan's angular acceleration, it flies the plan, within the governor's bounds, and holds
against the wind.

A plan that was made before begins where the UAS should be, not where it is. It goes on from there
with what it is off by fed back, the position too: as the tube has it, in which there is room for
that (constraint tightening: Chisci, Rossiter and Zappa, Automatica 37(7), 2001). Of a fleet that
plans in turn, all but one go on so.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are

from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem
from uas_coverage_env.entities.commands import Mode
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.learnt_wind import LearntWind, axes
from uas_coverage_env.vehicle import LinearModel, VehicleParams
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.governor import ORDER, design_velocity_loop, horizontal_axis
from uas_coverage_env.vehicle.linear import rigid_body, taylor
from uas_coverage_env.world import SwarmState, Velocity

FloatArray = NDArray[np.float64]

_HOLDING_COST = 10.0
# of the angular acceleration north and east
_TORQUES = ((S.TAU_Y, -1.0, 1), (S.TAU_X, 1.0, 0))


@lru_cache(maxsize=64)
def position_gain(vehicle: VehicleParams, dt_s: float) -> FloatArray:
    """(4,) of position, velocity, tilt and rate: what holds a vehicle to a place in a plan.

    The linear-quadratic regulator that weighs a metre, a metre per second and 0.3 rad/s² alike.
    """
    return _regulator(*horizontal_axis(vehicle, dt_s), _HOLDING_COST)


@lru_cache(maxsize=64)
def climb_gain(vehicle: VehicleParams, dt_s: float) -> FloatArray:
    """(2,) [N/m, N s/m] of height and climb, for the lift; a metre weighs as much as 3 m/s²."""
    A, B = taylor(*rigid_body(vehicle), dt_s, ORDER)
    own = [S.Z, S.VZ]
    return _regulator(A[np.ix_(own, own)], B[own, S.LIFT], 0.1 / vehicle.airframe.mass_kg**2)


def _regulator(A: FloatArray, B: FloatArray, cost: float) -> FloatArray:
    """Gain of the linear-quadratic regulator of position and velocity, one each, and one input."""
    Q = np.zeros_like(A)
    Q[0, 0] = Q[1, 1] = 1.0
    costs, B = np.array([[cost]]), B[:, None]
    P = solve_discrete_are(A, B, Q, costs)
    gain: FloatArray = np.linalg.solve(costs + B.T @ P @ B, B.T @ P @ A)[0]
    return gain


class InWind:
    """Finds out the wind of each UAS, and commands what a plan leads to in it.

    Args:
        brief: the mission.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._names = {uas.name: i for i, uas in enumerate(brief.uas)}
        self._vehicles = brief.vehicles
        self._loop = [design_velocity_loop(vehicle, brief.dt_s).gain for vehicle in brief.vehicles]
        self._hold = [position_gain(vehicle, brief.dt_s) for vehicle in brief.vehicles]
        self._climb = [climb_gain(vehicle, brief.dt_s) for vehicle in brief.vehicles]
        self._learnt = LearntWind(brief)

    @property
    def wind_mps(self) -> FloatArray:
        """(U, 2) that is learnt so far, north and east [m/s]."""
        return self._learnt.wind_mps

    def see(self, swarm: SwarmState) -> SwarmState:
        """Learn the wind from one more sample; returns it with tilts as in still air."""
        self._learnt.see(swarm)
        x = swarm.x.copy()
        for i, vehicle in enumerate(self._vehicles):
            lean_rad = vehicle.trim_tilt_rad_per_mps * self.wind_mps[i]
            x[i, S.THETA] -= lean_rad[0]
            x[i, S.PHI] += lean_rad[1]
        return replace(swarm, x=x)

    def from_here(self, plan: Plan | None, problem: PlanningProblem) -> Plan | None:
        """What is left of a plan, from where the UAS of the problem are."""
        if plan is None:
            return None
        x, u = plan.x.copy(), plan.u.copy()
        for uas, name in enumerate(problem.names):
            if name in plan.names:
                row, i = plan.of(name), self._names[name]
                self._go_on(i, problem.models[uas], problem.x0[uas], x[row], u[row])
        return replace(plan, x=x, u=u)

    def _go_on(
        self, i: int, model: LinearModel, x0: FloatArray, x: FloatArray, u: FloatArray
    ) -> None:
        """Change states (n+1, 14) and inputs (n, 5) such that they lead back from x0."""
        vehicle, off, climb = self._vehicles[i], x0 - x[0], self._climb[i]
        for k in range(len(u)):
            x[k] += off
            asked, planned = -axes(off) @ self._hold[i], u[k].copy()
            for (torque, sign, axis), alpha in zip(_TORQUES, asked, strict=True):
                most_Nm = vehicle.torque_max_Nm[axis]
                u[k, torque] += sign * vehicle.airframe.inertia_kgm2[axis] * alpha
                u[k, torque] = min(max(u[k, torque], -most_Nm), most_Nm)
            u[k, S.LIFT] -= climb @ off[[S.Z, S.VZ]]
            off = model.A @ off + model.B @ (u[k] - planned)
        x[len(u)] += off

    def velocities(
        self, plan: Plan, swarm: SwarmState, mode: Callable[[str], Mode]
    ) -> dict[str, Velocity]:
        """The velocities and heights that fly the first step of a plan, for every active UAS.

        Args:
            plan: for all of them, from where they are.
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
            asked = alpha + state[:, 1:] @ k
            velocity_mps = asked / (k[0] + k[1] * vehicle.trim_tilt_rad_per_mps)
            north_mps, east_mps = self._within(i, velocity_mps)
            result[name] = Velocity(
                north_mps, east_mps, -float(plan.x[row, 1, S.Z]), mode=mode(name)
            )
        return result

    def _within(self, i: int, velocity_mps: FloatArray) -> tuple[float, float]:
        most_mps = self._vehicles[i].limits.v_xy_max_mps
        share = min(1.0, most_mps / max(math.hypot(*velocity_mps), 1e-9))
        return float(share * velocity_mps[0]), float(share * velocity_mps[1])

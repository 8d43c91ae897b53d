"""Vehicle physical constraints (OCP_3)."""

from __future__ import annotations

import numpy as np

from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.norm_bounds import NORMS
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables
from uas_coverage_env.geometry import cylinder_faces
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.layout import CURRENT, VOLTAGE


class Capabilities:
    """x(n) in X, u(n) in U: what airframe, power train and battery can do (Sec. III-C.1, OCP_3).

    Euclidean norms of horizontal velocity, tilt and tilt rate are bounded by polygons inside the
    limits (eq. (const_Vec_ub), c_in = cos(pi / H), see `norm_bounds`), so that no plan exceeds
    what the world allows; everything else by intervals. The thrust
    correction Delta T is bounded below by the same piecewise-linear form the world computes it
    with, and is driven onto that bound by its cost through the depth of discharge.

    | symbol | meaning | attribute |
    | --- | --- | --- |
    | X | limits of states | `problem.limit(NAME)`: `vehicle.limits` |
    | U | limits of inputs | likewise, `problem.torque_max_Nm` |
    | H_P, c_in | polygons of the norms | `problem.limit_sides`, `problem.norm_bounds` |
    | Delta T | thrust correction f_T, Sec. II | `v.u[..., DELTA_THRUST]`, columns `thrust.*` |
    | C, D, F | battery's outputs | `problem.models` |
    """

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add the rows of states at n = 1..N and inputs at n = 0..N-1."""
        self._norms(milp, v, problem)
        self._intervals(milp, v, problem)
        self._thrust_correction(milp, v, problem)
        self._battery(milp, v, problem)

    def _norms(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        faces = cylinder_faces(problem.limit_sides)[:, :2]
        for row, (name, first, second, _) in enumerate(NORMS):
            pair = v.x[:, 1:, None, [first, second]]
            bound = np.array([bounds.upper[row] for bounds in problem.norm_bounds])
            milp.subject_to(f"capabilities.{name}", (faces, pair), upper=bound)

    def _intervals(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        def limit(name: str) -> np.ndarray:
            return problem.limit(name)[:, None]

        torque = [problem.torque_max_Nm(axis)[:, None] for axis in range(3)]
        cutoff = np.array([vehicle.battery.dod_cutoff for vehicle in problem.vehicles])[:, None]
        for name, columns, low, high in (
            ("climb", v.x[:, 1:, S.VZ], -limit("v_up_max_mps"), limit("v_down_max_mps")),
            ("yaw", v.x[:, 1:, S.PSI], -limit("yaw_max_rad"), limit("yaw_max_rad")),
            (
                "yaw_rate",
                v.x[:, 1:, S.WZ],
                -limit("yaw_rate_max_radps"),
                limit("yaw_rate_max_radps"),
            ),
            ("dod", v.x[:, 1:, S.DOD], -np.inf, cutoff),
            ("lift", v.u[:, :, S.LIFT], limit("lift_min_N"), limit("lift_max_N")),
            ("torque_x", v.u[:, :, S.TAU_X], -torque[0], torque[0]),
            ("torque_y", v.u[:, :, S.TAU_Y], -torque[1], torque[1]),
            ("torque_z", v.u[:, :, S.TAU_Z], -torque[2], torque[2]),
            (
                "delta_thrust",
                v.u[:, :, S.DELTA_THRUST],
                limit("delta_thrust_min_N"),
                limit("delta_thrust_max_N"),
            ),
        ):
            milp.subject_to(
                f"capabilities.{name}", (1.0, columns[..., None]), lower=low, upper=high
            )

    def _thrust_correction(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Delta T >= L - k_z v_z + h + q with h, q the costs of speed and of excess tilt."""
        faces = cylinder_faces(problem.physical_sides)[:, :2]
        corrections = [vehicle.thrust_correction for vehicle in problem.vehicles]
        shape = v.u.shape[:2]
        speed = milp.variables("thrust.speed", shape, lower=0.0)
        tilt = milp.variables("thrust.tilt", shape, lower=0.0)
        per_speed = np.array([c.speed_N_per_mps for c in corrections])[:, None, None, None]
        per_tilt = np.array([c.tilt_N_per_rad for c in corrections])[:, None, None, None]
        trim = np.array([vehicle.trim_tilt_rad_per_mps for vehicle in problem.vehicles])
        trim = trim[:, None, None, None]
        velocity, attitude = v.x[:, :-1, None, [S.VX, S.VY]], v.x[:, :-1, None, [S.PHI, S.THETA]]
        milp.subject_to(
            "thrust.of_speed",
            (1.0, speed[..., None, None]),
            (-per_speed * faces, velocity),
            lower=0.0,
        )
        # excess over the trim tilt: (phi - trim v_y, theta + trim v_x)
        turned = np.stack([-faces[:, 1], faces[:, 0]], axis=1)
        milp.subject_to(
            "thrust.of_tilt",
            (1.0, tilt[..., None, None]),
            (-per_tilt * faces, attitude),
            (per_tilt * trim * turned, velocity),
            lower=0.0,
        )
        # without climbs both rows are the same
        for name in ("climb",) if problem.planar else ("climb", "descent"):
            per_climb = np.array([getattr(c, f"{name}_N_per_mps") for c in corrections])
            milp.subject_to(
                f"thrust.correction_{name}",
                (1.0, v.u[:, :, S.DELTA_THRUST, None]),
                (-1.0, v.u[:, :, S.LIFT, None]),
                (per_climb[:, None, None], v.x[:, :-1, S.VZ, None]),
                (-1.0, speed[..., None]),
                (-1.0, tilt[..., None]),
                lower=0.0,
            )

    def _battery(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Output equations: the battery's current and voltage stay within its limits."""
        states = v.x[:, :-1, [S.DOD, S.U_TH]]
        thrust = v.u[:, :, [S.DELTA_THRUST]]
        C = np.array([model.C[:, [S.DOD, S.U_TH]] for model in problem.models])
        D = np.array([model.D[:, [S.DELTA_THRUST]] for model in problem.models])
        F = np.array([model.F for model in problem.models])
        voltage_min = np.array([x.battery.voltage_min_V for x in problem.vehicles])
        current_max = np.array([x.battery.current_max_A for x in problem.vehicles])
        milp.subject_to(
            "capabilities.voltage",
            (C[:, None, VOLTAGE], states),
            (D[:, None, VOLTAGE], thrust),
            lower=(voltage_min - F[:, VOLTAGE])[:, None],
        )
        milp.subject_to(
            "capabilities.current",
            (C[:, None, CURRENT], states),
            (D[:, None, CURRENT], thrust),
            lower=-F[:, CURRENT][:, None],
            upper=(current_max - F[:, CURRENT])[:, None],
        )

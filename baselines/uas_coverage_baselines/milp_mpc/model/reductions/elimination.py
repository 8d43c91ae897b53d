"""States that need no columns: yaw at rest, and the battery as a function of thrust.

Yaw. psi, omega_z and tau_z occur in each other's dynamics, limits and costs and nowhere else
(checked in A and B), so that the OCP falls apart into flight and yaw. Where yaw is at rest at
psi = 0, doing nothing costs nothing and is feasible: the three are zero in an optimum, `ABSENT`.
For a UAS that has turned they keep their columns.

Battery. DoD and u_th depend on each other and on Delta T alone:

    z(n) = A_b^n z(0) + sum_{k<n} A_b^{n-1-k} (B_b Delta T(k) + E_b),

put in wherever the battery occurs: its cost, the cutoff, least voltage and largest current. Of
these rows those are left out which hold for all Delta T within its limits. The same points, with
columns for Delta T only; DoD and u_th are `ELIMINATED`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from uas_coverage_baselines.milp_mpc.model.blocks import Capabilities, Slack
from uas_coverage_baselines.milp_mpc.model.milp import ABSENT, ELIMINATED, Milp
from uas_coverage_baselines.milp_mpc.model.ocp import shared_variables
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables
from uas_coverage_env.vehicle import LinearModel
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.layout import VOLTAGE

_BATTERY = [S.DOD, S.U_TH]
_DOD = _BATTERY.index(S.DOD)
_VOLTAGE, _CURRENT = range(2)  # of the outputs from VOLTAGE on
_YAW = [S.PSI, S.WZ]
_MOTION = [state for state in range(S.N_STATES) if state not in _BATTERY]
_AT_REST = 1e-9  # far below the solver's tolerance


def motion_variables(milp: Milp, problem: PlanningProblem) -> Variables:
    """The shared columns without Phi, the battery, and the yaw of UAS that have not turned."""
    turned = np.abs(problem.x0[:, _YAW]).max(axis=1) > _AT_REST
    for row, model in enumerate(problem.models):
        turned[row] |= not _yaw_stands_alone(model)
    states = np.ones((problem.n_uas, S.N_STATES), bool)
    states[:, _BATTERY] = False
    states[:, _YAW] = turned[:, None]
    inputs = np.ones((problem.n_uas, S.N_INPUTS), bool)
    inputs[:, S.TAU_Z] = turned
    v = shared_variables(milp, problem, states=states, inputs=inputs, coverage_state=False)
    x = v.x.copy()
    x[:, :, _BATTERY] = ELIMINATED
    return replace(v, x=x)


class MotionDynamics:
    """`Dynamics` of all states but the battery's."""

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add the rows; those of a yaw at rest read 0 = 0 and are not made."""
        motion = [state for state in _MOTION if state in problem.states]
        A = np.array([model.A[np.ix_(motion, motion)] for model in problem.models])
        B = np.array([model.B[motion] for model in problem.models])
        E = np.array([model.E[motion] for model in problem.models])
        x = v.x[:, :, motion]
        milp.subject_to(
            "dynamics",
            (1.0, x[:, 1:, :, None]),
            (-A[:, None], x[:, :-1, None, :]),
            (-B[:, None], v.u[:, :, None, :]),
            lower=E[:, None, :],
            upper=E[:, None, :],
        )


class MotionCapabilities(Capabilities):
    """`Capabilities` without the battery's."""

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add the rows."""
        super().add_to(milp, _battery_left_out(v), problem)

    def _battery(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Nothing: `BatteryFromThrust` has these rows."""


class MotionSlack:
    """`Slack` without the cost of the depth of discharge."""

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add columns, rows and part I of the objective; the constant is that of `Slack`."""
        Slack().add_to(milp, _battery_left_out(v), problem)


class BatteryFromThrust:
    """Cost and limits of the battery, written in Delta T."""

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add the rows that Delta T can break, and the cost of the depth of discharge."""
        for uas, (vehicle, model) in enumerate(zip(problem.vehicles, problem.models, strict=True)):
            start, gain = _response(model, problem.x0[uas, _BATTERY], problem.horizon)
            thrust = v.u[uas, :, S.DELTA_THRUST]
            per_dod = problem.weights.energy / model.E[S.DOD]
            milp.minimize(per_dod * gain[1:, _DOD].sum(axis=0), thrust)
            milp.add_constant(per_dod * float(start[1:, _DOD].sum()))
            C, D = model.C[VOLTAGE:, _BATTERY], model.D[VOLTAGE:, S.DELTA_THRUST]
            own = np.eye(problem.horizon)[:, None, :]  # Delta T of the same step
            output = np.einsum("oz,nzk->nok", C, gain[:-1]) + D[:, None] * own
            level = start[:-1] @ C.T + model.F[VOLTAGE:]
            battery, limits = vehicle.battery, vehicle.limits
            span = (limits.delta_thrust_min_N, limits.delta_thrust_max_N)
            for name, rows, at_rest, low, high in (
                ("dod", gain[1:, _DOD], start[1:, _DOD], -np.inf, battery.dod_cutoff),
                ("voltage", output[:, _VOLTAGE], level[:, _VOLTAGE], battery.voltage_min_V, np.inf),
                ("current", output[:, _CURRENT], level[:, _CURRENT], 0.0, battery.current_max_A),
            ):
                least = at_rest + np.minimum(rows * span[0], rows * span[1]).sum(axis=1)
                most = at_rest + np.maximum(rows * span[0], rows * span[1]).sum(axis=1)
                milp.subject_to(
                    f"battery.{name}.{problem.names[uas]}",
                    (rows, thrust[None, :]),
                    lower=low - at_rest,
                    upper=high - at_rest,
                    where=(least < low) | (most > high),
                )


def flown_states(problem: PlanningProblem, inputs: np.ndarray) -> np.ndarray:
    """(U, N+1, 14) all states, eliminated ones too, under inputs (U, N, 5)."""
    x = np.empty((problem.n_uas, inputs.shape[1] + 1, S.N_STATES))
    x[:, 0] = problem.x0
    for uas, model in enumerate(problem.models):
        for n, u in enumerate(inputs[uas]):
            x[uas, n + 1] = model.A @ x[uas, n] + model.B @ u + model.E
    return x


def _battery_left_out(v: Variables) -> Variables:
    return replace(v, x=np.where(v.x == ELIMINATED, ABSENT, v.x))


def _yaw_stands_alone(model: LinearModel) -> bool:
    rest = [state for state in range(S.N_STATES) if state not in _YAW]
    others = [i for i in range(S.N_INPUTS) if i != S.TAU_Z]
    apart = not model.A[np.ix_(rest, _YAW)].any() and not model.A[np.ix_(_YAW, rest)].any()
    apart = apart and not model.B[rest, S.TAU_Z].any() and not model.B[np.ix_(_YAW, others)].any()
    return bool(apart and not model.E[_YAW].any())


def _response(model: LinearModel, z0: np.ndarray, horizon: int) -> tuple[np.ndarray, np.ndarray]:
    """z(n) = start[n] + gain[n] Delta T: (N+1, 2) and (N+1, 2, N)."""
    A, B, E = model.A[np.ix_(_BATTERY, _BATTERY)], model.B[_BATTERY, S.DELTA_THRUST], model.E
    start = np.empty((horizon + 1, 2))
    gain = np.zeros((horizon + 1, 2, horizon))
    start[0] = z0
    for n in range(horizon):
        start[n + 1] = A @ start[n] + E[_BATTERY]
        gain[n + 1] = A @ gain[n]
        gain[n + 1, :, n] += B
    return start, gain

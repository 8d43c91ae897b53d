"""System dynamics (OCP_1)."""

from __future__ import annotations

import numpy as np

from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables


class Dynamics:
    """x(n+1) = A x(n) + B u(n) + E with x(0) measured (Sec. III-C.1, eq. (OCP_1)).

    The matrices are those of the measured depth of discharge, held over the horizon.

    | symbol | meaning | attribute |
    | --- | --- | --- |
    | A_d, B_d, E_d | model of the measured depth of discharge | `problem.models`: `A`, `B`, `E` |
    | x(n), u(n) | predicted states, inputs | `v.x` (U, N+1, 14), `v.u` (U, N, 5) |
    | x_0 | measured state | `problem.x0`, bounds of `v.x[:, 0]` |
    """

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add the rows; x(0) is fixed by the bounds of its columns."""
        states = problem.states
        A = np.array([model.A[states] for model in problem.models])
        B = np.array([model.B[states] for model in problem.models])
        E = np.array([model.E[states] for model in problem.models])
        milp.subject_to(
            "dynamics",
            (1.0, v.x[:, 1:, states, None]),
            (-A[:, None], v.x[:, :-1, None, :]),
            (-B[:, None], v.u[:, :, None, :]),
            lower=E[:, None, :],
            upper=E[:, None, :],
        )

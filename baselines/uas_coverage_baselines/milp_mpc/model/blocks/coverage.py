"""Waypoint coverage (OCP_8, part III of the objective)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.milp import ABSENT, Columns, Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables
from uas_coverage_env.geometry import cylinder_faces


def coverable(problem: PlanningProblem) -> NDArray[np.bool_]:
    """(U, N, W) True where the waypoint's inner polyhedron can be reached at that step."""
    if not problem.n_waypoints:
        return np.zeros((problem.n_uas, problem.horizon, 0), bool)
    faces = problem.waypoint_faces
    nearest = problem.waypoints_m @ faces.T - problem.waypoint_reach_m[:, None]
    reach = problem.reach.support(faces)[:, :-1, None, :]
    result = np.asarray((reach >= nearest).all(axis=-1))
    if problem.waypoint_sides == 4:
        # the inner polyhedron is a box here: its support along the diagonals is known as well
        between = cylinder_faces(16)
        box = np.abs(between).sum(axis=1) * problem.waypoint_reach_m[:, None]
        diagonal = problem.reach.support(between)[:, :-1, None, :]
        result &= (diagonal >= problem.waypoints_m @ between.T - box).all(axis=-1)
    if not problem.prune:
        result[:] = True
    return result & problem.assigned[:, None, :]


def uncovered_as(
    v: Variables, waypoint: int
) -> tuple[NDArray[np.float64], Columns, NDArray[np.float64]]:
    """Phi_w(n) for n = 1..N as constant + coefficient · columns, whether it has columns or not.

    Without, Phi_w(n) is 1 less the visits before n.

    Args:
        v: the shared columns.
        waypoint: w.

    Returns:
        Coefficients and columns (N, K), constants (N, 1).
    """
    if (v.uncovered >= 0).all():
        columns = v.uncovered[1:, waypoint, None]
        return np.ones(columns.shape), columns, np.zeros(columns.shape)
    U, N, _ = v.covers.shape
    before = np.tri(N)  # row n = 1..N, step 0..N-1
    visits = np.broadcast_to(v.covers[None, :, :, waypoint], (N, U, N)).reshape(N, U * N)
    return -np.tile(before, U), visits, np.ones((N, 1))


def require_inside(milp: Milp, v: Variables, problem: PlanningProblem) -> None:
    """|p_w - p(n)| <= delta_WP where b_W(n) = 1: a row per UAS, step, waypoint and face."""
    faces = problem.waypoint_faces
    center = problem.waypoints_m @ faces.T
    upper = center + problem.waypoint_reach_m[:, None]
    reach = problem.reach.support(faces)[:, :-1, None, :]
    big_m = np.maximum(reach - upper, 0.0)
    covers = v.covers[..., None, None]
    milp.subject_to(
        "coverage.inside",
        (faces, v.position[:, :-1, None, None, :]),
        (big_m[..., None], covers),
        upper=upper + big_m,
        where=(v.covers != ABSENT)[..., None] & (big_m > 0.0),
    )


class Coverage:
    """|p_w - p(n)| > delta_WP implies b_W(n) = 0; Phi(n+1) = Phi(n) - sum of b_W(n) (OCP_8).

    Sec. III-C.5, via eq. (const_Vec_ub) with an H_WP-sided sphere approximated from inside, so that
    what the plan counts as covered is covered in the world. b_W is `covers`, Phi is `uncovered`;
    the row sum of b_W <= Phi follows from Phi(n+1) >= 0. Phi takes whole numbers because b_W does.

    | symbol | meaning | attribute |
    | --- | --- | --- |
    | p^w | waypoints considered | `problem.waypoints_m` (W, 3) |
    | delta_WP | radius, times c_in | `problem.waypoint_reach_m` (W,) |
    | b_W(n) | 1: the UAS covers w at step n = 0..N-1 | `v.covers` (U, N, W) |
    | Phi(n) | 1: w is open at sample n | `v.uncovered` (N+1, W) |
    | W_Phi | cost of an open waypoint and step | `problem.waypoint_weight` (W,) |
    | H_WP | sides of the sphere | `problem.waypoint_sides` |
    """

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add the rows and part III of the objective."""
        require_inside(milp, v, problem)
        milp.subject_to(
            "coverage.state",
            (1.0, v.uncovered[1:, :, None]),
            (-1.0, v.uncovered[:-1, :, None]),
            (1.0, np.moveaxis(v.covers, 0, -1)),
            lower=0.0,
            upper=0.0,
        )
        milp.minimize(problem.waypoint_weight, v.uncovered[1:])
        # what is open whatever is flown: left out, so that J is what the plan can influence
        milp.add_constant(-problem.horizon * float(problem.waypoint_weight.sum()))

"""Geofence (OCP_5)."""

from __future__ import annotations

import numpy as np

from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables
from uas_coverage_baselines.milp_mpc.model.tightening import across, kept


class InsideGeofence:
    """D_G(p(n)) <= delta_G: inside the fence by its margin (Sec. III-C.3, eq. (OCP_5), via
    eq. (const_CS_in) with delta_G = -margin).
    """  # noqa: D205

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add one row per face, UAS and step n = 1..N; tighter by the tube, where there is one."""
        fence, tube_m = problem.fence, problem.tubes(problem.horizon)
        upper = -problem.fence_margin_m - fence.offsets_m
        if tube_m is not None:
            spare_m = upper - problem.x0[:, :3] @ fence.normals.T
            margin_m = [kept(tube_m, room)[:, 1:] for room in spare_m.T]
            upper = upper - np.stack(margin_m, axis=2) * across(fence.normals)
        milp.subject_to(
            "geofence",
            (problem.fence.normals, v.position[:, 1:, None, :]),
            upper=upper,
        )

"""Geofence (OCP_5)."""

from __future__ import annotations

from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables


class InsideGeofence:
    """D_G(p(n)) <= delta_G: inside the fence by its margin (Sec. III-C.3, eq. (OCP_5), via
    eq. (const_CS_in) with delta_G = -margin).

    | symbol | meaning | attribute |
    | --- | --- | --- |
    | G | the fence, a convex hull | `problem.fence`: `normals`, `offsets_m` |
    | delta_G | buffer, negative: inside | `-problem.fence_margin_m` |
    | p(n) | positions | `v.position` (U, N+1, 3) |
    """  # noqa: D205

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add one row per face, UAS and step n = 1..N."""
        milp.subject_to(
            "geofence",
            (problem.fence.normals, v.position[:, 1:, None, :]),
            upper=-problem.fence_margin_m - problem.fence.offsets_m,
        )

"""The least height above the ground; not among the paper's families."""

from __future__ import annotations

import numpy as np

from uas_coverage_baselines.milp_mpc.model.height import least_heights_m
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables
from uas_coverage_env.geometry import cylinder_faces

_DOWN = np.array([[0.0, 0.0, 1.0]])


class MinHeight:
    """-z(n) >= h, or p(n) within the landing zone, a polygon inside the circle around home:

    z(n) <= -h + M landing(n),   f_k . (p(n) - p_home) <= r cos(pi / H_P) + M_k (1 - landing(n)).

    A step at which the UAS can be in the zone and low has a binary; others have a bound or nothing.
    """  # noqa: D415

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add rows per UAS and step n = 1..N, none where there is no least height."""
        if not problem.min_height_m:
            return
        faces = cylinder_faces(problem.physical_sides)
        zone_m = problem.landing_zone_m * np.cos(np.pi / len(faces)) + problem.home_m @ faces.T
        beyond_m = problem.reach.support(faces) - zone_m[:, None]
        within_m = problem.reach.support(-faces) + zone_m[:, None]
        least_m = np.array(
            [least_heights_m(problem, uas, problem.horizon) for uas in range(problem.n_uas)]
        )
        deep_m = problem.reach.support(_DOWN)[..., 0] + least_m
        asked = (deep_m > 0.0) & (beyond_m > 0.0).any(axis=2)
        asked[:, 0] = False
        may_land = asked & (within_m >= 0.0).all(axis=2)
        landing = milp.variables(
            "min_height.landing", asked.shape, lower=0.0, upper=1.0, integer=True, where=may_land
        )[..., None]
        milp.subject_to(
            "min_height",
            (1.0, v.position[..., 2:]),
            (-deep_m[..., None], landing),
            upper=-least_m,
            where=asked,
        )
        milp.subject_to(
            "landing_zone",
            (faces, v.position[:, :, None, :]),
            (beyond_m[..., None], landing[:, :, None]),
            upper=zone_m[:, None] + beyond_m,
            where=may_land[..., None] & (beyond_m > 0.0),
        )

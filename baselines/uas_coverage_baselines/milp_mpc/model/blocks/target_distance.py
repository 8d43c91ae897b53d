"""Target distance dynamics (OCP_7, part II of the objective)."""

from __future__ import annotations

import numpy as np

from uas_coverage_baselines.milp_mpc.model.blocks.coverage import uncovered_as
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Trajectories, Variables


class TargetDistance:
    """|p(n) - p_target| <= D_target(n) + c_target(n), D_target penalised (Sec. III-C.6, OCP_7).

    Via eq. (const_Vec_ub) with a closed cylinder. In transit c_target = M (1 - Phi_w(n)): once
    the target waypoint is covered the distance to it costs nothing more.

    | symbol | meaning | attribute |
    | --- | --- | --- |
    | p_target | target of a UAS, None in covering mode | `problem.targets`: `position_m` |
    | W_D, W_target | cost of a metre and step | `problem.targets`: `weight` |
    | w | waypoint whose coverage relaxes the rows | `problem.targets`: `waypoint` |
    | D_target(n) | distance from the target, n = 1..N | columns `target.UAS.distance` |
    | H_P | sides of the closed cylinder | `problem.physical_sides` |
    """

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add the distance of every UAS that has a target."""
        faces = problem.closed_faces(problem.physical_sides)
        reach = problem.reach.support(faces)
        for uas, target in enumerate(problem.targets):
            if target is None:
                continue
            name = f"target.{problem.names[uas]}"
            distance = milp.variables(f"{name}.distance", (problem.horizon,), lower=0.0)
            center = faces @ target.position_m
            terms = [
                (1.0, distance[:, None, None]),
                (-faces, v.position[uas, 1:, None, :]),
            ]
            lower = np.broadcast_to(-center, (problem.horizon, len(faces)))
            if target.waypoint is not None:
                big_m = np.maximum(reach[uas, 1:] - center, 0.0)
                coefficient, columns, constant = uncovered_as(v, target.waypoint)
                terms.append((-big_m[..., None] * coefficient[:, None, :], columns[:, None, :]))
                lower = lower - big_m * (1.0 - constant)
            milp.subject_to(f"{name}.from_target", *terms, lower=lower)
            milp.minimize(target.weight, distance)

    def cost_along(self, problem: PlanningProblem, uas: int, flights: Trajectories) -> np.ndarray:
        """(S,) part II of the objective."""
        target = problem.targets[uas]
        if target is None:
            return np.zeros(len(flights.positions_m))
        faces = problem.closed_faces(problem.physical_sides)
        distance = ((flights.positions_m[:, 1:] - target.position_m) @ faces.T).max(axis=2)
        if target.waypoint is not None:
            steps = np.arange(1, problem.horizon + 1)
            distance = np.where(steps > flights.visits[:, [target.waypoint]], 0.0, distance)
        return target.weight * np.maximum(distance, 0.0).sum(axis=1)

"""The two families of rows that the OCP writes more tightly than the paper, as the paper has them.

They are the oracle of the reductions: whatever a reduced formulation finds, these must find too.
"""

from __future__ import annotations

from itertools import chain

import numpy as np

from uas_coverage_baselines.milp_mpc.model.blocks.coverage import require_inside
from uas_coverage_baselines.milp_mpc.model.blocks.separation import (
    from_each_other,
    from_moving_obstacles,
    from_obstacles,
)
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables


class PaperCoverage:
    """Waypoint coverage word for word (Sec. III-C.5): b_W and Phi whole, sum of b_W <= Phi."""

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add the rows and part III of the objective."""
        require_inside(milp, v, problem)
        milp.require_integrality(v.uncovered)
        by_anyone = np.moveaxis(v.covers, 0, -1)
        before, after = v.uncovered[:-1, :, None], v.uncovered[1:, :, None]
        milp.subject_to("coverage.open", (1.0, by_anyone), (-1.0, before), upper=0.0)
        milp.subject_to(
            "coverage.state", (1.0, after), (-1.0, before), (1.0, by_anyone), lower=0.0, upper=0.0
        )
        milp.minimize(problem.waypoint_weight, v.uncovered[1:])
        # what is open whatever is flown: left out, so that J is what the plan can influence
        milp.add_constant(-problem.horizon * float(problem.waypoint_weight.sum()))


class PaperCornerCutting:
    """Corner cutting word for word (Sec. III-C.4): b(n) + b(n+1) <= 2 c(n), b and c whole.

    Asked of what `CornerCutting` asks it of: what is compared is how the rows are written, not
    what they are about.
    """

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add columns and rows over every interval whose separation is not certain."""
        for separation in chain(
            from_obstacles(problem), from_moving_obstacles(problem), from_each_other(problem)
        ):
            undecided = separation.undecided
            if not separation.corners or not undecided.any():
                continue
            relaxed = milp.columns(f"{separation.name}.relaxed")
            crossed = milp.variables(
                f"{separation.name}.crossed",
                (*undecided.shape, relaxed.shape[2]),
                lower=0.0,
                upper=1.0,
                integer=True,
                where=undecided[:, :, None],
            )
            milp.subject_to(
                f"{separation.name}.corner",
                (1.0, relaxed[:, :-1, :, None]),
                (1.0, relaxed[:, 1:, :, None]),
                (-2.0, crossed[..., None]),
                upper=0.0,
                where=undecided[:, :, None],
            )
            milp.subject_to(
                f"{separation.name}.one_face_stays",
                (1.0, crossed),
                upper=relaxed.shape[2] - 1,
                where=undecided,
            )

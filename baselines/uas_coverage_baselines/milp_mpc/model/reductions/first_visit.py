"""Coverage as a reward for the first visit: the coverage states Phi are eliminated.

From Phi(0) = 1 and Phi(n+1) = Phi(n) - sum_i b_i(n) follows Phi(n) = 1 - sum_{m<n} sum_i b_i(m), so
Phi is no decision. Put in:

- Phi(n) >= 0 for all n says the same as for n = N alone, since Phi does not grow: the one row
  sum_{n, i} b_i(n) + Phi(N) = 1 per waypoint. It also says sum_i b_i(n) <= Phi(n). Phi(N) stays
  as a column, for what looks at the plan's end.
- Phi(n) <= 1 always holds, since b >= 0.
- part III of the objective: sum_{n=1}^{N} W Phi(n) = N W - sum_{m=0}^{N-1} W (N - m) sum_i b_i(m),
  since a visit at m is counted by the N - m states after it.

Feasible points and their objectives correspond one to one, those of the linear relaxation too.
"""

from __future__ import annotations

import numpy as np

from uas_coverage_baselines.milp_mpc.model.blocks.coverage import require_inside
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.ocp import shared_variables
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables


def without_coverage_state(milp: Milp, problem: PlanningProblem) -> Variables:
    """The shared columns without Phi(0) to Phi(N - 1)."""
    return shared_variables(milp, problem, coverage_state=False)


class FirstVisit:
    """At most one visit counts per waypoint; it earns W_Phi for each step that is left."""

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add one row per waypoint and part III of the objective."""
        U, N, W = v.covers.shape
        visits = np.moveaxis(v.covers, -1, 0).reshape(W, U * N)
        milp.subject_to(
            "coverage.first_visit",
            (1.0, visits),
            (1.0, v.uncovered[-1, :, None]),
            lower=1.0,
            upper=1.0,
        )
        left = N - np.arange(N)
        milp.minimize(-problem.waypoint_weight * left[:, None], v.covers)


class VisitBoxes:
    """Where a visit counts: a row per UAS, step, waypoint and face, as in `Coverage`."""

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add the rows."""
        require_inside(milp, v, problem)

"""Valid inequalities: visits in order need the way from one waypoint to the next.

Visits of a tour count in order (`TimeToGo`), and between those of k and k + 1 lie at least d steps,
d a lower bound of the travel time from the UAS's own dynamics and limits (`travel`). So whatever is
visited until n has its predecessor visited until n - d:

    sum of b_{k+1}(m) over m <= n  <=  sum of b_k(m) over m <= n - d.

Every flight whose visits are in order satisfies this; the linear relaxation, which otherwise
visits a little of each waypoint early, does not.
"""

from __future__ import annotations

import numpy as np

from uas_coverage_baselines.milp_mpc.model.milp import ABSENT, Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables
from uas_coverage_baselines.milp_mpc.model.reductions.travel import steps_between


class VisitOrder:
    """Rows that the OCP does not need and its linear relaxation does."""

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add a row per step and pair of waypoints that follow each other on a tour."""
        steps = steps_between(problem) if problem.tours else None
        for uas, tour in enumerate(problem.tours):
            if tour is None or steps is None:
                continue
            for k, (one, other) in enumerate(zip(tour.waypoints, tour.waypoints[1:], strict=False)):
                lag = int(steps[uas, one, other])
                earlier, later = v.covers[uas, :, one], v.covers[uas, :, other]
                if lag == 0:
                    continue
                milp.subject_to(
                    f"time_to_go.{problem.names[uas]}.after_{k}",
                    (np.tri(len(later)), later[None]),
                    (-np.tri(len(later), k=-lag), earlier[None]),
                    upper=0.0,
                    where=later != ABSENT,
                )

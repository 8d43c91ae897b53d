"""Valid inequalities: at most one visit per window of samples and clique of waypoints.

In a window of L consecutive samples one UAS visits at most one of a set of waypoints whose pairwise
travel times (`travel`, lower bounds from its own dynamics and limits) are at least L steps, and
that one at most once (`FirstVisit`):

    sum of b_w(n) over w in the clique and n in the window <= 1.

Every flight with its visits satisfies this, so no feasible point is lost; the linear relaxation,
which otherwise visits a little of everything at once, loses most of its freedom.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from uas_coverage_baselines.milp_mpc.model.milp import ABSENT, Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables
from uas_coverage_baselines.milp_mpc.model.reductions.travel import (
    cliques,
    exclusive,
    steps_between,
)

_LENGTHS = 3  # windows of so many different lengths; longer ones hardly tighten any more


class VisitCliques:
    """Rows that the OCP does not need and its linear relaxation does."""

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add rows for the lengths at which pairs of waypoints drop out."""
        steps = steps_between(problem)
        for uas, name in enumerate(problem.names):
            reached = np.flatnonzero((v.covers[uas] >= 0).any(axis=0))
            own, visits = steps[uas][np.ix_(reached, reached)], v.covers[uas][:, reached]
            pairs = np.minimum(own, own.T)[np.triu_indices(len(reached), k=1)]
            lengths = np.unique(pairs[(pairs >= 2) & (pairs < problem.horizon)])
            for length in lengths[:_LENGTHS]:
                sets = cliques(exclusive(own, length), own)
                window = sliding_window_view(visits, length, axis=0)  # (N-L+1, W, L)
                picked = np.where(sets[:, None, :, None], window, ABSENT)
                several = (picked >= 0).any(axis=-1).sum(axis=-1) > 1
                milp.subject_to(
                    f"coverage.window_{length}.{name}",
                    (1.0, picked.reshape(*picked.shape[:2], -1)),
                    upper=1.0,
                    where=several,
                )

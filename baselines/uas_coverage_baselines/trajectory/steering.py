"""What is flown where no flight goes as it was planned: the order, waypoint by waypoint.

A planned flight is a sequence of wrenches, computed in still air. With another mass or thrust, or
a force of which nothing is stated, each step ends elsewhere; the plan made anew from there meets
the same in the next. The velocity loop of the vehicle does know what pushes it, so the order goes
on under the world's guidance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.fleet import Fleet, Moment
from uas_coverage_env.planning.following import Following, SearchedOrder, Seen
from uas_coverage_env.planning.following.searched_order import SearchedAgain
from uas_coverage_env.planning.routing import Routes, RoutingProblem, SearchEffort

_AGAIN_S = 10.0  # so often the order is searched anew: flights take as long as they take

FAILURES = 4.0
"""So many steps late, or without a plan, and no flight goes as planned."""

_FORGIVEN_PER_STEP = 0.1

_OFF_MPS = 0.6
"""A velocity that is off by so much after a step is no plan's; the nonlinear plant is off by more
in one of some hundred steps."""

_OFF_COUNTS = 0.5  # three times within some steps it is a force, or another vehicle


class Failures:
    """Counts what flights are late, which a plant other than the model may be now and then."""

    def __init__(self) -> None:
        self._steps = 0.0

    def add(self, steps: float) -> None:
        """Steps that a flight is later than planned, or that a UAS was without one."""
        self._steps += steps

    def see(self, off_mps: float) -> None:
        """A velocity that is not the planned one, after a step [m/s]."""
        if off_mps > _OFF_MPS:
            self._steps += _OFF_COUNTS * FAILURES

    def next_step(self) -> None:
        """Forgive a little."""
        self._steps = max(self._steps - _FORGIVEN_PER_STEP, 0.0)

    @property
    def are_many(self) -> bool:
        """Whether no flight goes as planned."""
        return self._steps > FAILURES


def along_order(
    fleet: Fleet, order: Routes, moves: int, total_weight: float, seed: int
) -> Following:
    """Each UAS along its route by the world's guidance.

    Args:
        fleet: The mission.
        order: From which to go on.
        moves: Of each later search.
        total_weight: As in the search of the order.
        seed: Of later searches.
    """

    def problem(seen: Seen, visited: NDArray[np.bool_]) -> RoutingProblem:
        any_time = np.zeros(len(visited), np.int64)
        moment = Moment(seen.swarm.x, seen.works, visited, any_time, seen.swarm.time_s)
        return fleet.problem(moment)

    effort = SearchEffort(moves, hottest_s=1.5, total_weight=total_weight)
    every = max(round(_AGAIN_S / fleet.brief.dt_s), 1)
    again = SearchedAgain(effort, every, seed)
    return Following(fleet.brief, SearchedOrder(problem, order, again))

"""What is flown where no flight goes as it was planned: the order, waypoint by waypoint.

A planned flight is a sequence of wrenches, computed in still air. With another mass or thrust, or
a force of which nothing is stated, each step ends elsewhere; the plan made anew from there meets
the same in the next. The velocity loop of the vehicle does know what pushes it, so the order goes
on under the world's guidance.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.fleet import Fleet, Moment
from uas_coverage_env.mission import MissionBrief, WorldView
from uas_coverage_env.mission.guided_flight import GuidedFlight
from uas_coverage_env.mission.recall import Recall
from uas_coverage_env.planning.routing import Routes, SearchEffort, improve_routes
from uas_coverage_env.world import Command, GoTo, SwarmState

BoolArray = NDArray[np.bool_]

_AGAIN_S = 10.0  # so often the order is searched anew: flights take as long as they take
_WORTH_CHANGING_S = 2.0

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


class Steering:
    """Sends each UAS along its route by the world's guidance.

    Args:
        fleet: The mission.
        brief: The same as the planner knows it.
        order: From which to go on.
        moves: Of each later search.
        total_weight: As in the search of the order.
        seed: Of later searches.
    """

    def __init__(
        self,
        fleet: Fleet,
        brief: MissionBrief,
        order: Routes,
        moves: int,
        total_weight: float,
        seed: int,
    ) -> None:
        self._fleet, self._order, self._seed = fleet, order, seed
        self._effort = SearchEffort(moves, hottest_s=1.5, total_weight=total_weight)
        self._again = max(round(_AGAIN_S / brief.dt_s), 1)
        self._guided = GuidedFlight(brief)
        self._recall, self._called = Recall(len(brief.uas)), np.zeros(len(brief.uas), np.bool_)
        self._worked = np.zeros(len(brief.uas), np.bool_)

    def commands(self, swarm: SwarmState, world: WorldView) -> Mapping[str, Command]:
        """A command for each UAS that flies.

        Args:
            swarm: What is seen, of UAS that take commands.
            world: The same, updated.
        """
        blocked = world.blocked()
        wanted = self._guided.wanted(swarm.uncovered)
        free = wanted & ~blocked
        target = free if free.any() else wanted
        if swarm.uncovered.any():
            self._called = self._recall.update(swarm, world)
        works = np.isin(swarm.names, swarm.active) & ~swarm.returning & ~self._called
        self._search(swarm, works, target)
        flown_to = {
            swarm.names[u]: int(route[0])
            for u, route in enumerate(self._order.routes)
            if works[u] and len(route)
        }
        home: dict[str, Command] = {name: GoTo(None) for name in swarm.active}
        return home | self._guided.commands(swarm, flown_to, blocked)

    def _search(self, swarm: SwarmState, works: BoolArray, wanted: BoolArray) -> None:
        moment = Moment(swarm.x, works, wanted, np.zeros(len(wanted), np.int64), swarm.time_s)
        problem = self._fleet.problem(moment)
        kept = improve_routes(problem, self._order, SearchEffort(0), 0)
        if swarm.step % self._again == 0 or not np.array_equal(works, self._worked):
            better = improve_routes(problem, kept, self._effort, self._seed + swarm.step)
            if better.cost_s < kept.cost_s - _WORTH_CHANGING_S:
                kept = better
        self._order, self._worked = kept, works

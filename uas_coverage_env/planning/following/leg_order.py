"""The order that planners of whole missions give an autopilot, which stops at corners."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.planning.around.repeats import open_now
from uas_coverage_env.planning.decision import Decision
from uas_coverage_env.planning.following.following import Seen, first_of
from uas_coverage_env.planning.following.searched_order import (
    SearchedAgain,
    SearchedOrder,
)
from uas_coverage_env.planning.reserves import BY_LEGS
from uas_coverage_env.planning.routing import (
    RoutingProblem,
    SearchEffort,
    empty_routes,
    search_orders,
)
from uas_coverage_env.planning.routing.terrain import Terrain
from uas_coverage_env.world import Command, GoTo, SwarmState

BoolArray = NDArray[np.bool_]


class LegOrder:
    """Routes of the fleet with a cost for corners; `planning.around` flies along them by legs.

    Args:
        brief: A mission that an autopilot flies.
        searches: For an order before take-off.
        effort: Of each.
        seed: Of the searches.

    Attributes:
        decision: None: there is nothing to tell but who flies, which is known.
    """

    def __init__(self, brief: MissionBrief, searches: int, effort: SearchEffort, seed: int) -> None:
        self._brief, self._terrain = brief, Terrain(brief)
        begin = self._seen(first_sight(brief))
        problem = self._problem(begin, begin.wanted)
        tried = [(effort, seed + attempt) for attempt in range(searches)]
        order = search_orders(problem, empty_routes(problem.n_uas), tried)[0]
        again = SearchedAgain(effort, every_steps=0, seed=seed)
        self._order = SearchedOrder(self._problem, order, again)
        self.decision: Decision | None = None

    @property
    def routes(self) -> tuple[NDArray[np.int64], ...]:
        """(U,) what each UAS still has to visit."""
        return self._order.order.routes

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are left out, and why in a few words."""
        left_out = self._order.order.left_out.tolist()
        return dict.fromkeys(left_out, "its order leaves it out")

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """To the next waypoint of each active UAS, or home.

        Args:
            swarm: What is seen.
        """
        targets = first_of(self._order.routes(self._seen(swarm)), swarm)
        return {name: GoTo(targets.get(name)) for name in swarm.active}

    def _seen(self, swarm: SwarmState) -> Seen:
        """No waypoint is left for later because a UAS waits for another, nor what moves seen."""
        works = (swarm.status == FLYING) & ~swarm.returning
        wanted = open_now(swarm).uncovered
        return Seen(swarm, works, wanted, np.zeros_like(wanted))

    def _problem(self, seen: Seen, visited: BoolArray) -> RoutingProblem:
        swarm = replace(seen.swarm, uncovered=visited)
        return RoutingProblem.seen(self._brief, swarm, self._terrain, seen.works, BY_LEGS)

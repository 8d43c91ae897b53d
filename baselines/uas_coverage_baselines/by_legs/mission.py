"""A whole mission by legs: an order with a cost for corners, searched again where UAS drop out."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.by_legs.follower import LegFollower
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.mission.handover import Handover
from uas_coverage_env.planning.reserves import BY_LEGS
from uas_coverage_env.planning.routing import (
    RoutingProblem,
    SearchEffort,
    empty_routes,
    improve_routes,
    search_orders,
)
from uas_coverage_env.world import Command, SwarmState

BoolArray = NDArray[np.bool_]


class LegMission:
    """Routes of the fleet, flown by a `LegFollower`.

    Args:
        brief: A mission that an autopilot flies.
        searches: For an order before take-off.
        effort: Of each.
        seed: Of the searches.
    """

    def __init__(self, brief: MissionBrief, searches: int, effort: SearchEffort, seed: int) -> None:
        self._brief, self._effort, self._seed = brief, effort, seed
        self._follower, self._handover = LegFollower(brief), Handover(brief)
        swarm = first_sight(brief)
        works = np.ones(len(brief.uas), np.bool_)
        tried = [(effort, seed + attempt) for attempt in range(searches)]
        problem = self._problem(swarm, works)
        self._order = search_orders(problem, empty_routes(problem.n_uas), tried)[0]
        self._worked = works
        self._follower.begin([route.tolist() for route in self._order.routes])

    def commands(self, swarm: SwarmState) -> Mapping[str, Command]:
        """A command for each active UAS.

        Args:
            swarm: What is seen.
        """
        works = self._handover.workers(swarm) & ~swarm.returning & ~self._follower.returns
        routed = np.zeros(len(swarm.uncovered), np.bool_)
        routed[self._order.left_out] = True
        for u, route in enumerate(self._order.routes):
            routed[route] |= works[u]
        new = swarm.uncovered & ~routed & self._brief.can_cover[works].any(axis=0)
        lost = self._worked & ~works
        if new.any() or (lost.any() and swarm.uncovered[~routed].any()):
            self._order = improve_routes(
                self._problem(swarm, works), self._order, self._effort, self._seed + swarm.step
            )
        self._worked = works
        routes = [
            route[swarm.uncovered[route]].tolist() if works[u] else []
            for u, route in enumerate(self._order.routes)
        ]
        return self._follower.commands(swarm, routes)

    def _problem(self, swarm: SwarmState, works: BoolArray) -> RoutingProblem:
        terrain = self._follower.planner.terrain
        return RoutingProblem.seen(self._brief, swarm, terrain, works, BY_LEGS)

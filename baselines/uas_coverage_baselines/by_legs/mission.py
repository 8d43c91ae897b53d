"""A whole mission by legs: an order with a cost for corners, searched again where UAS drop out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.by_legs.follower import LegFollower
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.mission.handover import Handover
from uas_coverage_env.planning.reserves import BY_LEGS, BY_LEGS_RESERVE
from uas_coverage_env.planning.routing import (
    RoutingTask,
    SearchEffort,
    empty_routes,
    improve_routes,
)
from uas_coverage_env.vehicle.layout import DOD
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
        self._weight = np.array([w.weight for w in brief.waypoints], float)
        swarm = first_sight(brief)
        works = np.ones(len(brief.uas), np.bool_)
        task = self._task(swarm, works)
        orders = [
            improve_routes(task, empty_routes(task.n_uas), effort, seed + attempt)
            for attempt in range(searches)
        ]
        self._order = min(orders, key=lambda order: order.cost_s)
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
                self._task(swarm, works), self._order, self._effort, self._seed + swarm.step
            )
        self._worked = works
        routes = [
            route[swarm.uncovered[route]].tolist() if works[u] else []
            for u, route in enumerate(self._order.routes)
        ]
        return self._follower.commands(swarm, routes)

    def _task(self, swarm: SwarmState, works: BoolArray) -> RoutingTask:
        brief, terrain, x = self._brief, self._follower.planner.terrain, swarm.x
        uas = terrain.arena.uas
        share = 1.0 if brief.conditions is None else brief.conditions.charge_share
        left_s = share * (uas["dod_max"] - x[:, DOD]) / uas["dod_per_s"]
        left_s = (
            np.minimum(left_s, brief.max_steps * brief.dt_s - swarm.time_s) - BY_LEGS_RESERVE.kept_s
        )
        open_ = swarm.uncovered.copy()
        if works.any():
            open_ &= brief.can_cover[works].any(axis=0)
        task = RoutingTask.of(
            terrain,
            x,
            works,
            open_waypoints=open_,
            weight=self._weight,
            budget_s=left_s,
            landing_s=BY_LEGS.landing_s,
        )
        return replace(task, turn_of_cosine=terrain.legs.turn_of_cosine)  # it stops at corners

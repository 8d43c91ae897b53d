"""Plans made in flight: anew where the present one no longer holds, or better ones."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.fleet import Fleet, Moment
from uas_coverage_baselines.trajectory.improving import Ahead, Improvement, all_but_own
from uas_coverage_baselines.trajectory.mission_plan import (
    Effort,
    MissionPlan,
    Planned,
    order_effort,
    plan_mission,
)
from uas_coverage_baselines.trajectory.moving_obstacles import NEVER, MovingObstacles
from uas_coverage_baselines.trajectory.options import TrajectoryOptions
from uas_coverage_baselines.trajectory.plan_in_force import PlanInForce
from uas_coverage_baselines.trajectory.under_way import UnderWay
from uas_coverage_baselines.trajectory.waiting import choose_waiting, opens_again, opens_first
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.mission import Range
from uas_coverage_env.planning.around.repeats import steps_until_open
from uas_coverage_env.world import SwarmState

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]


class Replanning:
    """Makes the plans of a mission.

    Args:
        fleet: The mission.
        way_home: Of its UAS.
        options: Of the planner.
        seed: Of the searches.

    Attributes:
        total_weight: Worth of a second of each UAS's flight.
        is_handed_over: Whether what is blocked is left to UAS that can wait for it.
    """

    def __init__(
        self, fleet: Fleet, way_home: Range, options: TrajectoryOptions, seed: int
    ) -> None:
        self._fleet, self._way_home, self._options, self._seed = fleet, way_home, options, seed
        self.total_weight = order_effort(options, len(fleet.brief.uas)).total_weight
        effort = Effort(1, 1, options.moves, options.programs, self.total_weight)
        self._improvement = Improvement(fleet, effort, options.idle_work, seed)
        self.is_handed_over = False

    def made(
        self,
        swarm: SwarmState,
        moving: MovingObstacles,
        before: PlanInForce | UnderWay,
        unresponsive: BoolArray,
        back: BoolArray,
    ) -> PlanInForce:
        """A plan from here.

        Args:
            swarm: What is seen, of UAS that take commands.
            moving: What moves.
            before: What is flown; of a mission whose scene has become another, what was.
            unresponsive: (U,) UAS that fly without commands.
            back: (U,) UAS that fly again, with fresh packs.
        """
        fleet, step = self._fleet, swarm.step
        in_force = before if isinstance(before, PlanInForce) else None
        kept = before.order if isinstance(before, UnderWay) else None
        first = in_force is None and kept is None
        flying, opens = swarm.status == FLYING, fleet.opens(moving)
        # a flight that had to wait for something may be shorter now
        waits = opens > 0 if in_force is None else (opens > 0) | in_force.blocked
        left = {u: p.rest(step, swarm.uncovered) for u, p in before.planned.items()}
        flown = {u: rest for u, rest in left.items() if not waits[rest[0]].any()}
        moment = Moment(swarm.x, flying, swarm.uncovered, self._earliest(swarm, opens, 0),
                        swarm.time_s)  # fmt: skip
        unknown = (opens >= NEVER) & swarm.uncovered
        effort = Effort.of(self._options, moment, self.total_weight, fleet.brief.dt_s, first=first)
        latest_visit = np.full(len(unknown), NEVER)
        waiting = choose_waiting(fleet, self._way_home, moment, unknown)
        if unknown.any():
            latest = waiting.latest
            latest_visit[unknown] = step + latest[unknown]
            visit = np.minimum(latest, self._opens_at(moment, unknown, effort, in_force, step))
            moment.earliest[unknown] = visit[unknown]
            moment = replace(moment, uncovered=moment.uncovered & ~(unknown & (latest < 0)))
        if in_force is not None:
            # changes of an order in which one that is back has no part rarely give it one
            is_back = (flying & in_force.unresponsive).any() or back.any()
            if in_force.plan.order.trips or not is_back:
                kept = in_force.plan.order
        bodies = {u: fleet.bodies(moving, u) for u in range(len(swarm.x))}
        fresh = fleet.fresh_packs(swarm, moment.uncovered, flown)

        def found(forbidden: BoolArray | None) -> MissionPlan:
            now = replace(moment, forbidden=forbidden)
            return plan_mission(
                fleet, now, step, bodies, effort, self._seed + step, kept, flown, fresh
            )

        # before take-off it costs little to have what is blocked visited by one that can wait
        forbidden = waiting.forbidden if unknown.any() and (first or self.is_handed_over) else None
        plan = found(forbidden)
        if forbidden is None and waiting.is_left_to_others(plan.planned, step, swarm.uncovered):
            self.is_handed_over = True
            plan = found(waiting.forbidden)
        may_fly = flying.copy()
        if first:
            may_fly = np.isin(np.arange(len(flying)), [*plan.planned, *plan.troubles])
        ends = {u: p.course.end for u, p in plan.planned.items()}
        return PlanInForce(
            plan, dict(plan.planned), ends, step, frozenset(plan.planned), may_fly, unresponsive,
            moving, opens > 0, latest_visit, waiting,
        )  # fmt: skip

    def improve(
        self,
        in_force: PlanInForce,
        swarm: SwarmState,
        moving: MovingObstacles,
        followed: Collection[int],
    ) -> None:
        """Look for a better plan, and let it take over, where it is known where the UAS will be.

        Args:
            in_force: What is flown.
            swarm: What is seen.
            moving: What moves.
            followed: UAS that are where they were planned to be.
        """
        flying = set(np.flatnonzero(swarm.status == FLYING).tolist())
        if in_force.plan.troubles or not flying <= in_force.planned.keys() & set(followed):
            return

        def ahead(then: int, planned: Mapping[int, Planned]) -> Ahead:
            return self._ahead(then, planned, in_force, swarm, moving)

        better = self._improvement.better(swarm, in_force.plan, in_force.planned, ahead)
        if better is not None:
            in_force.take(better)

    def _ahead(
        self,
        then: int,
        planned: Mapping[int, Planned],
        in_force: PlanInForce,
        swarm: SwarmState,
        moving: MovingObstacles,
    ) -> Ahead:
        """What to expect at a step, of flights that go on until then."""
        fleet, expected = self._fleet, moving.later(then - swarm.step)
        opens = fleet.opens(expected)
        unknown = (opens >= NEVER) & swarm.uncovered
        opens[unknown] = 0
        earliest = self._earliest(swarm, opens, then - swarm.step)
        for p in planned.values():  # what is blocked is visited as late as planned
            visits = p.flight.visits + p.course.begin - then
            late = unknown[p.route]
            earliest[p.route[late]] = np.maximum(visits[late], 0)
        bodies = {u: fleet.bodies(expected, u) for u in range(len(swarm.x))}
        forbidden = in_force.waiting.forbidden if unknown.any() else None
        if in_force.plan.order.trips:  # which UAS visits what is part of a larger plan
            others = all_but_own(planned, (len(swarm.x), len(swarm.uncovered)))
            forbidden = others if forbidden is None else forbidden | others
        return Ahead(earliest, forbidden, bodies)

    def _earliest(self, swarm: SwarmState, opens: IntArray, later: int) -> IntArray:
        """(W,) steps, from a sample so much later, before which waypoints are not to be visited."""
        return np.maximum(opens, steps_until_open(swarm, self._fleet.brief.dt_s) - later).clip(0)

    def _opens_at(
        self,
        moment: Moment,
        unknown: BoolArray,
        effort: Effort,
        in_force: PlanInForce | None,
        step: int,
    ) -> int:
        """Steps after which visits to what is blocked (W,) for an unknown time are planned."""
        if in_force is None:
            return opens_first(self._fleet, moment, unknown, effort.moves, self._seed)
        left = [len(p.course.rest(step).u) for p in in_force.planned.values()]
        return opens_again(left, self._fleet.brief.dt_s)

"""Who covers what: the order of the swarm, searched before take-off and again on events."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.order import Effort, Legs, Order, Task, improved, no_order
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import DOD
from uas_coverage_env.world import Arena

FloatArray = NDArray[np.float64]

LANDING_S = 3.0  # from full speed over the start to rest on it
_RESERVE_S = 30.0  # what return mode asks for beyond the way home at full speed
_LATE_S = 6.0  # this far off the schedule, another search is worth its time
_SLOWER = 1.15  # flights take so much longer than their legs, when batteries are counted on
_OPENS_AFTER = 0.75  # share of the mean flight left after which what is blocked may be open
_OPENS_AFTER_S = 10.0  # and at least so long
_FIRST_SEARCHES = 3
_MOVES_AGAIN = 600_000  # of each of two searches on an event, one of them hot
_WORTH_CHANGING_S = 1.0


@dataclass(frozen=True)
class View:
    """What the schedule needs of a moment.

    Attributes:
        x: (U, 14) states, in the scenario's order.
        may_work: (U,) flies, and is not on its last way home.
        flies: (U,).
        uncovered: (W,).
        blocked: (W,) inside the keep-out of something that moves, now.
        time_s: since the start.
    """

    x: FloatArray
    may_work: NDArray[np.bool_]
    flies: NDArray[np.bool_]
    uncovered: NDArray[np.bool_]
    blocked: NDArray[np.bool_]
    time_s: float


class Schedule:
    """The order of the swarm, kept up to date."""

    def __init__(self, scenario: Scenario, arena: Arena, moves: int) -> None:
        self.legs = Legs(scenario)
        self._arena = arena
        self._moves = moves
        self._weight = np.array([w.weight for w in scenario.waypoints], float)
        self.order = no_order(len(scenario.uas))

    def begin(self, view: View, seed: int) -> None:
        """Search long, before take-off."""
        if (view.blocked & view.uncovered).any():  # how late is late, is known with an order
            self.take(improved(self.task(view), self.order, Effort(self._moves), seed), view)
        task = self.task(view)
        orders = [
            improved(task, no_order(task.n_uas), Effort(self._moves), seed + attempt)
            for attempt in range(_FIRST_SEARCHES)
        ]
        self.take(min(orders, key=lambda order: order.cost_s), view)

    def update(self, view: View) -> None:
        """Drop what is covered, and search again where something has happened."""
        open_ = view.uncovered
        routes = tuple(route[open_[route]] for route in self.order.routes)
        left_out = self.order.left_out[open_[self.order.left_out]]
        self.order = Order(routes, left_out, self.order.seconds, self.order.cost_s)
        if self._has_changed(view):
            task = self.task(view)
            kept = improved(task, self.order, Effort(0), 0)
            efforts = (Effort(_MOVES_AGAIN, hottest_s=1.5), Effort(_MOVES_AGAIN))
            found = [improved(task, kept, effort, round(view.time_s)) for effort in efforts]
            better = min(found, key=lambda order: order.cost_s)
            worthwhile = better.cost_s < kept.cost_s - _WORTH_CHANGING_S
            self.take(better if worthwhile else kept, view)

    def take(self, order: Order, view: View) -> None:
        """Fly an order from now on."""
        self.order = order
        self._taken_under = view
        self._expected_s = self._expected_home_s(view)

    def _has_changed(self, view: View) -> bool:
        """Whether somebody came home or was lost, something opened or closed, or time is off."""
        before = self._taken_under
        late_s = (self._expected_home_s(view) - self._expected_s)[view.may_work]
        return (
            not np.array_equal(view.may_work, before.may_work)
            or not np.array_equal(view.blocked & view.uncovered, before.blocked & view.uncovered)
            or bool((np.abs(late_s) > _LATE_S).any())
        )

    def _expected_home_s(self, view: View) -> FloatArray:
        """(U,) when each UAS will have flown its route, turns not counted."""
        left_s = [self._seconds_left(u, x[:3]) for u, x in enumerate(view.x)]
        return view.time_s + np.array(left_s)

    def rest_s(self, uas: int, slower: float, per_waypoint_s: float) -> FloatArray:
        """Flight time from each waypoint of a UAS's route to its end.

        Args:
            uas: Index of the UAS.
            slower: Factor on the legs' times.
            per_waypoint_s: Added for each waypoint that is still to be covered.

        Returns:
            (K+1,): with k waypoints covered, from the next one on; the last is 0.
        """
        route = self.order.routes[uas]
        if not len(route):
            return np.zeros(1)
        between = self.legs.between_s[self.legs.kind[uas]]
        legs = np.append(between[route[:-1], route[1:]], self.legs.home_s[uas, route[-1]])
        return np.append(np.cumsum((slower * legs + per_waypoint_s)[::-1])[::-1], 0.0)

    def _seconds_left(self, uas: int, position_m: FloatArray) -> float:
        """Flight time along the route of a UAS and home, turns not counted."""
        route = self.order.routes[uas]
        if not len(route):
            return self.legs.way_home_s(uas, position_m)
        first_m = self.legs.waypoints_m[route[0]] - position_m
        return float(
            np.linalg.norm(first_m[:2]) / self.legs.speed_mps[uas] + self.rest_s(uas, 1.0, 0.0)[0]
        )

    def task(self, view: View) -> Task:
        """The routing problem of a moment."""
        legs, x = self.legs, view.x
        n_uas = len(x)
        first_s = np.array([legs.from_here_s(u, x[u, :3]) for u in range(n_uas)])
        idle_s = np.array([legs.way_home_s(u, x[u, :3]) for u in range(n_uas)])
        uas = self._arena.uas
        budget_s = (uas["dod_max"] - x[:, DOD]) / uas["dod_per_s"] / _SLOWER - _RESERVE_S
        # nobody knows when a blocked waypoint opens: late enough to do other work before, and soon
        # enough to be thought of while there is other work near it
        work_s = (self._expected_home_s(view) - view.time_s)[view.may_work]
        opens_s = max(_OPENS_AFTER * float(work_s.mean()), _OPENS_AFTER_S) if len(work_s) else 0.0
        return Task(
            open_waypoints=np.flatnonzero(view.uncovered),
            first_s=first_s,
            between_s=legs.between_s,
            kind=legs.kind,
            home_s=legs.home_s + LANDING_S,
            idle_s=np.where(view.may_work, idle_s, 0.0),
            position_m=np.ascontiguousarray(x[:, 0:2]),
            velocity_mps=np.ascontiguousarray(x[:, 3:5]),
            speed_mps=self.legs.speed_mps,
            acceleration_mps2=self.legs.acceleration_mps2,
            start_m=np.ascontiguousarray(legs.starts_m[:, :2]),
            waypoints_m=legs.waypoints_m,
            turn_s=self.legs.turn_s,
            neighbours=legs.neighbours,
            weight=self._weight,
            not_before_s=np.where(view.blocked, opens_s, 0.0),
            budget_s=np.where(view.may_work, budget_s, -np.inf),
        )

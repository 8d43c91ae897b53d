"""A plan of the whole mission: an order, and a verified course for each UAS."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.closed_off import closed_off
from uas_coverage_baselines.trajectory.course import (
    Course,
    are_apart,
    course_of,
    trouble_alone,
)
from uas_coverage_baselines.trajectory.fleet import Fleet, Moment
from uas_coverage_baselines.trajectory.options import TrajectoryOptions
from uas_coverage_baselines.trajectory.program import PlannedFlight
from uas_coverage_baselines.trajectory.retiming import Draft
from uas_coverage_baselines.trajectory.space import Body
from uas_coverage_baselines.trajectory.work import Work, done
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.planning.routing import (
    Routes,
    RoutingProblem,
    SearchEffort,
    empty_routes,
    search_orders,
)
from uas_coverage_env.planning.routing.trips import FreshPacks, improve_trips
from uas_coverage_env.world import SwarmState

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SMALL_FLEET = 4
"""So many UAS, or fewer; of larger fleets, less is searched for each."""

_ONE_SEARCH = 8  # from more UAS on, one order is searched before take-off
_SMALL, _LARGER = 250, 6  # UAS times waypoints; beyond, more changes are tried, so much at most
_UNFLOWN_S = 1000.0
_LEAST_PROGRAMS = 20  # for each of a large fleet, who share those of a small one
_FULL_S = 1.0  # at shorter samples a decision searches less, in proportion, and takes what is there
_FIRST_STEPS = 10_000  # there, work on a flight that violates nothing, in steps
HOPELESS = 1.02  # times the cheapest order: flights differ from what orders expect by 1.4 %
_FINISHED = 0.95  # of a draft's steps: no flight of 60 missions was made shorter than 0.952
_BATTERY = "the battery does not last"
NO_FLIGHT = "no flight"
_PLANS_AT_MOST = 4  # others may be sent to what is left, and be stuck there, too
_BUDGETS = 3
_SHORTER = 0.04  # of the battery, taken off a budget that did not last


@dataclass(frozen=True)
class Effort:
    """How much to search; nothing of it is a time.

    Attributes:
        orders: Searches for an order.
        planned: So many orders get flights, the cheapest first.
        moves: Of each search.
        programs: Solved for each flight, about.
        total_weight: Worth of a second of each UAS's flight against one of the mission.
        threads: Searches made, and UAS planned for, side by side.
        first_steps: Work on each first flight at most, in steps of flights looked for.
        bends: Whether known flights in the way of what moves are bent or delayed, not planned anew,
            and another order is flown only where it costs clearly less.
    """

    orders: int
    planned: int
    moves: int
    programs: int
    total_weight: float
    threads: int = 1
    first_steps: float = np.inf
    bends: bool = False

    @classmethod
    def of(
        cls,
        options: TrajectoryOptions,
        moment: Moment,
        total_weight: float,
        dt_s: float,
        *,
        first: bool,
    ) -> Effort:
        """The effort of a plan.

        Args:
            options: Of the planner.
            moment: From where.
            total_weight: See the attribute.
            dt_s: Length of a step.
            first: Whether it is made before take-off; later, the order that is flown is there, too.
        """
        n_uas = len(moment.x)
        orders, planned = 1, 2
        if first:
            orders = options.orders if n_uas <= _ONE_SEARCH else 1
            planned = options.planned_orders
        larger = min(max(n_uas * len(moment.uncovered) / _SMALL, 1.0), _LARGER)
        moves = round(larger * options.moves)
        if dt_s >= _FULL_S:
            return cls(orders, planned, moves, options.programs, total_weight, options.threads)
        share = dt_s / _FULL_S
        programs = max(round(share * options.programs), min(options.programs, _LEAST_PROGRAMS))
        return cls(
            orders, planned, round(share * moves), programs, total_weight, options.threads,
            first_steps=_FIRST_STEPS, bends=not first,
        )  # fmt: skip


@dataclass(frozen=True)
class Planned:
    """What one UAS is to do.

    Attributes:
        route: (K,) waypoints.
        flight: Along them; its visits count from the course's first sample.
        course: The same as the world flies it.
    """

    route: IntArray
    flight: PlannedFlight
    course: Course

    def open_visits(self, step: int, uncovered: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(K,) which visits are still to come and needed."""
        return uncovered[self.route] & (self.flight.visits + self.course.begin > step)

    def rest(self, step: int, uncovered: NDArray[np.bool_]) -> tuple[IntArray, PlannedFlight]:
        """The route that is left at a sample, in order of time, and the flight along it."""
        left = np.flatnonzero(self.open_visits(step, uncovered))
        left = left[np.argsort(self.flight.visits[left], kind="stable")]
        return self.route[left], self.flight.after(step - self.course.begin, left)


@dataclass(frozen=True)
class MissionPlan:
    """The plans of the UAS that have one.

    Attributes:
        planned: By index of the UAS.
        order: Of the search.
        cost_s: What is minimised.
        troubles: Why a UAS has no plan, by its index.
    """

    planned: Mapping[int, Planned]
    order: Routes
    cost_s: float
    troubles: Mapping[int, str]

    def given_up(self, fleet: Fleet) -> dict[int, str]:
        """Waypoints that are left out, and why in a few words."""
        closed = np.flatnonzero(fleet.closed_off.any(axis=0)).tolist()
        left_out = dict.fromkeys(self.order.left_out.tolist(), "its order leaves it out")
        return left_out | dict.fromkeys(closed, "no flight was found that visits it")

    def thought_of(self, swarm: SwarmState, planned: Mapping[int, Planned]) -> NDArray[np.bool_]:
        """(W,) waypoints that are visited, now or with a later pack, or were left out.

        Args:
            swarm: As it is now.
            planned: What is flown of the plan.
        """
        known = np.zeros(len(swarm.uncovered), np.bool_)
        known[self.order.left_out] = True
        for u, trips in enumerate(self.order.trips):
            if swarm.packs_left[u]:
                known[np.concatenate([*trips, np.zeros(0, np.int64)])] = True
        for each in planned.values():
            known[each.route[each.open_visits(swarm.step, swarm.uncovered)]] = True
        return known


def is_idle(swarm: SwarmState, planned: Mapping[int, Planned]) -> bool:
    """Whether a UAS flies home, with no visit left in its plan."""
    flying = [p for u, p in planned.items() if swarm.status[u] == FLYING]
    return any((p.flight.visits + p.course.begin <= swarm.step).all() for p in flying)


def order_effort(options: TrajectoryOptions, n_uas: int) -> SearchEffort:
    """Of the search of an order: in a large fleet energy counts less, or most stay home."""
    share = min(1.0, SMALL_FLEET / n_uas)
    return SearchEffort(options.moves, total_weight=options.weight_energy * share)


def plan_mission(
    fleet: Fleet,
    moment: Moment,
    step: int,
    moving: Mapping[int, Sequence[Body]],
    effort: Effort,
    seed: int,
    kept: Routes | None = None,
    flown: Mapping[int, tuple[IntArray, PlannedFlight]] | None = None,
    fresh: FreshPacks | None = None,
) -> MissionPlan:
    """The best plan found, without waypoints that are closed off; arguments as of `_best_plan`.

    Those that keep a UAS from flying its route are noted in the fleet, and left to others.
    """
    for _ in range(_PLANS_AT_MOST):
        plan = _best_plan(fleet, moment, step, moving, effort, seed, kept, flown, fresh)
        stuck = [u for u, why in plan.troubles.items() if why == NO_FLIGHT]
        found = False
        for u in stuck:
            waypoints = closed_off(fleet, u, moment.x[u], plan.order.routes[u])
            fleet.closed_off[u, waypoints] = True
            found |= bool(len(waypoints))
        if not found:
            break
    return plan


def _best_plan(
    fleet: Fleet,
    moment: Moment,
    step: int,
    moving: Mapping[int, Sequence[Body]],
    effort: Effort,
    seed: int,
    kept: Routes | None,
    flown: Mapping[int, tuple[IntArray, PlannedFlight]] | None,
    fresh: FreshPacks | None,
) -> MissionPlan:
    """The best plan found; the same arguments give the same plan.

    Args:
        fleet: The mission.
        moment: From where.
        step: Number of the sample.
        moving: What moves, as each UAS sees it.
        effort: How much to search.
        seed: Of the order search.
        kept: An order to begin from; none before take-off.
        flown: Routes and flights from here that are as good as planned already.
        fresh: Packs for later flights, of which nothing is planned yet but what they will visit.
    """
    late_s = np.zeros(len(moment.x))
    best: MissionPlan | None = None
    flights = {(u, route.tobytes()): flight for u, (route, flight) in (flown or {}).items()}
    for _ in range(_BUDGETS):
        problem = fleet.problem(moment, late_s)
        known: set[tuple[bytes, ...]] = set()
        orders = _orders(problem, effort, seed, kept, fresh)[: effort.planned]
        if orders[0].trips:  # flights of now alone do not tell which order is cheaper
            orders = orders[:1]
        for order in orders:
            if effort.bends and best is not None and not best.troubles:
                break
            if problem.n_uas > SMALL_FLEET and order.cost_s > HOPELESS * orders[0].cost_s:
                break
            key = tuple(route.tobytes() for route in order.routes)
            if key not in known:
                known.add(key)
                plan = _flown(fleet, moment, step, moving, effort, order, flights, best)
                if plan is not None and (best is None or plan.cost_s < best.cost_s):
                    best = plan
        assert best is not None
        too_long = [u for u, why in best.troubles.items() if why == _BATTERY]
        if not too_long:
            return best
        if fresh is not None and best.order.trips:
            fresh = fresh.shorter(_SHORTER, too_long)  # for later flights as for those of now
            continue
        battery_s = fleet.battery_s(moment.x)
        if problem.n_uas <= SMALL_FLEET:
            late_s[too_long] += _SHORTER * battery_s[too_long]
            continue
        # the UAS that take over their waypoints will be as late
        routes, dt_s = best.order.routes, fleet.brief.dt_s
        flown_s = [dt_s * flights[u, routes[u].tobytes()].steps for u in too_long]
        late = np.max(flown_s / best.order.seconds[too_long]) - 1.0
        late_s += max(_SHORTER, float(late)) * battery_s
    assert best is not None
    return best


def _orders(
    problem: RoutingProblem,
    effort: Effort,
    seed: int,
    kept: Routes | None,
    fresh: FreshPacks | None,
) -> list[Routes]:
    nothing = SearchEffort(0)
    if kept is not None and kept.trips:  # the cheapest of these is flown, with no other look at it
        nothing = SearchEffort(0, total_weight=effort.total_weight)
    found = [] if kept is None else [improve_trips(problem, kept, nothing, 0, fresh)]

    def search(k: int) -> SearchEffort:
        return SearchEffort(
            effort.moves,
            hottest_s=4.0 if kept is None or k else 1.5,
            total_weight=effort.total_weight,
            by_pieces=problem.n_uas > SMALL_FLEET,
        )

    begin = empty_routes(problem.n_uas) if kept is None else kept
    searches = [(search(k), seed + k) for k in range(effort.orders)]
    found += search_orders(problem, begin, searches, fresh, effort.threads)
    cheapest_first = sorted(found, key=lambda order: order.cost_s)
    if effort.bends and kept is not None and found[0].cost_s < HOPELESS * cheapest_first[0].cost_s:
        return found  # flights along what is flown are known
    return cheapest_first


def _flown(
    fleet: Fleet,
    moment: Moment,
    step: int,
    moving: Mapping[int, Sequence[Body]],
    effort: Effort,
    order: Routes,
    known: dict[tuple[int, bytes], PlannedFlight],
    best: MissionPlan | None,
) -> MissionPlan | None:
    """An order with its flights and courses, as far as they are verified.

    Flights found are added to `known`. None is returned where drafts show that `best` is cheaper.
    """
    routes = _routes(moment, order, step)
    programs = _programs(effort, len(routes))
    drafts = fleet.drafts(
        moment, routes, moving, programs, known, effort.threads,
        first_steps=effort.first_steps, bends=effort.bends,
    )  # fmt: skip
    if best is not None and _least_s(fleet, effort, order, drafts) >= best.cost_s:
        return None
    alone = fleet.flights(moment, routes, moving, drafts, effort.threads)
    known.update({(u, routes[u].tobytes()): flight for u, flight in alone.items()})
    flights = done(fleet.apart(moment, routes, moving, alone))
    return _verified(fleet, moment, step, effort, order, flights)


def flown_along(
    fleet: Fleet,
    moment: Moment,
    step: int,
    moving: Mapping[int, Sequence[Body]],
    effort: Effort,
    order: Routes,
    known: Mapping[tuple[int, bytes], PlannedFlight],
    best_s: float,
) -> Work[MissionPlan | None]:
    """An order with its flights, planned in parts; None where it does not cost less than `best_s`.

    Arguments as for `plan_mission`; `known` are flights by UAS and route.
    """
    routes = _routes(moment, order, step)
    programs = _programs(effort, len(routes))
    drafts: dict[int, Draft] = {}
    for u, route in routes.items():
        drafts[u] = yield from fleet.draft(moment, u, route, moving[u], programs, known)
        if _least_s(fleet, effort, order, drafts) >= best_s:
            return None
    alone: dict[int, PlannedFlight] = {}
    for u, route in routes.items():
        alone[u] = yield from fleet.flight(moment, u, route, moving[u], drafts[u])
    flights = yield from fleet.apart(moment, routes, moving, alone)
    plan = _verified(fleet, moment, step, effort, order, flights)
    return plan if plan.cost_s < best_s else None


def _routes(moment: Moment, order: Routes, step: int) -> dict[int, IntArray]:
    """Routes of the UAS that are to fly."""
    return {
        u: route
        for u, route in enumerate(order.routes)
        if moment.may_work[u] and (len(route) or step > 0)
    }


def _programs(effort: Effort, n_flights: int) -> int:
    each = max(_LEAST_PROGRAMS, SMALL_FLEET * effort.programs // max(n_flights, 1))
    return min(effort.programs, each)


def _least_s(fleet: Fleet, effort: Effort, order: Routes, drafts: Mapping[int, Draft]) -> float:
    """What flights made from drafts will cost at least."""
    shares = np.array([_FINISHED if begun.left else 1.0 for begun in drafts.values()])
    steps = np.array([begun.flight.steps for begun in drafts.values()])
    return mission_cost_s(fleet.brief.dt_s * shares * steps, effort.total_weight) + order.left_out_s


def _verified(
    fleet: Fleet,
    moment: Moment,
    step: int,
    effort: Effort,
    order: Routes,
    flights: Mapping[int, PlannedFlight],
) -> MissionPlan:
    """The flights that may be flown, alone and beside each other, as courses."""
    planned: dict[int, Planned] = {}
    troubles: dict[int, str] = {}
    for u in sorted(flights, key=lambda k: (-flights[k].steps, k)):
        clear = flights[u].is_clear
        why = trouble_alone(fleet, u, moment.x[u], flights[u]) if clear else NO_FLIGHT
        course = course_of(fleet, u, step, moment.x[u], flights[u])
        if why is None and not all(
            are_apart(fleet, u, k, course, other.course) for k, other in planned.items()
        ):
            why = "too near to another UAS"
        if why is None:
            planned[u] = Planned(order.routes[u], flights[u], course)
        else:
            troubles[u] = why
    seconds = fleet.brief.dt_s * np.array([p.flight.steps for p in planned.values()])
    cost_s = mission_cost_s(seconds, effort.total_weight) + order.left_out_s
    cost_s += _UNFLOWN_S * len(troubles)
    return MissionPlan(planned, order, cost_s, troubles)


def mission_cost_s(seconds: FloatArray, weight: float) -> float:
    """The longest flight, and the weight times the sum of all."""
    return float(seconds.max(initial=0.0) + weight * seconds.sum())

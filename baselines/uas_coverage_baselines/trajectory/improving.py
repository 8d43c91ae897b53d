"""A better plan for the rest of the mission, looked for while the present one is flown.

Where everything goes as planned it is known where the UAS will be some steps from now. From there
another order is searched and flights are planned along it, a little of both in each decision. If
that is finished by then, verified and cheaper than the rest of the present plan, it takes over.
Effort is counted in steps of flights looked for, never in seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.fleet import Fleet, Moment
from uas_coverage_baselines.trajectory.mission_plan import (
    HOPELESS,
    SMALL_FLEET,
    Effort,
    MissionPlan,
    Planned,
    flown_along,
    mission_cost_s,
)
from uas_coverage_baselines.trajectory.space import Body
from uas_coverage_baselines.trajectory.work import Work
from uas_coverage_env.planning.routing import (
    Routes,
    RoutingProblem,
    SearchEffort,
    empty_routes,
    improve_routes,
)
from uas_coverage_env.planning.routing.search import OrderSearch
from uas_coverage_env.world import SwarmState

BoolArray = NDArray[np.bool_]

_MOVES_PER_STEP = 60  # changes of an order take as long as a step of a flight looked for
_PROGRAMS = 60  # for each flight; more change next to nothing
_LEFT_STEPS = 20  # a plan that ends sooner after it would take over is not improved
_VARIED = 0.1  # of leg times, at most
_CHEAPER_S = 0.01


class Ahead(NamedTuple):
    """What is expected some steps from now.

    Attributes:
        earliest: (W,) steps from then before which waypoints are not to be visited.
        forbidden: (U, W) which UAS are not to visit which waypoint, if any.
        moving: What moves, as each UAS sees it from then on.
    """

    earliest: NDArray[np.int64]
    forbidden: BoolArray | None
    moving: Mapping[int, Sequence[Body]]


@dataclass
class _Attempt:
    """Another order, from a step ahead."""

    base: MissionPlan
    then: int
    work: Work[MissionPlan | None] | None
    found: MissionPlan | None = None
    owed: int = 0


class Improvement:
    """Looks for a better plan, some work at each decision.

    Args:
        fleet: The mission.
        effort: Of the search before take-off.
        steps_each: Effort at each decision; 0: none.
        seed: Of the searches.
    """

    def __init__(self, fleet: Fleet, effort: Effort, steps_each: int, seed: int) -> None:
        self._fleet, self._effort = fleet, replace(effort, programs=min(effort.programs, _PROGRAMS))
        self._steps_each, self._seed = steps_each, seed
        self._attempt: _Attempt | None = None
        self._n_attempts = 0
        self._tried: set[tuple[bytes, ...]] = set()

    def better(
        self,
        swarm: SwarmState,
        plan: MissionPlan,
        planned: Mapping[int, Planned],
        ahead: Callable[[int, Mapping[int, Planned]], Ahead],
    ) -> MissionPlan | None:
        """A plan to be flown from now on instead of the present one, if there is one.

        Args:
            swarm: What is seen; every UAS is where it was planned to be.
            plan: The present one.
            planned: What of it is being flown.
            ahead: What to expect at a step.
        """
        if not self._steps_each:
            return None
        attempt = self._attempt
        if attempt is not None and (attempt.base is not plan or swarm.step > attempt.then):
            attempt = None
        if attempt is not None and swarm.step == attempt.then:
            self._attempt = None
            found = attempt.found
            return found if found is not None and _fits(found, swarm, planned) else None
        if attempt is None:
            attempt = self._begun(swarm, plan, planned, ahead)
        self._attempt = attempt
        if attempt is not None:
            self._go_on(attempt)
        return None

    def _go_on(self, attempt: _Attempt) -> None:
        attempt.owed -= self._steps_each
        while attempt.work is not None and attempt.owed < 0:
            try:
                attempt.owed += next(attempt.work)
            except StopIteration as end:
                attempt.work, attempt.found = None, end.value
                if end.value is None:
                    self._attempt = None

    def _begun(
        self,
        swarm: SwarmState,
        plan: MissionPlan,
        planned: Mapping[int, Planned],
        ahead: Callable[[int, Mapping[int, Planned]], Ahead],
    ) -> _Attempt | None:
        """A new attempt, None where the mission is over too soon for one."""
        step, n_waypoints = swarm.step, len(swarm.uncovered)
        open_now = np.zeros(n_waypoints, np.bool_)
        for p in planned.values():
            open_now[p.route[p.open_visits(step, swarm.uncovered)]] = True
        moves = round(self._effort.moves * open_now.sum() / n_waypoints)
        steps = sum(p.course.end - step for p in planned.values())
        effort = moves / _MOVES_PER_STEP + self._effort.programs * steps
        then = step + 2 + int(effort / self._steps_each)
        left = {u: p for u, p in planned.items() if p.course.end > then}
        if max((p.course.end for p in left.values()), default=0) < then + _LEFT_STEPS:
            return None
        routes, known = [np.zeros(0, np.int64)] * len(swarm.x), {}
        for u, p in left.items():
            routes[u], flight = p.rest(then, swarm.uncovered)
            known[u, routes[u].tobytes()] = flight
        wanted = np.zeros(n_waypoints, np.bool_)
        wanted[np.concatenate(routes)] = True
        if wanted.sum() < 2:
            return None
        x = swarm.x.copy()
        for u, p in left.items():
            x[u] = p.course.x[then - p.course.begin]
        expected = ahead(then, left)
        moment = Moment(
            x,
            np.isin(np.arange(len(x)), list(left)),
            wanted,
            expected.earliest,
            self._fleet.brief.dt_s * then,
            expected.forbidden,
        )
        order = replace(plan.order, routes=tuple(routes), left_out=np.zeros(0, np.int64))
        self._n_attempts += 1
        seed = self._seed + 1000 * self._n_attempts
        work = self._worked_out(moment, then, expected.moving, order, known, moves, seed)
        return _Attempt(plan, then, work)

    def _worked_out(
        self,
        moment: Moment,
        then: int,
        moving: Mapping[int, Sequence[Body]],
        order: Routes,
        known: dict,
        moves: int,
        seed: int,
    ) -> Work[MissionPlan | None]:
        effort, n_uas = self._effort, len(moment.x)
        dt_s = self._fleet.brief.dt_s
        seconds = dt_s * np.array([flight.steps for flight in known.values()])
        present_s = mission_cost_s(seconds, effort.total_weight)
        problem = self._fleet.problem(moment)
        nothing = SearchEffort(0, total_weight=effort.total_weight)
        kept = improve_routes(problem, order, nothing, 0)
        search = SearchEffort(
            moves, total_weight=effort.total_weight, by_pieces=n_uas > SMALL_FLEET
        )
        searched = OrderSearch(_varied(problem, seed), empty_routes(n_uas), search, seed)
        part = _MOVES_PER_STEP * self._steps_each
        while not searched.is_over:
            yield self._steps_each
            searched.go_on(part)
        new = improve_routes(problem, searched.best, nothing, 0)
        key = tuple(route.tobytes() for route in new.routes)
        if len(new.left_out) or new.cost_s > HOPELESS * kept.cost_s or key in self._tried:
            return None
        self._tried.add(key)
        if all(np.array_equal(a, b) for a, b in zip(new.routes, order.routes, strict=True)):
            return None
        best_s = present_s - _CHEAPER_S
        found = yield from flown_along(
            self._fleet, moment, then, moving, effort, new, known, best_s
        )
        return found if found is not None and not found.troubles else None


def all_but_own(planned: Mapping[int, Planned], shape: tuple[int, int]) -> BoolArray:
    """(U, W) waypoints that are not on a UAS's own route."""
    others = np.ones(shape, np.bool_)
    for u, p in planned.items():
        others[u, p.route] = False
    return others


def _varied(problem: RoutingProblem, seed: int) -> RoutingProblem:
    """The same problem with somewhat other leg times: legs are not as exact as flights are."""
    rng = np.random.default_rng(seed)
    n_uas, n_waypoints = problem.n_uas, problem.n_waypoints
    noise = rng.uniform(-_VARIED, _VARIED, (n_waypoints, n_waypoints))
    ends = 1.0 + rng.uniform(-_VARIED, _VARIED, (2, n_uas, n_waypoints))
    return problem.replace(
        between_s=problem.between_s * (1.0 + 0.5 * (noise + noise.T)),
        first_s=problem.first_s * ends[0],
        home_s=problem.home_s * ends[1],
    )


def _fits(found: MissionPlan, swarm: SwarmState, planned: Mapping[int, Planned]) -> bool:
    """Whether a plan begins where the UAS are, and visits all that is to be visited still."""
    if found.planned.keys() != {u for u, p in planned.items() if p.course.end > swarm.step}:
        return False
    visited = np.zeros(len(swarm.uncovered), np.bool_)
    for u, new in found.planned.items():
        if not new.course.begins_at(swarm.x[u]):
            return False
        visited[new.route] = True
    return not any(
        (~visited[p.route[p.open_visits(swarm.step, swarm.uncovered)]]).any()
        for p in planned.values()
    )

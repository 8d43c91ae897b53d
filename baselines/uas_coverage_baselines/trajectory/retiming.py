"""The quickest flight along a route: visits are moved in time until no step can be spared.

The costates of the program say what a step more or less is worth in every stretch between two
visits. Steps are moved from where they are worth least to where they are worth most, and one is
taken away as long as a flight is left that violates nothing: first in all stretches at once, then
one by one. The effort is counted in programs solved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.first_guess import deepest_visits, first_flight
from uas_coverage_baselines.trajectory.program import FlightProgram, PlannedFlight
from uas_coverage_baselines.trajectory.work import Work
from uas_coverage_env.planning.routing.terrain import Terrain

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_FIRST_SHARE, _LAST_SHARE = 0.12, 0.03
_MENDABLE = 4.0
_REPAIRS = 12
_STRETCHES = 3  # the longest, of which one is made shorter
_LONG_STEPS = 400


class Worth(NamedTuple):
    """What time is worth in the stretches between visits, in order of time.

    Attributes:
        order: (K,) rows of the visits, by their step.
        gain: (K+1,) what a step more takes off the violation.
        cost: (K+1,) what a step less adds to it; inf where there is none to spare.
    """

    order: IntArray
    gain: FloatArray
    cost: FloatArray


def worth(flight: PlannedFlight) -> Worth:
    """The shadow prices of time: what the costates say of one step along the flight."""
    order = np.argsort(flight.visits, kind="stable")
    # holding the state of a step for one more: the change of state that this saves, priced
    price = -np.einsum("ij,ij->i", flight.costate, np.diff(flight.x, axis=0))
    gain, cost = np.zeros(len(order) + 1), np.full(len(order) + 1, np.inf)
    begin = 0
    for k, end in enumerate([*flight.visits[order].tolist(), flight.steps]):
        part = price[begin:end] if end > begin else price[max(end - 1, 0) : end]
        if len(part):
            gain[k] = part.max()
            if end - begin > 1:
                cost[k] = part.min()
        begin = end
    return Worth(order, gain, cost)


def stretches(flight: PlannedFlight) -> tuple[IntArray, IntArray]:
    """Rows of the visits by their step (K,), and steps between them (K+1,)."""
    order = np.argsort(flight.visits, kind="stable")
    return order, np.diff(np.concatenate([[0], flight.visits[order], [flight.steps]]))


def shifted(visits: IntArray, order: IntArray, stretch: int, by: int) -> IntArray:
    """The visits with a stretch made longer: all later ones move."""
    visits = visits.copy()
    visits[order[stretch:]] += by
    return visits


def retimed(
    program: FlightProgram,
    start: FloatArray,
    route: IntArray,
    flight: PlannedFlight,
    visits: IntArray,
    steps: int,
    rounds: int = 3,
) -> PlannedFlight:
    """The flight with other steps of the visits, its guess stretched in time between them."""
    old = np.concatenate([[0], np.sort(flight.visits), [flight.steps]]).astype(float)
    new = np.concatenate([[0], np.sort(visits), [steps]]).astype(float)
    kept = np.concatenate([[True], np.diff(new) > 0])
    at = np.interp(np.arange(steps + 1), new[kept], old[kept])
    low = np.minimum(at.astype(np.int64), flight.steps - 1)
    share = (at - low)[:, None]
    guess = (1.0 - share) * flight.x[low] + share * flight.x[low + 1]
    return program.solve(start, route, visits, guess, flight.u[low[:-1]], rounds)


class Draft(NamedTuple):
    """A flight that is to be made shorter still.

    Attributes:
        flight: So far.
        left: Programs to solve for that, about.
    """

    flight: PlannedFlight
    left: int


def draft(
    program: FlightProgram,
    terrain: Terrain,
    uas: int,
    start: FloatArray,
    route: IntArray,
    budget: int,
    first_steps: float = np.inf,
) -> Work[Draft]:
    """A flight along a route, as short as all its stretches may be made at once.

    Args:
        program: Of the UAS.
        terrain: Of the mission.
        uas: Index of the UAS.
        start: (10,) state.
        route: (K,) waypoints.
        budget: Programs to solve, about, fewer for long flights; the first flight is not counted.
        first_steps: Work on that at most, in steps of flights looked for.
    """
    flight = yield from first_flight(program, terrain, uas, start, route, first_steps)
    if not flight.is_clear:
        return Draft(flight, 0)
    # one program of a long flight takes as long as several of a short one
    until = program.solved + round(budget * min(1.0, _LONG_STEPS / flight.steps))
    most = until if np.isfinite(first_steps) else np.inf
    flight = yield from _coarse(program, start, route, flight, until, most)
    return Draft(flight, until - program.solved)


def finished(
    program: FlightProgram, start: FloatArray, route: IntArray, begun: Draft
) -> Work[PlannedFlight]:
    """The quickest flight found from a draft: steps are taken away one by one."""
    until = program.solved + begun.left
    return (yield from shorten(program, start, route, begun.flight, until))


def _coarse(
    program: FlightProgram,
    start: FloatArray,
    route: IntArray,
    flight: PlannedFlight,
    until: int,
    most: float,
) -> Work[PlannedFlight]:
    """All stretches shorter at once; those in which time is dear get their steps back.

    No attempt is begun after `until` programs, nor gone on with after `most`.
    """
    share, frozen = _FIRST_SHARE, np.zeros(len(route) + 1, bool)
    while share > _LAST_SHARE and program.solved < until:
        order, lengths = stretches(flight)
        less = np.where(frozen, 0, np.round(share * lengths)).astype(np.int64)
        less[(lengths > 1) & ~frozen & (less == 0) & (np.arange(len(less)) % 3 == 0)] = 1
        less = np.maximum(np.minimum(less, lengths - 1), 0)
        new = None
        for _ in range(6):
            if less.sum() == 0 or program.solved >= most:
                break
            ends = np.cumsum(lengths - less)
            visits = flight.visits.copy()
            visits[order] = ends[:-1]
            new = retimed(program, start, route, flight, visits, int(ends[-1]))
            yield new.steps
            if not new.is_clear and new.violation < _MENDABLE and program.solved < most:
                new = yield from repair(program, start, route, new, 3)
            if new.is_clear:
                break
            prices = worth(new).gain
            dear = (prices >= 0.4 * prices.max()) & (less > 0)
            if not dear.any():
                dear = less > 0
            frozen |= dear & (less <= 1)
            less[dear] //= 2
        if new is not None and new.is_clear and new.steps < flight.steps:
            flight = new
        else:
            share *= 0.5
            frozen[:] = False
    return flight


def repair(
    program: FlightProgram, start: FloatArray, route: IntArray, flight: PlannedFlight, tries: int
) -> Work[PlannedFlight]:
    """Move steps between stretches until nothing is violated, or nothing helps."""
    tabu: set[bytes] = set()
    for _ in range(tries):
        if flight.is_clear or not np.isfinite(flight.violation):
            return flight
        better = None
        for visits in _candidates(program, route, flight):
            key = visits.tobytes()
            if key in tabu or (visits < 1).any() or (visits > flight.steps).any():
                continue
            tabu.add(key)
            new = retimed(program, start, route, flight, visits, flight.steps)
            yield new.steps
            if new.violation < flight.violation - 1e-3:
                better = new
                break
        if better is None:
            return flight
        flight = better
    return flight


def _candidates(program: FlightProgram, route: IntArray, flight: PlannedFlight) -> list[IntArray]:
    """Visits to try: where the spheres are passed, then a step from cheap to dear stretches."""
    result = []
    near = deepest_visits(program, flight, route)
    if (near != flight.visits).any():
        result.append(near)
    order, gain, cost = worth(flight)
    into, out = np.argsort(-gain, kind="stable")[:3], np.argsort(cost, kind="stable")[:3]
    pairs = sorted(
        ((gain[i] - cost[o], int(i), int(o)) for i in into for o in out if i != o), reverse=True
    )
    for value, i, o in pairs[:4]:
        if np.isfinite(value) and value >= -0.5:
            result.append(shifted(shifted(flight.visits, order, i, 1), order, o, -1))
    return result


def shorten(
    program: FlightProgram, start: FloatArray, route: IntArray, flight: PlannedFlight, until: int
) -> Work[PlannedFlight]:
    """Take steps away, one by one, as long as a flight is left that violates nothing."""
    while program.solved < until:
        order, lengths = stretches(flight)
        shorter = None
        for stretch in np.argsort(-lengths, kind="stable")[:_STRETCHES]:
            visits = shifted(flight.visits, order, stretch, -1)
            if lengths[stretch] < 2 or (visits < 1).any():
                continue
            new = retimed(program, start, route, flight, visits, flight.steps - 1)
            yield new.steps
            new = yield from repair(program, start, route, new, _REPAIRS)
            if new.is_clear:
                shorter = new
                break
        if shorter is None:
            return flight
        flight = shorter
    return flight

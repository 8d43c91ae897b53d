"""Where the search for a flight begins: positions along the ways past the obstacles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.flight_model import POSITION, VELOCITY
from uas_coverage_baselines.trajectory.program import FlightProgram, PlannedFlight
from uas_coverage_baselines.trajectory.space import Space
from uas_coverage_baselines.trajectory.work import Work
from uas_coverage_env.planning.routing.terrain import Terrain

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_CRUISE = 0.75  # share of the largest speed
_SLOWER = (1.0, 0.85, 0.7, 0.5)
_SLOWEST = (
    0.35  # share of that, at last: along a facade, where visits follow each other up and down
)
_WAITS_S = (6.0, 12.0, 20.0)
_CLIMB, _DESCENT = 0.83, 0.87
_SET_OFF_S, _SETTLE_S = 3.0, 4.0
_DENSE_M = 4.0  # at scale 1, as the next two
_OVER_M = 0.5
_BESIDE_M = 0.5
_STOPPING_S = 2.5
_DEEPER_M = 0.5  # at scale 1
_MENDS = 3
_MOST_MISSED = 20  # visits; where more are missed, moving them one by one mends nothing


class Guess(NamedTuple):
    """A path without dynamics.

    Attributes:
        path_m: (N+1, 3).
        visits: (K,) steps.
    """

    path_m: FloatArray
    visits: IntArray


class Speeds(NamedTuple):
    """Of a guess [m/s]."""

    level: float
    up: float
    down: float


def first_flight(
    program: FlightProgram,
    terrain: Terrain,
    uas: int,
    start: FloatArray,
    route: IntArray,
    most_steps: float = np.inf,
) -> Work[PlannedFlight]:
    """A flight along a route that violates nothing, however slow; else what violates least.

    Args:
        program: Of the UAS.
        terrain: Of the mission.
        uas: Index of the UAS.
        start: (10,) state.
        route: (K,) waypoints.
        most_steps: After so much work no other way is tried, in steps of flights looked for.
    """
    left = most_steps
    best: PlannedFlight | None = None
    limits = program.model
    tries = [(slower, 0.0, False) for slower in _SLOWER]
    if np.abs(start[VELOCITY]).max() > 0.5:
        tries += [(_SLOWER[1], wait_s, False) for wait_s in _WAITS_S]
    tries += [(slower, 0.0, True) for slower in (*_SLOWER, _SLOWEST)]
    for slower, wait_s, dips in tries:
        if left <= 0.0 and best is not None:
            break
        speeds = Speeds(
            _CRUISE * slower * float(limits.norms[0]),
            _CLIMB * float(limits.vertical[0]),
            _DESCENT * float(limits.vertical[1]),
        )
        guess = guess_path(program, terrain, uas, start[POSITION], route, speeds, dips=dips)
        if program.earliest is not None:
            guess = _delayed(guess, program.earliest[route])
        if wait_s:
            guess = _waiting(guess, start, max(round(wait_s / limits.dt_s), 1))
        flight = program.solve(start, route, guess.visits, guess.path_m, rounds=4)
        yield flight.steps
        left -= flight.steps
        if np.isfinite(flight.violation):
            mended = _mended(program, start, route, flight, left)
            flight, left = yield from mended
        if flight.is_clear:
            return flight
        if best is None or flight.violation < best.violation:
            best = flight
    assert best is not None
    return best


def _mended(
    program: FlightProgram, start: FloatArray, route: IntArray, flight: PlannedFlight, left: float
) -> Work[tuple[PlannedFlight, float]]:
    """Visits moved where they are missed, until nothing is violated or helps; and work left."""
    for _ in range(_MENDS):
        missed = np.flatnonzero(flight.missed_m > 0.02)
        if flight.is_clear or len(missed) > _MOST_MISSED:
            break
        for k in missed:
            for by in (1, 2, -1):
                if left <= 0.0:
                    return flight, left
                visits = flight.visits.copy()
                visits[k] = min(max(visits[k] + by, 1), flight.steps - 1)
                new = program.solve(start, route, visits, flight.x, flight.u)
                yield new.steps
                left -= new.steps
                if new.violation < flight.violation - 1e-3:
                    flight = new
                    break
        visits = deepest_visits(program, flight, route)
        new = program.solve(start, route, visits, flight.x, flight.u)
        yield new.steps
        left -= new.steps
        flight = new if new.violation < flight.violation else flight
    return flight, left


def deepest_visits(program: FlightProgram, flight: PlannedFlight, route: IntArray) -> IntArray:
    """Visits moved to the samples nearby at which the flight is deepest inside the sphere."""
    visits = flight.visits.copy()
    for k, waypoint in enumerate(route):
        low, high = max(1, visits[k] - 2), min(flight.steps - 1, visits[k] + 2)
        if high < low:
            continue
        away_m = np.linalg.norm(
            flight.path_m[low : high + 1] - program.waypoints_m[waypoint], axis=1
        )
        best = int(np.argmin(away_m))
        if (
            low <= visits[k] <= high
            and away_m[best] < away_m[visits[k] - low] - program.space.length_scale * _DEEPER_M
        ):
            visits[k] = low + best
    return visits


def guess_path(
    program: FlightProgram,
    terrain: Terrain,
    uas: int,
    start_m: FloatArray,
    route: IntArray,
    speeds: Speeds,
    *,
    dips: bool = False,
) -> Guess:
    """Positions at every step along the quicker of the ways over and round.

    Args:
        program: Of the UAS.
        terrain: Of the mission.
        uas: Index of the UAS.
        start_m: (3,).
        route: (K,) waypoints.
        speeds: Of the guess.
        dips: Whether to fly straight down and up at waypoints that are too low to be reached on
            the way, as in a yard.
    """
    dt_s, space = program.model.dt_s, program.space
    points, marks = [np.asarray(start_m, float)], []
    n_waypoints = len(program.waypoints_m)
    for target in [*route.tolist(), -1]:
        end_m = program.landing.home_m if target < 0 else program.waypoints_m[target]
        row = n_waypoints + uas if target < 0 else target
        ways = terrain.ways(row, points[-1], end_m)
        way = min(ways, key=lambda w: _way_s(w, space, speeds)) if len(ways) > 1 else ways[0]
        points.extend(way[1:])
        if target >= 0:
            marks.append(len(points) - 1)
    corners = np.array(points)
    deep_m = 0.5 * program.radius_m[route] if dips else np.full(len(route), np.inf)
    path_m, at_s, marks_at = _timed(corners, marks, deep_m, space, speeds)
    at_s[1:] += _SET_OFF_S
    n_steps = int(np.ceil((at_s[-1] + _SETTLE_S) / dt_s))
    clock_s = dt_s * np.arange(n_steps + 1)
    sampled_m = np.column_stack([np.interp(clock_s, at_s, path_m[:, a]) for a in range(3)])
    visits = np.clip(np.round(at_s[marks_at] / dt_s).astype(np.int64), 1, n_steps - 1)
    return Guess(sampled_m, visits)


def _timed(
    corners: FloatArray, marks: list[int], deep_m: FloatArray, space: Space, speeds: Speeds
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Places along corners, raised over what they meet; their times; and where the marks are.

    Climbs begin and descents end far enough away to be flown on the way, but start and end are
    left, and reached, straight up and down where they must be; so are marks that the path would
    pass more than `deep_m` (K,) too high.
    """
    dense, first = _dense(corners, space)
    top_m = _needed_m(dense, space)
    step_m = np.hypot(*np.diff(dense[:, :2], axis=0).T)
    for n in range(len(top_m) - 2, -1, -1):
        top_m[n] = max(top_m[n], top_m[n + 1] - speeds.up / speeds.level * step_m[n])
    for n in range(1, len(top_m)):
        top_m[n] = max(top_m[n], top_m[n - 1] - speeds.down / speeds.level * step_m[n - 1])
    top_m = np.minimum(top_m, _below_lintels_m(dense, space))
    raised = np.column_stack([dense[:, :2], -top_m])
    at = first[marks]
    dip = -corners[marks, 2] < top_m[at] - deep_m
    # down to the mark and up again
    below = np.column_stack([raised[at[dip], :2], corners[np.array(marks, int)[dip], 2]])
    twice = np.insert(raised, np.repeat(at[dip] + 1, 2), np.repeat(below, 2, axis=0), axis=0)
    twice[at[dip] + 2 * np.arange(1, dip.sum() + 1)] = raised[at[dip]]
    at = at + 2 * np.cumsum(dip) - dip  # the mark itself, where there is a dip
    path_m = np.vstack([corners[:1], twice, corners[-1:]])
    away = np.diff(path_m, axis=0)
    seconds = np.maximum.reduce(
        [
            np.hypot(away[:, 0], away[:, 1]) / speeds.level,
            -away[:, 2] / speeds.up,
            away[:, 2] / speeds.down,
        ]
    )
    return path_m, np.concatenate([[0.0], np.cumsum(seconds)]), at + 1


def _dense(corners: FloatArray, space: Space) -> tuple[FloatArray, IntArray]:
    """Places a few metres apart along corners, and at which of them each corner is."""
    away = np.diff(corners, axis=0)
    dense_m = space.length_scale * _DENSE_M
    pieces = np.maximum((np.hypot(away[:, 0], away[:, 1]) / dense_m).astype(np.int64), 1)
    parts = [
        p + np.linspace(0.0, 1.0, k, endpoint=False)[:, None] * step
        for p, step, k in zip(corners[:-1], away, pieces, strict=True)
    ]
    return np.vstack([*parts, corners[-1:]]), np.concatenate([[0], np.cumsum(pieces)])


def _way_s(corners: FloatArray, space: Space, speeds: Speeds) -> float:
    """Flight time along corners; what has to be climbed over takes as long as it takes."""
    dense, _ = _dense(corners, space)
    length_m = np.hypot(*np.diff(corners[:, :2], axis=0).T)
    top_m = _needed_m(dense, space).max()
    first_m, last_m = -corners[0, 2], -corners[-1, 2]
    climb_s = max(top_m - first_m, 0.0) / speeds.up + max(top_m - last_m, 0.0) / speeds.down
    return max(float(length_m.sum()) / speeds.level, climb_s)


def _needed_m(path_m: FloatArray, space: Space) -> FloatArray:
    """(N+1,) altitudes at which a path passes over what it meets, where it can."""
    top_m, over_m = -path_m[:, 2].copy(), space.length_scale * _OVER_M
    if space.least_height_m > 0.0:
        outside = ~space.is_in_zone(path_m)
        top_m[outside] = np.maximum(top_m[outside], space.planned_height_m + over_m)
    outside_m = path_m @ space.fence_normals.T + space.fence_offsets_m
    up = -space.fence_normals[:, 2]
    room_m = np.where(up > 0.1, -outside_m / np.maximum(up, 0.1), np.inf).min(axis=1)
    ceiling_m = -path_m[:, 2] + room_m
    for o, keep_m in enumerate(space.keep_m):
        if space.has_way_below[o]:
            continue
        faces = slice(space.first[o], space.first[o + 1])
        normals, offsets_m = space.normals[faces], space.offsets_m[faces]
        near = ((path_m >= space.low_m[o] - keep_m) | (np.arange(3) == 2)) & (
            (path_m <= space.high_m[o] + keep_m) | (np.arange(3) == 2)
        )
        rows = np.flatnonzero(near.all(axis=1))
        if not len(rows):
            continue
        walls = np.abs(normals[:, 2]) < 0.7
        beside_m = path_m[rows] @ normals[walls].T + offsets_m[walls]
        inside = np.zeros(len(path_m), bool)
        inside[rows] = (
            beside_m.max(axis=1, initial=-np.inf) < keep_m - space.length_scale * _BESIDE_M
        )
        roof_m = -space.low_m[o, 2] + keep_m + over_m
        inside[1:] |= inside[:-1]
        inside[:-1] |= inside[1:]
        lifted = inside & (roof_m < ceiling_m)
        top_m[lifted] = np.maximum(top_m[lifted], roof_m)
    return top_m


def _below_lintels_m(path_m: FloatArray, space: Space) -> FloatArray:
    """(N+1,) altitudes below which a path leads through doors; inf where there is no lintel."""
    below_m, under_m = np.full(len(path_m), np.inf), space.length_scale * _OVER_M
    for o in np.flatnonzero(space.has_way_below):
        wide_m = space.keep_m[o] + under_m
        low_m, high_m = space.low_m[o, :2] - wide_m, space.high_m[o, :2] + wide_m
        near = ((path_m[:, :2] >= low_m) & (path_m[:, :2] <= high_m)).all(axis=1)
        near[1:] |= near[:-1].copy()
        near[:-1] |= near[1:].copy()
        below_m[near] = np.minimum(below_m[near], -space.high_m[o, 2] - wide_m)
    return below_m


def _delayed(guess: Guess, earliest: IntArray) -> Guess:
    """The same path, waiting before what cannot be visited yet."""
    path_m, visits = guess
    for k in np.argsort(visits, kind="stable"):
        late = int(earliest[k] - visits[k])
        if late > 0:
            at = max(visits[k] - 4, 0)
            still = np.repeat(path_m[at : at + 1], late, axis=0)
            path_m = np.vstack([path_m[: at + 1], still, path_m[at + 1 :]])
            visits = np.where(visits >= visits[k], visits + late, visits)
    return Guess(path_m, visits)


def _waiting(guess: Guess, start: FloatArray, steps: int) -> Guess:
    """The same path after a stop: lets pass what comes."""
    stop_m = start[POSITION] + _STOPPING_S * start[VELOCITY] * np.array([1.0, 1.0, 0.4])
    still = np.tile(stop_m, (steps, 1))
    return Guess(np.vstack([guess.path_m[:1], still, guess.path_m[1:]]), guess.visits + steps)

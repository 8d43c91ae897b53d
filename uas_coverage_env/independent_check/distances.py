"""What a flown UAS has to keep clear of, and how far it was: on segments and on curves.

For the independent check: no code of the world's geometry is used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from uas_coverage_env.independent_check.record import FlightRecord, Track

FloatArray = NDArray[np.float64]
Distance = Callable[[FloatArray], FloatArray]

CURVE_POINTS = 20  # of each step, on the curve through positions and velocities
_NARROWINGS = 70  # (2/3)^70 of a step is less than 1e-11 m


@dataclass(frozen=True)
class Partner:
    """Something to keep clear of: how far a point is from it, and how far is enough.

    Attributes:
        kind: As in `violations` of the summary.
        name: Whose; None of the fence.
        distance: (..., 3) [m] relative to `path_m` -> (...) [m].
        contact_m: Closer than this is a contact.
        safe_m: Closer than this at a sample is a breach.
        path_m: (T, 3) [m] its positions; zero where it stands still.
        at: Its positions at other times [s]; None where it stands still or is a UAS.
    """

    kind: str
    name: str | None
    distance: Distance
    contact_m: float
    safe_m: float
    path_m: FloatArray
    at: Callable[[FloatArray], FloatArray] | None = None


def hull_distance(vertices_m: Any) -> Distance:
    """The largest signed distance from the faces of the hull of some points, outside positive."""
    points = np.array(vertices_m, float)
    centre = points.mean(axis=0)
    normals, offsets = faces(points - centre)
    return lambda p: ((p - centre) @ normals.T + offsets).max(axis=-1)


def faces(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(F, 3) outward normals of the hull of some points, and (F,) offsets: 0 on a face."""
    equations = ConvexHull(points).equations
    return equations[:, :-1], equations[:, -1]


def cylinder_distance(radius_m: float, half_height_m: float) -> Distance:
    """How far outside an upright cylinder about the origin: horizontally or vertically."""
    return lambda p: np.maximum(
        np.hypot(p[..., 0], p[..., 1]) - radius_m, np.abs(p[..., 2]) - half_height_m
    )


def least_on_segments(distance: Distance, start: FloatArray, end: FloatArray) -> FloatArray:
    """(n,) the smallest distance on each straight segment; the distance must be convex.

    A convex function's smallest value on an interval lies in the two thirds that the smaller of
    its values at one and two thirds belongs to.
    """
    low, high = np.zeros(len(start)), np.ones(len(start))

    def at(share: FloatArray) -> FloatArray:
        return distance(start + share[:, None] * (end - start))

    for _ in range(_NARROWINGS):
        third = (high - low) / 3.0
        first, second = low + third, high - third
        left = at(first) <= at(second)
        low, high = np.where(left, low, first), np.where(left, second, high)
    return np.minimum(np.minimum(at(0.0 * low), at(0.0 * low + 1.0)), at(0.5 * (low + high)))


def curve(position: FloatArray, velocity: FloatArray, dt_s: float) -> FloatArray:
    """(n-1, CURVE_POINTS+1, 3) points of the cubic curves through positions and velocities."""
    s = np.linspace(0.0, 1.0, CURVE_POINTS + 1)[None, :, None]
    p, q = position[:-1, None], position[1:, None]
    v, w = dt_s * velocity[:-1, None], dt_s * velocity[1:, None]
    rest = 1.0 - s
    return rest**2 * ((1 + 2 * s) * p + s * v) + s**2 * ((3 - 2 * s) * q - rest * w)


def scheduled(obstacle: dict[str, Any], time_s: FloatArray) -> FloatArray:
    """(..., 3) [m] where a moving obstacle's schedule has it at times (...)."""
    position = np.broadcast_to(np.array(obstacle["start_m"], float), (*time_s.shape, 3)).copy()
    pieces = obstacle["schedule"]
    for piece, following in zip(pieces, [*pieces[1:], None], strict=True):
        until = np.inf if following is None else following["from_s"]
        lasted = np.clip(time_s, piece["from_s"], until) - piece["from_s"]
        position += lasted[..., None] * np.array(piece["velocity_mps"], float)
    return position


def partners_of(record: FlightRecord, row: int) -> Iterator[Partner]:
    """What a UAS has to keep clear of, in the order in which contacts count."""
    scenario, me = record.scenario, record.tracks[row]
    radius, still = me.entry["radius_m"], np.zeros((record.steps + 1, 3))
    for obstacle in scenario["obstacles"]:
        safe = radius + obstacle["safe_distance_m"]
        distance = hull_distance(obstacle["vertices_m"])
        yield Partner("obstacle", obstacle["name"], distance, radius, safe, still)
    for m, moving in enumerate(scenario["moving_obstacles"]):
        distance = cylinder_distance(moving["radius_m"], 0.5 * moving["height_m"])
        safe, path = radius + moving["safe_distance_m"], record.moving_m[:, m]
        yield Partner(
            *("moving_obstacle", moving["name"], distance, radius, safe, path),
            at=lambda time_s, moving=moving: scheduled(moving, time_s),
        )
    for other in record.tracks:
        if other is not me:
            apart = radius + other.entry["radius_m"]
            safe = apart + scenario["uas_safe_distance_m"]
            distance = cylinder_distance(0.0, 0.0)
            yield Partner("uas", other.name, distance, apart, safe, other.position_m)
    inside = hull_distance(scenario["geofence"]["vertices_m"])
    # convex outside, not inside: on a segment the farthest end is what counts, see `on_segments`
    margin = scenario["geofence"]["margin_m"]
    yield Partner("geofence", None, lambda p: -inside(p), 0.0, margin, still)


def too_low(scenario: dict[str, Any], track: Track) -> NDArray[np.int64]:
    """Steps after which a UAS is below the least height and near neither its start nor its home."""
    least = scenario.get("min_height_m", 0.0)
    position = track.position_m[1:]
    low = -position[:, 2] < least - 1e-9
    for obstacle in scenario["obstacles"] if least else ():
        points = np.array(obstacle["vertices_m"], float)
        centre = points.mean(axis=0)
        normals, offsets = faces(points - centre)
        pushed_up = offsets - least * np.maximum(0.0, -normals[:, 2])
        low |= ((position - centre) @ normals.T + pushed_up).max(axis=1) < -1e-9
    for place_m in (track.entry["start_m"], track.home_m):
        away = np.hypot(*(position - np.array(place_m))[:, :2].T)
        low &= away > scenario["landing_distance_m"] + 2.0 * least
    return np.flatnonzero(low)


def on_segments(partner: Partner, track: Track) -> FloatArray:
    """(steps,) smallest distance from a partner on each straight segment that both fly."""
    relative = relative_m(partner, track)
    if partner.kind == "geofence":
        at_samples = partner.distance(relative)
        return np.minimum(at_samples[:-1], at_samples[1:])
    return least_on_segments(partner.distance, relative[:-1], relative[1:])


def relative_m(partner: Partner, track: Track) -> FloatArray:
    """(n, 3) [m] positions seen from the partner, at the samples of both."""
    together = min(len(track.modes), len(partner.path_m))
    return track.position_m[:together] - partner.path_m[:together]


def on_curves(partner: Partner, row: int, curves: dict[str, FloatArray], dt_s: float) -> FloatArray:
    """(steps,) smallest distance from a partner on the points of each curve."""
    names = list(curves)
    mine = curves[names[row]]
    if partner.kind == "uas":
        theirs = curves[str(partner.name)]
        together = min(len(mine), len(theirs))
        mine = mine[:together] - theirs[:together]
    elif partner.at is not None:
        share = np.linspace(0.0, 1.0, mine.shape[1])
        mine = mine - partner.at(dt_s * (np.arange(len(mine))[:, None] + share))
    return partner.distance(mine).min(axis=1)

"""What a replay page knows of safety: room beyond the safe distances, and what lies below a UAS.

Distances are those by which flights are judged (docs/rules.md), at the samples.
"""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight import MODES, Flight
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.geometry import ConvexPolytope

FAR_M = 50.0
"""Room beyond this is shown as this."""

OBSTACLES, MOVING, OTHERS, FENCE, HEIGHT = KINDS = (
    "obstacles",
    "moving",
    "others",
    "fence",
    "height",
)

FloatArray = NDArray[np.float64]
Nearest = tuple[FloatArray, NDArray[np.int64]]


def rooms(flight: Flight, history: SceneHistory) -> dict[str, Nearest]:
    """Room beyond the safe distance of what is nearest, by kind; of kinds that there are.

    Args:
        flight: The flight.
        history: Its scenes: only what is there at a sample counts.

    Returns:
        Kind -> ((T, U) [m], negative where it is a breach, at most `FAR_M`, which is also where a
        UAS does not fly; (T, U) index of what is nearest, -1: of nothing).
    """
    samples = np.arange(len(flight.x))[:, None]
    flies = samples <= flight.last_sample
    flies &= (flight.mode < MODES.index("landed")) & ~flight.resting
    each_m = {
        OBSTACLES: _to_obstacles(flight, history),
        MOVING: _to_moving(flight, history),
        OTHERS: _to_others(flight, flies),
        FENCE: [_to_fence(flight, history)],
        HEIGHT: _above(flight, history),
    }
    return {kind: _nearest(of_kind, flies) for kind, of_kind in each_m.items() if of_kind}


def _radii_m(flight: Flight) -> FloatArray:
    return np.array([uas.radius_m for uas in flight.scenario.uas])


def _to_obstacles(flight: Flight, history: SceneHistory) -> list[FloatArray]:
    """(T, U) [m] room to each fixed obstacle; infinite before it is there."""
    scenario, samples = history.scenario, np.arange(len(flight.x))[:, None]
    return [
        np.where(
            samples >= since,
            hull.signed_distance(flight.x[..., :3]) - _radii_m(flight) - obstacle.safe_distance_m,
            np.inf,
        )
        for obstacle, hull, since in zip(
            scenario.obstacles, scenario.hulls, history.obstacle_from, strict=True
        )
    ]


def _to_moving(flight: Flight, history: SceneHistory) -> list[FloatArray]:
    """(T, U) [m] room to each moving obstacle; infinite before it is there."""
    samples, places_m = np.arange(len(flight.x))[:, None], history.moving_position_m
    found = []
    for m, obstacle in enumerate(history.scenario.moving_obstacles):
        way_m = flight.x[..., :3] - places_m[:, None, m]
        outside_m = _outside(way_m, obstacle.radius_m, obstacle.height_m / 2.0)
        room_m = outside_m - _radii_m(flight) - obstacle.safe_distance_m
        found.append(np.where(samples >= history.moving_from[m], room_m, np.inf))
    return found


def _to_others(flight: Flight, flies: NDArray[np.bool_]) -> list[FloatArray]:
    """(T, U) [m] room to each UAS while it flies; none where there is one alone."""
    at_m, radii_m = flight.x[..., :3], _radii_m(flight)
    found = []
    for j in range(len(radii_m) if len(radii_m) > 1 else 0):
        room_m = _outside(at_m - at_m[:, j, None]) - radii_m - radii_m[j]
        room_m = room_m - flight.scenario.uas_safe_distance_m
        found.append(np.where(flies[:, j, None] & (np.arange(len(radii_m)) != j), room_m, np.inf))
    return found


def _to_fence(flight: Flight, history: SceneHistory) -> FloatArray:
    scenario = history.scenario
    return -scenario.fence.signed_distance(flight.x[..., :3]) - scenario.geofence.margin_m


def _above(flight: Flight, history: SceneHistory) -> list[FloatArray]:
    """(T, U) [m] room above the least height, beyond take-off and landing; none without one."""
    if history.scenario.min_height_m <= 0.0:
        return []
    starts_m = np.array([uas.start_m for uas in history.scenario.uas])
    low = np.zeros(flight.mode.shape, np.bool_)  # it may be
    for ends_m in (starts_m, history.home_m):
        away_m = np.linalg.norm(flight.x[..., :2] - ends_m[..., :2], axis=-1)
        low |= away_m <= history.scenario.landing_zone_m
    return [np.where(low, np.inf, _height_room(flight, history))]


def floors_m(flight: Flight, history: SceneHistory) -> FloatArray:
    """(T, U) [m] altitude of the highest roof under each UAS, or around it; 0: the ground."""
    at_m, samples = flight.x[..., :3], np.arange(len(flight.x))[:, None]
    floor = np.zeros(at_m.shape[:2])
    for hull, since in zip(history.scenario.hulls, history.obstacle_from, strict=True):
        bottom, top = _column(hull, at_m[..., :2])
        over = (samples >= since) & (bottom <= top) & (bottom <= -at_m[..., 2])
        floor = np.where(over, np.maximum(floor, top), floor)
    return floor


def _column(hull: ConvexPolytope, at_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and greatest altitude in a hull at places (..., 2); beside it least > greatest."""
    normals, flat = hull.normals, at_m @ hull.normals[:, :2].T + hull.offsets_m
    up, down = normals[:, 2] < -1e-9, normals[:, 2] > 1e-9
    top = (-flat[..., up] / -normals[up, 2]).min(axis=-1)
    bottom = (flat[..., down] / normals[down, 2]).max(axis=-1)
    outside = (flat[..., ~(up | down)] > 0.0).any(axis=-1)
    return np.where(outside, np.inf, bottom), np.where(outside, -np.inf, top)


def _height_room(flight: Flight, history: SceneHistory) -> FloatArray:
    """(T, U) [m] height above ground or roof, beyond the least height."""
    least_m, at_m = flight.scenario.min_height_m, flight.x[..., :3]
    room = -at_m[..., 2] - least_m
    for hull, since in zip(history.scenario.hulls, history.obstacle_from, strict=True):
        raised_m = least_m * np.maximum(0.0, -hull.normals[:, 2])
        above_m = (hull.face_distances(at_m[since:]) - raised_m).max(axis=-1)
        room[since:] = np.minimum(room[since:], above_m)
    return room


def _outside(way_m: FloatArray, radius_m: float = 0.0, half_height_m: float = 0.0) -> FloatArray:
    """Distance from an upright cylinder: horizontally or vertically, whichever is larger."""
    level_m = np.linalg.norm(way_m[..., :2], axis=-1) - radius_m
    return np.maximum(level_m, np.abs(way_m[..., 2]) - half_height_m)


def _nearest(each_m: list[FloatArray], flies: NDArray[np.bool_]) -> Nearest:
    room = np.full(flies.shape, FAR_M)
    which = np.full(flies.shape, -1)
    for index, room_m in enumerate(each_m):
        nearer = flies & (room_m < room)
        room[nearer], which[nearer] = room_m[nearer], index
    return room, which

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
    scenario = history.scenario
    at_m, samples = flight.x[..., :3], np.arange(len(flight.x))[:, None]
    radii_m = np.array([uas.radius_m for uas in scenario.uas])
    flies = samples <= flight.last_sample
    flies &= (flight.mode < MODES.index("landed")) & ~flight.resting
    found: dict[str, Nearest] = {}

    def add(kind: str, each_m: list[FloatArray]) -> None:
        if each_m:
            found[kind] = _nearest(each_m, flies)

    add(
        OBSTACLES,
        [
            np.where(
                samples >= since,
                hull.signed_distance(at_m) - radii_m - obstacle.safe_distance_m,
                np.inf,
            )
            for obstacle, hull, since in zip(
                scenario.obstacles, scenario.hulls, history.obstacle_from, strict=True
            )
        ],
    )
    add(
        MOVING,
        [
            np.where(
                samples >= history.moving_from[m],
                _outside(
                    at_m - history.moving_position_m[:, None, m],
                    obstacle.radius_m,
                    obstacle.height_m / 2.0,
                )
                - radii_m
                - obstacle.safe_distance_m,
                np.inf,
            )
            for m, obstacle in enumerate(scenario.moving_obstacles)
        ],
    )
    if len(radii_m) > 1:
        add(
            OTHERS,
            [
                np.where(
                    flies[:, j, None] & (np.arange(len(radii_m)) != j),
                    _outside(at_m - at_m[:, j, None])
                    - radii_m
                    - radii_m[j]
                    - scenario.uas_safe_distance_m,
                    np.inf,
                )
                for j in range(len(radii_m))
            ],
        )
    add(FENCE, [-scenario.fence.signed_distance(at_m) - scenario.geofence.margin_m])
    if scenario.min_height_m > 0.0:
        away_m = np.linalg.norm(at_m[..., :2] - history.home_m[..., :2], axis=-1)
        low = np.where(away_m <= scenario.landing_zone_m, np.inf, _height_room(flight, history))
        add(HEIGHT, [low])
    return found


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

"""What waypoints ask of the UAS that passes them, in files: radius, speed and heights.

A leg that passes a waypoint which asks for a speed is flown so slowly from end to end. Whether that
suffices is read from the model of how an autopilot flies the file; where it does not, it stops at
the nearest corner instead of cutting it.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.operations.mission_export.tracks import Track
from uas_coverage_env.operations.path_geometry import cut_path, distances_m
from uas_coverage_env.planning.execution.leg_model import DT_S, Followed
from uas_coverage_env.scenario import Scenario

FloatArray = NDArray[np.float64]

SHARE = 0.95
"""Of the speed that is asked, what a file sets: a vehicle does not hold it to the last digit."""

_LEAST_MPS = 0.1
_LEAST_APART_M = 1.0
_ROUNDING = 1e-6
_BETWEEN_M = 0.05
"""What a straight line at full speed may be closer between two samples of the model."""


def most_mps(scenario: Scenario, track: Track) -> tuple[float, ...]:
    """How fast each leg may be flown horizontally [m/s]; infinite where nothing is asked.

    Args:
        scenario: The mission.
        track: The legs.
    """
    corners = track.corners_m
    most = np.full(len(track.legs), math.inf)
    for w in track.waypoints:
        waypoint = scenario.waypoints[w]
        if waypoint.max_speed_mps is not None:
            centre = np.array([waypoint.position_m])
            away_m = [float(distances_m(centre, a, b)[0]) for a, b in pairwise(corners)]
            n = int(np.argmin(away_m))
            most[n] = min(most[n], SHARE * waypoint.max_speed_mps)
    ways = np.diff(corners, axis=0)  # a file sets the level part of a speed
    level = np.linalg.norm(ways[:, :2], axis=1) / np.maximum(np.linalg.norm(ways, axis=1), 1e-9)
    return tuple(
        max(math.floor(10.0 * mps * share + _ROUNDING) / 10.0, _LEAST_MPS)
        if math.isfinite(mps)
        else math.inf
        for mps, share in zip(most.tolist(), level.tolist(), strict=True)
    )


def triggers_m(scenario: Scenario, track: Track, corner_m: float) -> tuple[float, ...]:
    """How far apart the pictures on each leg are [m]; 0 where no waypoint asks for a camera.

    On every leg that touches the sphere of such a waypoint they are no farther apart than the path,
    corners cut, is long within it: one at least is taken where the waypoint counts as covered.

    Args:
        scenario: The mission.
        track: The legs.
        corner_m: How far from a corner an autopilot may pass [m].
    """
    carried = scenario.uas[track.uas].sensors
    cameras = {sensor.name for sensor in carried if sensor.field_of_view_deg is not None}
    path = cut_path(track.corners_m, [leg.stop for leg in track.legs], corner_m)
    apart_m = np.full(len(track.legs), math.inf)
    for w in track.waypoints:
        waypoint = scenario.waypoints[w]
        if waypoint.sensor in cameras:
            centre = np.array([waypoint.position_m])
            corners = pairwise(track.corners_m)
            away_m = np.array([distances_m(centre, a, b)[0] for a, b in corners])
            touched = away_m <= max(waypoint.radius_m, float(away_m.min()))
            inside_m = _length_within_m(path, centre[0], waypoint.radius_m)
            apart_m[touched] = np.minimum(apart_m[touched], inside_m)
    return tuple(
        max(math.floor(10.0 * each) / 10.0, _LEAST_APART_M) if math.isfinite(each) else 0.0
        for each in apart_m.tolist()
    )


def _length_within_m(path: FloatArray, centre: FloatArray, radius_m: float) -> float:
    """How long a path of straight pieces is within a sphere."""
    ways = np.diff(path, axis=0)
    lengths = np.linalg.norm(ways, axis=1)
    to_centre = centre - path[:-1]
    along = (to_centre * ways).sum(axis=1) / np.maximum(lengths, 1e-9)
    aside_2 = (to_centre**2).sum(axis=1) - along**2
    half = np.sqrt(np.maximum(radius_m**2 - aside_2, 0.0))
    ends = (np.clip(along + side * half, 0.0, lengths) for side in (-1.0, 1.0))
    enters, leaves = ends
    return float((leaves - enters).sum())


def not_as_asked(scenario: Scenario, track: Track, followed: Followed) -> list[int]:
    """The waypoints that a file passes nowhere within radius, speed and heights that they ask for.

    Args:
        scenario: The mission.
        track: The legs.
        followed: How an autopilot flies them.
    """
    places = followed.places_m[1:]
    speed_mps = np.linalg.norm(np.diff(followed.places_m, axis=0), axis=1) / DT_S
    found = []
    for w in track.waypoints:
        waypoint = scenario.waypoints[w]
        low_m, high_m = waypoint.heights_m or (-math.inf, math.inf)
        most = math.inf if waypoint.max_speed_mps is None else waypoint.max_speed_mps
        away_m = np.linalg.norm(places - np.array(waypoint.position_m), axis=1)
        fits = (away_m <= waypoint.radius_m + _BETWEEN_M) & (speed_mps <= most + _ROUNDING)
        fits &= (low_m <= -places[:, 2]) & (-places[:, 2] <= high_m)
        if not fits.any():
            found.append(w)
    return found


def stopping(
    scenario: Scenario, track: Track, corner_m: float, fly: Callable[[Track], Followed]
) -> Track:
    """The track with stops at corners where waypoints would not be passed as they ask.

    Args:
        scenario: The mission.
        track: The legs.
        corner_m: How far from a corner an autopilot may pass [m].
        fly: How an autopilot flies a track.
    """
    missed = not_as_asked(scenario, track, fly(track))
    corners, legs = track.corners_m, list(track.legs)
    for w in missed if len(legs) > 1 else ():
        away_m = np.linalg.norm(corners[1:-1] - np.array(scenario.waypoints[w].position_m), axis=1)
        n = int(away_m.argmin())
        legs[n] = replace(legs[n], stop=True)
    path = cut_path(corners, [leg.stop for leg in legs], corner_m)
    centres = np.array([scenario.waypoints[w].position_m for w in track.waypoints]).reshape(-1, 3)
    passed_m = np.min([distances_m(centres, a, b) for a, b in pairwise(path)], axis=0)
    return replace(track, legs=tuple(legs), passed_m=passed_m) if missed else track

"""Height layers: legs of a UAS raised or lowered until others pass below or above.

Waits keep UAS apart in time; where they would be long, or none helps, one of the UAS flies at
another height: as a whole, as far as its waypoints are still covered from there, or to its first
waypoint and home from its last, above all others. What is changed is checked like any track.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight import Flight
from uas_coverage_env.operations.mission_export.lay_tracks import relaid
from uas_coverage_env.operations.mission_export.tracks import Tolerances, Track
from uas_coverage_env.operations.path_geometry import distances_m
from uas_coverage_env.planning.execution.lateness import kept_m
from uas_coverage_env.planning.execution.separation import Waits

FloatArray = NDArray[np.float64]

LONG_WAITS_S = 45
"""Of all UAS together; longer ones are worth a layer [s]."""

_WORTH_S = 10.0
_APART_M = 1.5
"""Beyond what UAS keep from each other: the leg model is in steps."""

_LAYERS = 3

_MOST_FILES = 6
"""Of more, each tried with all others, the search would take minutes."""


class Schedule(NamedTuple):
    """Tracks with the waits that keep them apart.

    Attributes:
        tracks: One for each UAS that flies.
        waits: Likewise; None where none are found.
        home_s: When all are home; infinite without waits [s].
    """

    tracks: list[Track]
    waits: list[Waits] | None
    home_s: float

    @property
    def waited_s(self) -> float:
        """Of all UAS together; infinite without waits [s]."""
        if self.waits is None:
            return math.inf
        return float(sum(one.start_s + one.hold_s for one in self.waits))


def in_layers(
    flight: Flight, apart: Schedule, tolerances: Tolerances, settle: Callable[..., Schedule]
) -> Schedule:
    """Tracks in layers where their waits are long, else as they are.

    Args:
        flight: The flight.
        apart: Without layers.
        tolerances: How far legs may be from the flight.
        settle: Waits for tracks.
    """
    best = apart
    if len(apart.tracks) > _MOST_FILES:
        return best
    for _ in apart.tracks:
        if best.waited_s <= LONG_WAITS_S:
            break
        found = [
            settle([*best.tracks[:n], other, *best.tracks[n + 1 :]])
            for n, track in enumerate(best.tracks)
            if not track.layer
            for other in _others(flight, best.tracks, track, tolerances)
        ]
        better = min(found, key=lambda one: (one.home_s, one.waited_s), default=best)
        if better.home_s > best.home_s - _WORTH_S:
            break
        best = better
    return best


def _others(
    flight: Flight, tracks: Sequence[Track], track: Track, tolerances: Tolerances
) -> Iterator[Track]:
    """A track at other heights."""
    scenario = flight.scenario
    others = [other.uas for other in tracks if other.uas != track.uas]
    gap_m = max((kept_m(scenario, track.uas, u) for u in others), default=0.0) + _APART_M
    if not any(scenario.waypoints[w].heights_m for w in track.waypoints):
        for up_m in (gap_m, -gap_m):
            new = shifted(flight, track, up_m, tolerances)
            if new is not None:
                yield new
    top_m = max(-float(other.corners_m[:, 2].min()) for other in tracks)
    for layer in range(_LAYERS):
        new = above(flight, track, top_m + layer * gap_m, tolerances)
        if new is not None:
            yield new


def shifted(flight: Flight, track: Track, up_m: float, tolerances: Tolerances) -> Track | None:
    """A track with all corners but the first and the last higher; None where that cannot be.

    Args:
        flight: The flight.
        track: The track.
        up_m: By how much; negative: lower [m].
        tolerances: How far legs may be from the flight.
    """
    corners = track.corners_m
    if len(corners) < 4:
        return None
    corners[1:-1, 2] -= up_m
    side = "higher" if up_m > 0.0 else "lower"
    said = f"flies {abs(up_m):.1f} m {side} than planned, to be out of the way"
    legs = list(range(len(track.legs)))
    return relaid(flight, track, corners, legs, tolerances, said)


def above(flight: Flight, track: Track, height_m: float, tolerances: Tolerances) -> Track | None:
    """A track that is level to its first waypoint and home from its last; None where it cannot be.

    Args:
        flight: The flight.
        track: The track.
        height_m: Of the level legs above the ground [m].
        tolerances: How far legs may be from the flight.
    """
    corners = track.corners_m
    legs = _covering_legs(flight, track)
    if not legs:
        return None
    n, first, last = len(track.legs), min(legs) + 1, max(legs) + 1
    level = corners * (1.0, 1.0, 0.0) - (0.0, 0.0, height_m)
    points = [corners[0], *level[: first + 1], *corners[first : last + 1]]
    of = [0, *range(first), first - 1, *range(first, last)]
    if last < n:  # else it covers on its way home
        points += [*level[last:], corners[n]]
        of += [last - 1, *range(last, n), n - 1]
    said = f"flies to its waypoints and home {height_m:.0f} m high, above the others"
    return relaid(flight, track, np.array(points), of, tolerances, said)


def _covering_legs(flight: Flight, track: Track) -> list[int]:
    """For each waypoint, the first leg that passes it."""
    corners, found = track.corners_m, []
    for w, away_m in zip(track.waypoints, track.passed_m.tolist(), strict=True):
        waypoint = flight.scenario.waypoints[w]
        within_m = max(waypoint.radius_m, away_m) + 1e-9
        centre = np.array([waypoint.position_m])
        near = [distances_m(centre, a, b)[0] <= within_m for a, b in pairwise(corners)]
        found.append(near.index(True) if True in near else len(near) - 1)
    return found

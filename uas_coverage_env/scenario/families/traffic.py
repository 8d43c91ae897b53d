"""Traffic: two to four moving obstacles fly to and fro at the height of the waypoints."""

import numpy as np

from uas_coverage_env.scenario.families.family import Family
from uas_coverage_env.scenario.families.site import Rng, Size, Square, Wanted, tag
from uas_coverage_env.scenario.fields import MovingObstacle, ScheduledVelocity
from uas_coverage_env.scenario.model import Scenario

_MOST_MOVING = 4
_PITCH_M = 56.0
_RADIUS_M, _HEIGHT_M, _SAFE_DISTANCE_M = 6.0, 16.0, 4.0
_ALTITUDE_M = 14.0
_SPEED_MPS, _REST_S = (3.0, 7.0), 10.0
_FROM_STARTS_M, _FROM_FENCE_M = 25.0, 15.0
_LASTS_S = 6000.0


def traffic(rng: Rng, size: Size) -> Scenario:
    """Two to four of them fly to and fro over rows and columns of waypoints."""
    n_uas, n_waypoints = size.draw(rng)
    square = Square.at_pitch(n_uas, n_waypoints, _PITCH_M)
    side_m, west_m = square
    span_north = _FROM_FENCE_M, side_m - _FROM_FENCE_M
    span_east = west_m + _FROM_STARTS_M, west_m + side_m - _FROM_FENCE_M
    moving = []
    for k in range(int(rng.integers(2, _MOST_MOVING + 1))):
        along_north = k % 2 == 0
        span, across = (span_north, span_east) if along_north else (span_east, span_north)
        moving.append(_shuttle(rng, f"helicopter_{k + 1}", along_north, span, across))
    wanted = [Wanted(place, _ALTITUDE_M) for place in square.spread_places(rng, n_waypoints)]
    return square.site(moving=moving).scenario(rng, f"traffic-{tag(rng)}", n_uas, wanted, size)


FAMILIES = {"traffic": Family(traffic, n_moving=_MOST_MOVING)}


def _shuttle(
    rng: Rng,
    name: str,
    along_north: bool,
    span_m: tuple[float, float],
    across_m: tuple[float, float],
) -> MovingObstacle:
    """Flies from one end of its line to the other, rests and flies back."""
    speed_mps = float(rng.uniform(*_SPEED_MPS))
    line_m = float(rng.uniform(*across_m))
    flies_s = (span_m[1] - span_m[0]) / speed_mps
    first = 1.0 if rng.uniform() < 0.5 else -1.0
    pieces = []
    for k, at_s in enumerate(np.arange(0.0, _LASTS_S, flies_s + _REST_S).tolist()):
        mps = first * (-1.0) ** k * speed_mps
        moves = (mps, 0.0, 0.0) if along_north else (0.0, mps, 0.0)
        pieces.append(ScheduledVelocity(from_s=at_s, velocity_mps=moves))
        pieces.append(ScheduledVelocity(from_s=at_s + flies_s, velocity_mps=(0.0, 0.0, 0.0)))
    begins_m = span_m[0] if first > 0.0 else span_m[1]
    place_m = (begins_m, line_m) if along_north else (line_m, begins_m)
    return MovingObstacle(
        name=name,
        kind="helicopter",
        radius_m=_RADIUS_M,
        height_m=_HEIGHT_M,
        safe_distance_m=_SAFE_DISTANCE_M,
        start_m=(round(place_m[0], 1), round(place_m[1], 1), -_ALTITUDE_M),
        schedule=tuple(pieces),
    )

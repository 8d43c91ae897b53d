"""The clock by which routes are built: estimated leg times, turns and ways home."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import allocating_kernel

DONE, IN_THE_AIR = -2, -1
"""Places: of a UAS that flies home and no more, and of one that is at no waypoint."""

_TURN = np.interp(
    np.degrees(np.arccos(np.linspace(-1.0, 1.0, 257))),
    [0.0, 45.0, 90.0, 135.0, 180.0],
    [0.0, -0.3, -0.45, 0.1, 1.5],
)
"""What turning costs in times to fly a radius, over the cosine; see `routing.search`."""


class Mission(NamedTuple):
    """What the routes are built from, as arrays.

    Attributes:
        place_m: (W, 2) waypoints, north and east.
        radius_s: (W,) time that a radius is worth.
        between_s: (W, W) leg times.
        home_s: (U, W) leg times home, with landing.
        start_m: (U, 2).
        here_m: (U, 2) where each UAS is.
        velocity: (U, 2) horizontal, over the top speed.
        from_s: (U, W) leg times from there.
        here_home_s: (U,) leg times home from there.
        budget_s: (U,) flying time left.
        may: (U,) takes part.
        late: (W,) waypoints that are to come last.
        unit_s: Mean leg time from a waypoint to its nearest neighbour.
        weight: Worth of a second of any flight against one of the longest.
    """

    place_m: NDArray[np.float64]
    radius_s: NDArray[np.float64]
    between_s: NDArray[np.float64]
    home_s: NDArray[np.float64]
    start_m: NDArray[np.float64]
    here_m: NDArray[np.float64]
    velocity: NDArray[np.float64]
    from_s: NDArray[np.float64]
    here_home_s: NDArray[np.float64]
    budget_s: NDArray[np.float64]
    may: NDArray[np.bool_]
    late: NDArray[np.bool_]
    unit_s: float
    weight: float


@allocating_kernel
def _turn_s(mission, bx, by, at, cx, cy):
    """Cost [s] of turning at waypoint `at` on the way from b to c."""
    ax, ay = mission.place_m[at, 0] - bx, mission.place_m[at, 1] - by
    dx, dy = cx - mission.place_m[at, 0], cy - mission.place_m[at, 1]
    length = math.sqrt((ax * ax + ay * ay) * (dx * dx + dy * dy))
    if length < 1e-9:
        return 0.0
    cosine = min(max((ax * dx + ay * dy) / length, -1.0), 1.0)
    return mission.radius_s[at] * _TURN[int(128.0 * (cosine + 1.0) + 0.5)]


@allocating_kernel
def leg_seconds(mission, u, place, before_m, w):
    """Time [s] of UAS u from its place to waypoint w, the turn at the place included."""
    if place == IN_THE_AIR:
        return mission.from_s[u, w]
    turn_s = _turn_s(
        mission, before_m[0], before_m[1], place, mission.place_m[w, 0], mission.place_m[w, 1]
    )
    return max(mission.between_s[place, w] + turn_s, 0.1)


@allocating_kernel
def home_seconds(mission, u, place, before_m):
    """Time [s] of UAS u from its place home."""
    if place == IN_THE_AIR:
        return mission.here_home_s[u]
    turn_s = _turn_s(
        mission, before_m[0], before_m[1], place, mission.start_m[u, 0], mission.start_m[u, 1]
    )
    return mission.home_s[u, place] + turn_s

"""Where to aim next on the way to a waypoint or home, past the fixed obstacles."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.commands import HOME
from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.vehicle.range import ROUTED, flight_seconds, speeds_of
from uas_coverage_env.world import build_arena
from uas_coverage_env.world.routes import CLEAR, ROUND_CORNER, crossing, route

FloatArray = NDArray[np.float64]

SHADED_S = 2.0
"""An obstacle shades a target where the way past it takes this much longer than the straight
one [s]; a planner with a horizon sees its way past the others by itself."""

_IN_SIGHT_S = 0.2
"""It does so no more once it takes less than this longer, and the target is in sight: were it
released at a corner, it would be drawn back along the wall on the wrong side [s]."""

_AT_CORNER_M = 5.0
_AHEAD_S = 2.0
"""A corner is reached at a distance of so many metres at scale 1, or seconds of flight."""

_TIGHT_M = 12.0
"""A corner with two obstacles nearer than this, at scale 1, is at a gap: not to be passed at full
speed [m]."""

_CORNERS = 8
"""Of a way, at most, that lie so near to each other."""

_PAST_M = 0.01

_HEADROOM_M = 0.5  # at scale 1


class Way(NamedTuple):
    """A way past the fixed obstacles.

    Attributes:
        seconds: Time that it takes, as `Legs` has it [s].
        shaded: Whether an obstacle shades the target.
        aim_m: (3,) where to fly next, NED: the target itself, unless it is shaded [m].
        onward_s: Time from there to the target [s].
        onward_m: Horizontal length of the way from there to the target [m].
        tight: Whether it leads through a narrow gap, before which one has to slow down.
    """

    seconds: float
    shaded: bool
    aim_m: FloatArray
    onward_s: float
    onward_m: float
    tight: bool = False


class _Leg(NamedTuple):
    seconds: float
    lost_s: float
    way_m: float
    end_m: FloatArray
    at_corner: bool


class Ways:
    """The ways of a mission: along the corners at which the world's routes turn, or over roofs.

    Of each UAS and target it remembers whether `to` led it past an obstacle the last time.

    Args:
        brief: The mission.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._arena = build_arena(brief.as_scenario())
        self._scale = float(self._arena.rules["length_scale"][0])
        self._speeds = [speeds_of(vehicle) for vehicle in brief.vehicles]
        nodes_m = np.pad(self._arena.nodes_m, ((0, 0), (0, 1)))
        near = np.zeros(len(nodes_m), np.int64)
        for hull in brief.hulls:
            nodes_m[:, 2] = hull.vertices_m[:, 2].mean()
            near += hull.signed_distance(nodes_m) < self._scale * _TIGHT_M
        self._tight = {tuple(node) for node in self._arena.nodes_m[near > 1].tolist()}
        self._waypoints_m = np.array([w.position_m for w in brief.waypoints], float)
        self._led: set[tuple[int, int]] = set()
        self._homes_m = np.array([uas.home_m for uas in brief.uas], float)
        for obstacle in self._arena.obstacles[:1]:
            # compiled now, not in the decision that first looks over a roof
            self._over(obstacle["lower_m"].copy(), obstacle["upper_m"].copy())

    def seconds(self, uas: int, target: int, position_m: FloatArray) -> float:
        """Time from a position to a target; the arguments are those of `to`."""
        row, target_m = self._target(uas, target)
        return self._leg(uas, row, np.asarray(position_m, float), target_m).seconds

    def to(self, uas: int, target: int, position_m: FloatArray, speed_mps: float = 0.0) -> Way:
        """The way of a UAS to a waypoint, or home.

        Args:
            uas: Index of the UAS.
            target: Index of a waypoint, or `world.HOME`.
            position_m: (3,) where it is [m].
            speed_mps: How fast it is: the faster, the earlier it looks past a corner.
        """
        row, target_m = self._target(uas, target)
        place_m = here_m = np.asarray(position_m, float)
        first = leg = self._leg(uas, row, here_m, target_m)
        led = (uas, row) in self._led
        for _ in range(_CORNERS):
            if leg.lost_s <= (_IN_SIGHT_S if led else SHADED_S) and not (led and leg.at_corner):
                if leg is first:
                    self._led.discard((uas, row))
                return Way(first.seconds, False, target_m, 0.0, 0.0)
            tight = tuple(leg.end_m[:2].tolist()) in self._tight
            near_m = self._scale * _AT_CORNER_M
            if not tight:
                near_m = max(near_m, _AHEAD_S * speed_mps)
            if not leg.at_corner or _level_m(leg.end_m - here_m) > near_m:
                break
            # from a corner itself the next one is the same
            away_m = target_m - leg.end_m
            past_m = leg.end_m + away_m * (_PAST_M / max(_level_m(away_m), _PAST_M))
            following = self._leg(uas, row, past_m, target_m)
            if following.at_corner and _level_m(following.end_m - leg.end_m) < _PAST_M:
                break
            place_m, leg = leg.end_m, following
        self._led.add((uas, row))
        onward_m = max(leg.way_m - _level_m(leg.end_m - place_m), 0.0)
        down_m = float(target_m[2] - leg.end_m[2])
        onward_s = self._seconds(uas, onward_m, max(-down_m, 0.0), max(down_m, 0.0))
        tight = tuple(leg.end_m[:2].tolist()) in self._tight
        return Way(first.seconds, True, leg.end_m, onward_s, onward_m, tight)

    def _target(self, uas: int, target: int) -> tuple[int, FloatArray]:
        if target == HOME:
            return len(self._waypoints_m) + uas, self._homes_m[uas]
        return target, self._waypoints_m[target]

    def _leg(self, uas: int, row: int, here_m: FloatArray, target_m: FloatArray) -> _Leg:
        """The next leg, and how long the whole way takes."""
        north_m, east_m, way_m, kind = route(self._arena, row, *here_m, *target_m)
        straight_m = _level_m(target_m - here_m)
        down_m = float(target_m[2] - here_m[2])
        up_m, down_m = max(-down_m, 0.0), max(down_m, 0.0)
        straight_s = self._seconds(uas, straight_m, up_m, down_m)
        end_m, at_corner = target_m, kind == ROUND_CORNER
        if at_corner:
            share = _level_m(np.array([north_m, east_m]) - here_m[:2]) / max(way_m, 1e-9)
            end_m = np.array([north_m, east_m, here_m[2] + share * (target_m[2] - here_m[2])])
        elif kind != CLEAR:
            top_m, end_m = self._over(here_m, target_m)
            up_m = max(up_m, here_m[2] - top_m)
            down_m = max(down_m, target_m[2] - top_m)
        seconds = straight_s if kind == CLEAR else self._seconds(uas, way_m, up_m, down_m)
        return _Leg(seconds, seconds - straight_s, way_m, end_m, at_corner)

    def _over(self, here_m: FloatArray, target_m: FloatArray) -> tuple[float, FloatArray]:
        """Down of the highest roof on a straight leg [m], and the place above where it begins."""
        arena = self._arena
        low_m, high_m = np.minimum(here_m, target_m), np.maximum(here_m, target_m)
        met = (arena.obstacles["lower_m"][:, :2] <= high_m[:2]).all(axis=1)
        met &= (arena.obstacles["upper_m"][:, :2] >= low_m[:2]).all(axis=1)
        top_m, begins = low_m[2], 1.0
        for o in np.flatnonzero(met):
            obstacle = arena.obstacles[o]
            at, _, _ = crossing(
                obstacle, arena.normals, arena.offsets_m, *here_m[:2], *target_m[:2]
            )
            if at <= 1.0 and -obstacle["roof_m"] < top_m:
                top_m, begins = -float(obstacle["roof_m"]), at
        if begins == 1.0:
            return float(top_m), target_m
        level_m = here_m[:2] + begins * (target_m[:2] - here_m[:2])
        return top_m, np.array([*level_m, top_m - self._scale * _HEADROOM_M])

    def _seconds(self, uas: int, way_m: float, up_m: float, down_m: float) -> float:
        return float(flight_seconds(ROUTED, self._speeds[uas], 0.0, way_m, up_m, down_m))


def _level_m(away_m: FloatArray) -> float:
    return math.hypot(away_m[0], away_m[1])

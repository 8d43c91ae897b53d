"""The legs of one UAS along its route: few, long and straight, clear of what is fixed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.geometry.nearest import nearest_on_segment
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.execution.leg_model import Autopilot, Followed, follow
from uas_coverage_env.planning.execution.separation import Waits
from uas_coverage_env.planning.routing.terrain import Terrain
from uas_coverage_env.scenario import Execution
from uas_coverage_env.world.routes import CLEAR, crossing, route

FloatArray = NDArray[np.float64]

_LIFT_M = 3.5
"""Height at which a take-off ends and a landing begins: above that of exports."""

_ABOVE_FLOOR_M = 1.0
_ABOVE_OTHERS_M = 1.5
"""Above what UAS keep from each other: legs begin so high that none waits below another's."""

_HEADROOM_M = 0.5
_TRACKING_M = 1.0
"""How far a flight may be from its legs, taken off the radius of waypoints that legs pass."""

_SAMPLED_OFF_M = 0.3
"""Farther from a waypoint than its leg, most of the time."""

_MOST_PASSED = 60
_SAME_M = 0.1
_STOP_S = 1.0


@dataclass(frozen=True, eq=False)
class Corners:
    """Legs of one UAS.

    Attributes:
        route: Waypoints that they cover.
        places_m: (C, 3) from above the start, or where it is, to above its start again [m].
        speeds_mps: (C - 1,) of each leg.
        leg_of: For each waypoint, the leg at whose end it has been passed.
    """

    route: tuple[int, ...]
    places_m: FloatArray
    speeds_mps: tuple[float, ...]
    leg_of: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Course:
    """Legs as they are flown in time.

    Attributes:
        route: Waypoints that they cover.
        followed: Where it is, and when.
        lands_s: When it begins to land [s].
        covered_s: When the last waypoint has been passed [s].
    """

    route: tuple[int, ...]
    followed: Followed
    lands_s: float
    covered_s: float


class CoursePlanner:
    """Lays legs along routes.

    Args:
        brief: A mission that an autopilot flies.
    """

    def __init__(self, brief: MissionBrief) -> None:
        assert brief.execution is not None
        self._execution: Execution = brief.execution
        self._brief, self.terrain = brief, Terrain(brief)
        self._waypoints_m = self.terrain.legs.waypoints_m
        floor_m = max(float(self.terrain.arena.rules[0].floor_m), brief.min_height_m)
        self._lift_m = max(_LIFT_M, floor_m + _ABOVE_FLOOR_M)
        if len(brief.uas) > 1:
            apart_m = 2.0 * max(uas.radius_m for uas in brief.uas) + brief.uas_safe_distance_m
            highest_m = max(max(-uas.start_m[2], -uas.home_m[2]) for uas in brief.uas)
            self._lift_m = max(self._lift_m, highest_m + apart_m + _ABOVE_OTHERS_M)
        spent_m = self._execution.tolerance_m + _TRACKING_M
        self._radius_m = np.array([w.radius_m for w in brief.waypoints])
        self._passed_m = np.array([w.radius_m - spent_m for w in brief.waypoints])
        anything = (-np.inf, np.inf)
        self._heights_m = np.array([w.heights_m or anything for w in brief.waypoints], float)
        fastest = [v.limits.v_xy_max_mps for v in brief.vehicles]
        self._fastest_mps = np.array(fastest)
        self._asked_mps = np.array([w.max_speed_mps or np.inf for w in brief.waypoints])

    def corners(
        self, uas: int, waypoints: Sequence[int], from_m: FloatArray | None = None
    ) -> Corners:
        """Legs along a route and home.

        Args:
            uas: Index of the UAS.
            waypoints: In the order of their visit.
            from_m: (3,) where it is; None: at its start, from which it takes off [m].
        """
        own = self._brief.uas[uas]
        places = [self._above_m(own.start_m) if from_m is None else np.asarray(from_m, float)]
        speeds: list[float] = []
        leg_of: list[int] = []
        k = 0
        while k < len(waypoints):
            n = self._passed(places[-1], waypoints[k:])
            run = waypoints[k : k + n]
            speed = min(self._fastest_mps[uas], 0.9 * self._asked_mps[list(run)].min())
            speed = min(speed, self._sampled_mps(places[-1], run))
            self._fly_to(run[-1], self._waypoints_m[run[-1]], places, speeds, speed)
            leg_of += [len(speeds) - 1] * n
            k += n
        row = len(self._waypoints_m) + uas
        self._fly_to(row, self._above_m(own.home_m), places, speeds, self._fastest_mps[uas])
        return Corners(tuple(waypoints), np.array(places), tuple(speeds), tuple(leg_of))

    def _above_m(self, place_m: Sequence[float]) -> FloatArray:
        """(3,) where legs begin above a start, or end above a home."""
        return np.array([*place_m[:2], -max(self._lift_m, -place_m[2])])

    def course(
        self, uas: int, corners: Corners, waits: Waits | None = None, *, takes_off: bool = True
    ) -> Course:
        """Legs as an autopilot flies them.

        Args:
            uas: Index of the UAS.
            corners: Its legs.
            waits: Where it waits for others.
            takes_off: Whether it is on the ground; if not, it is at the first corner.
        """
        followed = self.follow(uas, corners, waits or Waits(), takes_off=takes_off)
        last_s = followed.corner_s[[leg + 1 for leg in corners.leg_of]].max(initial=0.0)
        return Course(corners.route, followed, float(followed.corner_s[-1]), float(last_s))

    def follow(
        self, uas: int, corners: Corners, waits: Waits, *, takes_off: bool = True
    ) -> Followed:
        """Where an autopilot is, and when; the arguments are those of `course`."""
        holds_s = [0.0] * len(corners.speeds_mps)
        if waits.leg is not None:
            holds_s[waits.leg] = _STOP_S + waits.hold_s
        by = Autopilot.of(self._brief.vehicles[uas], self._execution.corner_m)
        speeds, start_s = corners.speeds_mps, waits.start_s
        return follow(corners.places_m, speeds, holds_s, by, start_s, takes_off=takes_off)

    def _passed(self, here_m: FloatArray, waypoints: Sequence[int]) -> int:
        """How many waypoints one straight leg can pass, the last one at its end."""
        most = 1
        for n in range(2, min(len(waypoints), _MOST_PASSED) + 1):
            end_m = self._waypoints_m[waypoints[n - 1]]
            between = list(waypoints[: n - 1])
            if not self._passes(here_m, end_m, between):
                break
            if self._is_clear(waypoints[n - 1], here_m, end_m):
                most = n
        return most

    def _passes(self, a: FloatArray, b: FloatArray, between: list[int]) -> bool:
        away_m, share, nearest_m = nearest_on_segment(self._waypoints_m[between], a, b)
        low_m, high_m = self._heights_m[between].T
        asked = (-nearest_m[:, 2] >= low_m) & (-nearest_m[:, 2] <= high_m)
        in_turn = bool((np.diff(share) >= 0.0).all())
        near = away_m <= np.maximum(self._passed_m[between], _SAME_M)
        return bool(in_turn and near.all() and asked.all())

    def _sampled_mps(self, here_m: FloatArray, run: Sequence[int]) -> float:
        """How fast a leg may be without flying through a sphere between two samples [m/s]."""
        between = list(run[:-1])
        if not between:
            return math.inf
        end_m = self._waypoints_m[run[-1]]
        away_m = nearest_on_segment(self._waypoints_m[between], here_m, end_m).distance_m
        off_m = away_m + _SAMPLED_OFF_M
        chord_m = 2.0 * np.sqrt(np.maximum(self._radius_m[between] ** 2 - off_m**2, _SAME_M))
        return float(chord_m.min()) / self._brief.dt_s

    def _is_clear(self, row: int, a: FloatArray, b: FloatArray) -> bool:
        _, _, _, leg = route(self.terrain.arena, row, *a, *b)
        return leg == CLEAR

    def _fly_to(
        self,
        row: int,
        end_m: FloatArray,
        places: list[FloatArray],
        speeds: list[float],
        speed_mps: float,
    ) -> None:
        """Append the legs to a place, past what is in the way."""
        if np.linalg.norm(end_m - places[-1]) <= _SAME_M:
            end_m = places[-1] + (0.0, 0.0, -2.0 * _SAME_M)  # a leg of its own, however short
        ways = [self._over(row, way) for way in self.terrain.ways(row, places[-1], end_m)]
        way = min(ways, key=lambda w: np.linalg.norm(np.diff(w, axis=0), axis=1).sum())
        places += list(way[1:])
        speeds += [speed_mps] * (len(way) - 1)

    def _over(self, row: int, way_m: FloatArray) -> FloatArray:
        """A way, raised where it leads over roofs."""
        points = [way_m[0]]
        for a, b in pairwise(way_m):
            if not self._is_clear(row, a, b):
                top_m = min(self._top_m(a, b), a[2], b[2])
                up = [np.array([*place[:2], top_m]) for place in (a, b)]
                points += [place for place in up if np.linalg.norm(place - points[-1]) > _SAME_M]
            if np.linalg.norm(b - points[-1]) > _SAME_M:
                points.append(b)
        return np.array(points)

    def _top_m(self, a: FloatArray, b: FloatArray) -> float:
        """Down of a level line that is clear of all that a line crosses and can be flown over."""
        arena = self.terrain.arena
        top_m = min(a[2], b[2])
        for obstacle in arena.obstacles:
            at, _, _ = crossing(obstacle, arena.normals, arena.offsets_m, *a[:2], *b[:2])
            if at <= 1.0 and not obstacle["tall"]:
                top_m = min(top_m, -float(obstacle["roof_m"]) - _HEADROOM_M)
        return float(top_m)

"""Finds the corners of a sortie: legs as long as room, tolerance and waypoints allow."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.take_offs import Sortie
from uas_coverage_env.operations.clearance import Surroundings
from uas_coverage_env.operations.mission_export.tracks import FloatArray, Leg, Tolerances
from uas_coverage_env.operations.path_geometry import (
    cut_corner,
    cut_path,
    distances_m,
    leg_distances_m,
)

SPENT_M = 1.0
"""Of a safe distance, what a leg may use: the rest is the autopilot's."""

_PATIENCE = 6
_CUTS = (0.25, 0.5, 1.0)
_CUT_SEEN = 5.0
_SHORTEST_M, _PARALLEL = 0.5, 0.01


class LegBuilder:
    """Finds the legs of one sortie; samples are counted from its first one."""

    def __init__(
        self,
        flight: Flight,
        uas: int,
        sortie: Sortie,
        covered: Mapping[int, int],
        tolerances: Tolerances,
    ) -> None:
        path = flight.x[sortie.first : sortie.landed, uas, 0:3]
        self.path, self.tolerances, self.dt_s = path, tolerances, flight.scenario.dt_s
        self.around = Surroundings(flight.scenario, uas)
        self._rests_between = flight.scenario.execution is not None
        self.steps = [self.around.room(a, b) for a, b in pairwise(path)]
        self.waypoints = list(covered)
        self._centres = np.array([w.position_m for w in flight.scenario.waypoints])
        self._radii = np.array([w.radius_m for w in flight.scenario.waypoints])
        self._covered: dict[int, list[int]] = {}
        for w, sample in covered.items():
            self._covered.setdefault(sample, []).append(w)

    def corners(
        self, first: int, last: int, take_off_m: FloatArray, above_m: FloatArray
    ) -> list[tuple[FloatArray, int]]:
        """Corners from above the take-off place to above that of landing, each with its sample."""
        points = [(take_off_m, first), (self.path[first], first), *self.legs(first, last)]
        if self._rests_between:
            points = self.sharpened(points)
        if np.linalg.norm(points[0][0] - points[1][0]) <= 0.1:
            del points[1]
        if len(points) == 1 or np.linalg.norm(points[-1][0] - above_m) > 0.1:
            points.append((above_m, last))
        return points

    def legs(self, first: int, last: int) -> list[tuple[FloatArray, int]]:
        """Ends of legs from one sample to another, each with its sample."""
        ends = []
        k = first
        while k < last:
            best = k + 1
            for j in range(k + 2, last + 1):
                if self._fits(k, j):
                    best = j
                elif j > best + _PATIENCE:  # a leg may not fit for a moment, and fit again
                    break
            ends.append((self.path[best], best))
            k = best
        return ends

    def _fits(self, k: int, j: int) -> bool:
        a, b = self.path[k], self.path[j]
        if distances_m(self.path[k : j + 1], a, b).max() > self.tolerances.path_m:
            return False
        for sample in range(k + 1, j + 1):
            for w in self._covered.get(sample, ()):
                away_m = distances_m(self._centres[[w]], a, b)[0]
                wanted_m = self._radii[w] - self.tolerances.path_m
                if away_m > max(wanted_m, np.linalg.norm(self.path[sample] - self._centres[w])):
                    return False
        flown = self.steps[k]
        for step in self.steps[k + 1 : j]:
            flown = flown.least(step)
        room = self.around.room(a, b)
        spent_m = min(SPENT_M, self.tolerances.path_m)
        enough = room.spare_m >= min(-spent_m, flown.spare_m)
        return enough and room.contact_m > 0.0

    def sharpened(self, points: list[tuple[FloatArray, int]]) -> list[tuple[FloatArray, int]]:
        """Corners as they were before they were flown: one for two at which a corner was cut."""
        result = points[:1]
        k = 1
        while k < len(points):
            corner = None
            if k + 2 < len(points):
                corner = self._met(result[-1], points[k], points[k + 1], points[k + 2])
            result.append(points[k] if corner is None else corner)
            k += 1 if corner is None else 2
        return result

    def _met(self, *points: tuple[FloatArray, int]) -> tuple[FloatArray, int] | None:
        """Where the first of three legs and the last one meet, if they may stand for all."""
        (a, i), (b, _), (c, _), (d, j) = points
        short_m = 3.0 * _CUT_SEEN * self.tolerances.corner_m
        if np.linalg.norm(c - b) > short_m:
            return None
        legs = b - a, c - d
        lengths = [float(np.linalg.norm(leg)) for leg in legs]
        if min(lengths) < _SHORTEST_M:
            return None
        u, v = (leg / length for leg, length in zip(legs, lengths, strict=True))
        across = 1.0 - float(u @ v) ** 2
        if across < _PARALLEL:
            return None
        ahead = float((d - a) @ (u - (u @ v) * v)) / across
        back = float((a - d) @ (v - (u @ v) * u)) / across
        p, q = a + ahead * u, d + back * v
        if np.linalg.norm(p - q) > 0.5 * self.tolerances.path_m:
            return None
        past_m = ahead - lengths[0], back - lengths[1]
        if min(past_m) < -short_m or max(past_m) > short_m or min(ahead, back) <= _SHORTEST_M:
            return None
        corner = 0.5 * (p + q)
        sample = i + int(np.linalg.norm(self.path[i : j + 1] - corner, axis=1).argmin())
        return (corner, sample) if self._may_stand(a, corner, d, i, sample, j) else None

    def _may_stand(
        self, a: FloatArray, corner: FloatArray, d: FloatArray, i: int, sample: int, j: int
    ) -> bool:
        """Whether two legs may stand for a part of the flight."""
        for start, end, first, last in ((a, corner, i, sample), (corner, d, sample, j)):
            if distances_m(self.path[first : last + 1], start, end).max() > self.tolerances.path_m:
                return False
        flown = self.steps[i]
        for step in self.steps[i + 1 : j]:
            flown = flown.least(step)
        room = self.around.room(a, corner).least(self.around.room(corner, d))
        spent_m = min(SPENT_M, self.tolerances.path_m)
        if room.contact_m <= 0.0 or room.spare_m < min(-spent_m, flown.spare_m):
            return False
        for s in range(i, j + 1):
            for w in self._covered.get(s, ()):
                centre = self._centres[[w]]
                away_m = min(distances_m(centre, a, corner)[0], distances_m(centre, corner, d)[0])
                wanted_m = self._radii[w] - self.tolerances.path_m
                if away_m > max(wanted_m, np.linalg.norm(self.path[s] - self._centres[w])):
                    return False
        return True

    def speed_mps(self, i: int, j: int) -> float:
        """Mean speed of the flight between two samples, or the largest."""
        if j <= i:  # above its start
            return 3.0 if self._rests_between else 1.0
        steps_m = np.linalg.norm(np.diff(self.path[i : j + 1], axis=0), axis=1)
        return float(steps_m.max() if self._rests_between else steps_m.mean()) / self.dt_s

    def with_stops(self, corners: FloatArray, legs: tuple[Leg, ...]) -> tuple[Leg, ...]:
        """The legs with stops at the corners that must not be cut."""
        result = list(legs)
        for n in range(len(legs) - 1):
            room = legs[n].room
            least = room.least(legs[n + 1].room)
            for share in _CUTS:
                before, corner, after = corners[n : n + 3]
                a, b = cut_corner(before, corner, after, share * self.tolerances.corner_m)
                room = room.least(self.around.room(a, b))
            allowed_m = min(-min(SPENT_M, self.tolerances.path_m), least.spare_m)
            stop = room.contact_m <= 0.0 or room.spare_m < allowed_m
            result[n] = replace(legs[n], stop=stop, room=least if stop else room)
        stops = [leg.stop for leg in result]
        missed = self.passed_m(corners, stops) > self._radii[self.waypoints]
        for w in np.array(self.waypoints, int)[missed] if len(legs) > 1 else ():
            # the corner whose cutting costs most: that nearest to the waypoint
            n = int(np.linalg.norm(corners[1:-1] - self._centres[w], axis=1).argmin())
            result[n] = replace(result[n], stop=True)
        return tuple(result)

    def passed_m(self, corners: FloatArray, stops: list[bool]) -> FloatArray:
        """How close the path with cut corners comes to the waypoints [m]."""
        path = cut_path(corners, stops, self.tolerances.corner_m)
        centres = self._centres[np.array(self.waypoints, int)]
        return leg_distances_m(centres, path).min(axis=1)

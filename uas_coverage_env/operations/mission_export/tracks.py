"""A flight as few straight legs that an autopilot can fly, every one of them checked.

An autopilot takes corners, not samples. A leg may stand for a part of the flight where

* all samples lie within a tolerance of it,
* it leaves as much room to obstacles and fence as the flight did, or a full safe distance less what
  of it may be spent, and is never in contact,
* it passes what the UAS covered on the way within its radius.

Legs are made as long as that allows, one after the other. At a corner that must not be cut,
because the cut would be too close to something or miss a waypoint, the autopilot stops.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import Flight, covered_at
from uas_coverage_env.operations.clearance import Clearance, Surroundings
from uas_coverage_env.operations.path_geometry import cut_corner, cut_path, distances_m
from uas_coverage_env.operations.sorties import TAKE_OFF_HEIGHT_M, Sortie, sorties_of
from uas_coverage_env.world.coverage import covering_samples

FloatArray = NDArray[np.float64]

SPENT_M = 1.0
"""Of a safe distance, what a leg may use: the rest is the autopilot's."""

STOP_S = 1.0
_GROUND_M = 0.3
_PATIENCE = 6
_CUTS = (0.25, 0.5, 1.0)
_CUT_SEEN = 5.0
_SHORTEST_M, _PARALLEL = 0.5, 0.01


@dataclass(frozen=True, eq=False)
class Leg:
    """A straight leg.

    Attributes:
        end_m: (3,) where it ends [m].
        sample: Of the flight, at its end.
        speed_mps: Mean of the flight on it; where it was planned for an autopilot, which flies it
            from rest to rest, the largest [m/s].
        room: On the leg, and on what cuts the corner at its end.
        stop: Whether the autopilot stops at its end.
    """

    end_m: FloatArray
    sample: int
    speed_mps: float
    room: Clearance
    stop: bool = False


@dataclass(frozen=True, eq=False)
class Track:
    """The legs of one UAS, from above its start to above where it lands: there again, mostly.

    Attributes:
        uas: Index of the UAS.
        name: Of its file: that of the UAS, and which of its sorties it is, if there are several.
        sortie: Which part of the flight it is.
        home_m: (3,) its start on the ground [m].
        landing_m: (3,) where it lands, on the ground; elsewhere where its home was closed [m].
        take_off_m: (3,) where the first leg begins, above the start [m].
        legs: One or more.
        off_m: Largest distance of a sample from its leg [m].
        waypoints: Which this UAS covers.
        passed_m: (len(waypoints),) how close the legs, corners cut, come to each centre [m].
        flown_m: (T, 3) the samples that the legs stand for, from the first of the sortie on [m].
        layer: How heights differ from those of the flight, in words; empty: they do not.
        number: Of the sortie among those of the UAS, from 1 on.
    """

    uas: int
    name: str
    sortie: Sortie
    home_m: FloatArray
    landing_m: FloatArray
    take_off_m: FloatArray
    legs: tuple[Leg, ...]
    off_m: float
    waypoints: tuple[int, ...]
    passed_m: FloatArray
    flown_m: FloatArray
    layer: str = ""
    number: int = 1

    @property
    def lands_elsewhere(self) -> bool:
        """Whether it does not land where it takes off."""
        return bool((self.landing_m != self.home_m).any())

    @property
    def corners_m(self) -> FloatArray:
        """(len(legs) + 1, 3) [m]."""
        return np.array([self.take_off_m, *(leg.end_m for leg in self.legs)])

    @property
    def room(self) -> Clearance:
        """The least on all legs."""
        least = self.legs[0].room
        for leg in self.legs:
            least = least.least(leg.room)
        return least


@dataclass(frozen=True)
class Tolerances:
    """How far an autopilot may be from the flight.

    Attributes:
        path_m: Of a sample from its leg [m].
        corner_m: How far from a corner it may pass [m].
    """

    path_m: float = 2.0
    corner_m: float = 2.0


def make_tracks(
    flight: Flight, uas: int, tolerances: Tolerances, covered: NDArray[np.int64] | None = None
) -> list[Track]:
    """The legs of each sortie of a UAS; of those that leave the ground.

    Args:
        flight: In which the UAS has landed; its scenario is that at the end, homes where they are
            then.
        uas: Index of the UAS.
        tolerances: How far legs may be from the flight.
        covered: (W,) the sample in which each waypoint was covered; None: where all were to be
            covered from the start on.

    Raises:
        InputError: No legs could be found that are free of contact.
    """
    if covered is None:
        covered = covered_at(flight)
    found = (make_track(flight, uas, one, covered, tolerances) for one in sorties_of(flight, uas))
    return [track for track in found if track is not None]


def make_track(
    flight: Flight, uas: int, sortie: Sortie, covered: NDArray[np.int64], tolerances: Tolerances
) -> Track | None:
    """The legs of a sortie; None where the UAS stays on the ground.

    Args:
        flight: As for `make_tracks`; likewise the other arguments.
        uas: Index of the UAS.
        sortie: From which take-off to which landing.
        covered: (W,) samples.
        tolerances: How far legs may be from the flight.

    Raises:
        InputError: No legs could be found that are free of contact.
    """
    path = flight.x[sortie.first : sortie.landed, uas, 0:3]
    high = np.flatnonzero(-path[:, 2] >= TAKE_OFF_HEIGHT_M)
    if not len(high):
        return None
    first, last = int(high[0]), int(high[-1])
    _check_in_air(flight, uas, sortie, path[first:last], first)
    home_m, landing_m = (
        _place_m(flight, uas, sample) * (1.0, 1.0, 0.0) for sample in (sortie.first, sortie.landed)
    )
    builder = _Builder(flight, uas, sortie, _covered_by(flight, uas, sortie, covered), tolerances)
    take_off_m = np.array([*home_m[:2], path[first, 2]])
    above_m = np.array([*landing_m[:2], path[last, 2]])
    points = builder.corners(first, last, take_off_m, above_m)
    legs = tuple(
        Leg(end_m, sortie.first + j, builder.speed_mps(i, j), builder.around.room(start_m, end_m))
        for (start_m, i), (end_m, j) in pairwise(points)
    )
    corners = np.array([point for point, _ in points])
    legs = builder.with_stops(corners, legs)
    off_m = max(
        float(distances_m(path[i : j + 1], a, b).max()) for (a, i), (b, j) in pairwise(points)
    )
    track = Track(
        uas=uas,
        name=flight.scenario.uas[uas].name,
        sortie=sortie,
        home_m=home_m,
        landing_m=landing_m,
        take_off_m=take_off_m,
        legs=legs,
        off_m=off_m,
        waypoints=tuple(builder.waypoints),
        passed_m=builder.passed_m(corners, [leg.stop for leg in legs]),
        flown_m=path,
    )
    up_m = (0.0, 0.0, TAKE_OFF_HEIGHT_M)
    ups_m = [
        builder.around.path_room(np.array([above, ground_m - up_m])).contact_m
        for above, ground_m in ((take_off_m, home_m), (above_m, landing_m))
    ]
    if min(track.room.contact_m, *ups_m) <= 0.0:
        raise InputError(
            f"{track.name}: no legs are free of contact within --tolerance {tolerances.path_m:g}; "
            f"make it smaller"
        )
    return track


def _check_in_air(flight: Flight, uas: int, sortie: Sortie, path: FloatArray, first: int) -> None:
    """Refuse a flight made of a log, which does not say that a UAS had landed in between."""
    touches = first + np.flatnonzero(-path[:, 2] < _GROUND_M)
    if len(touches):
        at_s = (sortie.first + int(touches[0])) * flight.scenario.dt_s
        raise InputError(
            f"{flight.scenario.uas[uas].name} is on the ground {at_s:g} s after the start and "
            f"flies on; export the flight that was planned instead"
        )


def _place_m(flight: Flight, uas: int, sample: int) -> FloatArray:
    """(3,) the home at which a UAS stands at a sample: its first, or that at the end."""
    homes = np.array([flight.x[0, uas, :3], flight.scenario.uas[uas].start_m])
    away_m = np.linalg.norm(homes - flight.x[sample, uas, :3], axis=1)
    return homes[1 if away_m[1] <= away_m[0] else 0]


def _covered_by(
    flight: Flight, uas: int, sortie: Sortie, covered: NDArray[np.int64]
) -> dict[int, int]:
    """The waypoints that a UAS covers in a sortie, and in which of the samples of that."""
    scenario, (first, landed) = flight.scenario, sortie[:2]
    return {
        w: sample - first
        for w, sample in enumerate(covered.tolist())
        if first <= sample < landed and covering_samples(scenario, w, flight.x[sample])[uas]
    }


def relaid(
    flight: Flight,
    track: Track,
    corners: FloatArray,
    leg_of: list[int],
    tolerances: Tolerances,
    layer: str,
) -> Track | None:
    """A track with other corners; None where it is not as clear, or misses a waypoint.

    Args:
        flight: The flight.
        track: The track as it is.
        corners: (C, 3) the new ones [m].
        leg_of: (C - 1,) the leg of the track that each new one stands for.
        tolerances: How far legs may be from the flight.
        layer: What is different, in words.
    """
    covered = dict.fromkeys(track.waypoints, 0)
    builder = _Builder(flight, track.uas, track.sortie, covered, tolerances)
    legs = tuple(
        replace(track.legs[n], end_m=end_m, room=builder.around.room(start_m, end_m), stop=False)
        for (start_m, end_m), n in zip(pairwise(corners), leg_of, strict=True)
    )
    legs = builder.with_stops(corners, legs)
    new = replace(
        track,
        legs=legs,
        passed_m=builder.passed_m(corners, [leg.stop for leg in legs]),
        layer=layer,
    )
    radii = np.array([flight.scenario.waypoints[w].radius_m for w in track.waypoints])
    passes = new.passed_m <= np.maximum(radii - tolerances.path_m, track.passed_m) + 1e-9
    spent_m = min(SPENT_M, tolerances.path_m)
    clear = new.room.contact_m > 0.0 and new.room.spare_m >= min(-spent_m, track.room.spare_m)
    return new if clear and passes.all() else None


class _Builder:
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
        centres = self._centres[self.waypoints]
        away = [distances_m(centres, a, b) for a, b in pairwise(path)]
        return np.min(away, axis=0) if len(centres) else np.empty(0)

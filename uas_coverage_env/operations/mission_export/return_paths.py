"""How a UAS comes home when something fails, which way is clear, and how long that takes.

"Return" of an autopilot brakes, climbs to a height, flies straight home and lands. Where no height
below the fence's top makes that clear from everywhere on the path, only the way that was flown is
known to be clear: the UAS retraces it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from uas_coverage_env.flight.take_offs import TAKE_OFF_HEIGHT_M
from uas_coverage_env.geometry.outline import outline_of
from uas_coverage_env.operations.clearance import Surroundings
from uas_coverage_env.operations.mission_export.tracks import Track
from uas_coverage_env.operations.path_geometry import interpolated
from uas_coverage_env.planning.execution.lateness import apart_m
from uas_coverage_env.planning.execution.leg_model import (
    DT_S,
    Autopilot,
    Followed,
    landing_s,
    leg_s,
)
from uas_coverage_env.scenario import Scenario

FloatArray = NDArray[np.float64]
Way = Callable[[int], FloatArray]
"""Index of a departure -> (T, 3) where the UAS is on its way home, each `_STEP_S`."""

RETURN, RETRACE = "return", "retrace"

CEILING_MARGIN_M = 1.0
"""Below the fence's top, where a return is flown at the highest (FENCE_MARGIN)."""

_STEP_S = 1.0
_LEAST_RETURN_M = 15.0
_ABOVE_ROOFS_M = 1.0
_OFF_WAY_M = 2.0
"""How far from its straight way home an autopilot may be: 1.7 m in 95 % of recorded flights."""

_OVER_OTHERS_M = 1.5
_MARGIN_S, _MARGIN_SHARE = 4.0, 0.1
_CLIMBING = 1.5
"""A second of climbing takes so much more than one of level flight."""

_RETRACING, _TIDIES_S = 1.5, 15.0
"""SmartRTL flies back 1.4 times as long as out, since it slows down at the points that it remembers
of turns, and begins 10 s late, which it takes to tidy them up (flown in ArduCopter 4.7-dev)."""

_MOST_TRIED = 6
_FLYING_M = 0.5


class Other(NamedTuple):
    """Another UAS in the air.

    Attributes:
        name: Of its file.
        followed: How that is flown.
        begins_s: When it is started, on the clock of the mission [s].
        kept_m: Distance to be kept from it, horizontally or vertically [m].
    """

    name: str
    followed: Followed
    begins_s: float
    kept_m: float


class Span(NamedTuple):
    """When a way home that begins is not clear.

    Attributes:
        from_s: Since the command to start [s].
        to_s: Likewise.
        of: The other UAS that it would come too close to; empty: obstacle, zone or fence.
    """

    from_s: float
    to_s: float
    of: str = ""


@dataclass(frozen=True, eq=False)
class ReturnPath:
    """The way home that is flown when something fails.

    Attributes:
        action: `RETURN` or `RETRACE`.
        height_m: At which it returns; None where it retraces its way [m].
        times_s: (N,) when it begins, since the command to start [s].
        needs_s: (N,) how long it takes from then until it has landed, with margin [s].
        braking: When stopping, with which every way home begins, is not clear.
        near: When it would come too close to another UAS, all of them in time.
    """

    action: str
    height_m: float | None
    times_s: FloatArray
    needs_s: FloatArray
    braking: tuple[Span, ...]
    near: tuple[Span, ...]

    def needs_at(self, time_s: float) -> float:
        """How long it takes from a time on, with margin [s]."""
        return float(np.interp(time_s, self.times_s, self.needs_s))


def return_path(
    scenario: Scenario,
    track: Track,
    followed: Followed,
    by: Autopilot,
    *,
    holds_s: Sequence[float],
    begins_s: float,
    others: Sequence[Other],
    nearer_end: bool = False,
) -> ReturnPath:
    """The way home of a UAS that flies a file.

    Args:
        scenario: The mission.
        track: The legs of the file.
        followed: How an autopilot flies them.
        by: The autopilot.
        holds_s: (legs,) how long it stops at the end of each [s].
        begins_s: When it is started, on the clock of the mission [s].
        others: Those that are in the air at the same time.
        nearer_end: Whether a UAS that retraces its way flies on to the end of its mission instead
            where fewer legs are left than flown (PX4).
    """
    paths = _Paths(scenario, track, followed, by)
    braking = _spans(paths.times_s, ~paths.stops_clear)
    found = []
    for height_m in paths.clear_heights_m(others)[:_MOST_TRIED]:
        near = _near(paths.returning(height_m), paths, others, begins_s)
        found.append((sum(s.to_s - s.from_s + _STEP_S for s in near), height_m, near))
        if not near:
            break
    if found:
        _, height_m, near = min(found)
        needs_s = paths.return_s(height_m)
        return ReturnPath(RETURN, height_m, paths.times_s, needs_s, braking, near)
    flies_on = np.zeros(len(paths.times_s), bool)
    if nearer_end:
        flown = np.searchsorted(followed.corner_s, paths.times_s)
        flies_on = flown > len(followed.corner_s) - flown
    near = _near(paths.retracing(flies_on), paths, others, begins_s)
    needs_s = paths.retrace_s(holds_s, flies_on)
    return ReturnPath(RETRACE, None, paths.times_s, needs_s, braking, near)


class _Paths:
    """Ways home from every second of a flight.

    Attributes:
        times_s: (N,) when they begin.
        stops_clear: (N,) whether braking there is clear.
    """

    def __init__(self, scenario: Scenario, track: Track, followed: Followed, by: Autopilot) -> None:
        self._scenario, self._followed, self._by = scenario, followed, by
        self._landing_m = track.landing_m
        self._around = Surroundings(scenario, track.uas)
        self._radius_m = scenario.uas[track.uas].radius_m
        places_m = followed.places_m
        high = np.flatnonzero(
            -places_m[:, 2] >= min(TAKE_OFF_HEIGHT_M, -float(track.take_off_m[2])) - 1e-6
        )
        self._samples = np.unique(np.append(high[:: round(_STEP_S / DT_S)], high[-1]))
        self.times_s = followed.times_s[self._samples]
        self._from_m = places_m[self._samples]
        level_mps = np.gradient(places_m[:, :2], DT_S, axis=0)[self._samples]
        speed_mps = np.linalg.norm(level_mps, axis=1)
        stop_m = _stopping_m(speed_mps, by.acceleration_mps2)
        self._brakes_s = speed_mps / by.acceleration_mps2
        along = level_mps * (stop_m / np.maximum(speed_mps, 1e-9))[:, None]
        self._stops_m = self._from_m + np.pad(along, ((0, 0), (0, 1)))
        self.stops_clear = np.array(
            [
                self._around.room(a, b, 1.0).contact_m > 0.0
                for a, b in zip(self._from_m, self._stops_m, strict=True)
            ]
        )

    def clear_heights_m(self, others: Sequence[Other]) -> list[float]:
        """Heights at which climbing and flying straight home is clear, the lowest first [m]."""
        scenario = self._scenario
        margin_m = max(scenario.geofence.margin_m, CEILING_MARGIN_M)
        top_m = -float(scenario.fence.vertices_m[:, 2].min()) - margin_m
        tops_m = np.array([-float(h.vertices_m[:, 2].min()) for h in scenario.hulls])
        lows_m = np.array([-float(h.vertices_m[:, 2].max()) for h in scenario.hulls])
        met = self._met()
        roofs_m = [
            float(top) + obstacle.safe_distance_m + _ABOVE_ROOFS_M
            for top, obstacle in zip(tops_m, scenario.obstacles, strict=True)
        ]
        over_m = [
            -float(other.followed.places_m[:, 2].min()) + other.kept_m + _OVER_OTHERS_M
            for other in others
        ]
        path_m = -float(self._from_m[:, 2].min())
        clear = []
        for height_m in sorted({_LEAST_RETURN_M, *(round(h, 1) for h in roofs_m + over_m)}):
            highest_m = max(height_m, path_m)
            blocked = met & (tops_m + _ABOVE_ROOFS_M > height_m)
            blocked &= lows_m - _ABOVE_ROOFS_M < highest_m
            if _LEAST_RETURN_M <= height_m <= top_m and not blocked.any():
                clear.append(height_m)
        return clear

    def _met(self) -> NDArray[np.bool_]:
        """(obstacles,) which of them stand in a straight way home, as seen from above."""
        stops_m, home_m = self._stops_m[:, :2], self._landing_m[:2]
        corners = np.stack([stops_m[:-1], stops_m[1:], np.tile(home_m, (len(stops_m) - 1, 1))], 1)
        fans = shapely.convex_hull(shapely.multipoints(corners)) if len(corners) else []
        swept = shapely.union_all([*fans, shapely.LineString([stops_m[-1], home_m])])
        swept = shapely.buffer(swept, self._radius_m + _OFF_WAY_M)
        prints = [shapely.Polygon(outline_of(h.vertices_m)) for h in self._scenario.hulls]
        return np.asarray(shapely.intersects(swept, prints), bool).reshape(len(prints))

    def _corners_m(self, k: int, height_m: float) -> tuple[FloatArray, FloatArray]:
        """Where a return climbs to, and where its landing begins."""
        up_m = np.array([*self._stops_m[k, :2], min(float(self._stops_m[k, 2]), -height_m)])
        return up_m, np.array([*self._landing_m[:2], up_m[2]])

    def return_s(self, height_m: float) -> FloatArray:
        """(N,) how long returns at a height take, with margin [s]."""
        needs = []
        for k, (stop_m, brakes_s) in enumerate(zip(self._stops_m, self._brakes_s, strict=True)):
            up_m, above_m = self._corners_m(k, height_m)
            climbs_s = _CLIMBING * leg_s(stop_m, up_m, self._by)
            lands_s = landing_s(-float(above_m[2]), self._by)
            needs.append(brakes_s + climbs_s + leg_s(up_m, above_m, self._by) + lands_s)
        return _with_margin(np.array(needs))

    def returning(self, height_m: float) -> Way:
        """Where a UAS is that returns at a height."""

        def way(k: int) -> FloatArray:
            up_m, above_m = self._corners_m(k, height_m)
            turns_m = [self._from_m[k], self._stops_m[k], up_m, above_m]
            legs_s = [leg_s(a, b, self._by) for a, b in pairwise(turns_m[1:])]
            lands_s = landing_s(-float(above_m[2]), self._by)
            ends_s = np.cumsum([0.0, self._brakes_s[k], *legs_s, lands_s])
            turns_m.append(above_m * (1.0, 1.0, 0.0))
            return _sampled(ends_s, np.array(turns_m))

        return way

    def retrace_s(self, holds_s: Sequence[float], flies_on: NDArray[np.bool_]) -> FloatArray:
        """(N,) how long it takes to fly back the way it came, or on to its end [s]."""
        followed = self._followed
        stood_s = np.cumsum([0.0, *holds_s])
        done = np.searchsorted(followed.corner_s[1:], self.times_s, side="left")
        lands_s = landing_s(-float(followed.places_m[self._samples[0], 2]), self._by)
        out_s = np.maximum(self.times_s - followed.corner_s[0], 0.0) - stood_s[done]
        back_s = self._brakes_s + _TIDIES_S + _RETRACING * out_s + lands_s
        on_s = followed.duration_s - self.times_s
        return _with_margin(np.where(flies_on, on_s, back_s))

    def retracing(self, flies_on: NDArray[np.bool_]) -> Way:
        """Where a UAS is that flies back the way it came."""
        step = round(_STEP_S / DT_S)

        def way(k: int) -> FloatArray:
            places_m, here = self._followed.places_m, int(self._samples[k])
            return places_m[here::step] if flies_on[k] else places_m[here::-step]

        return way


def _with_margin(seconds: FloatArray) -> FloatArray:
    """Times that suffice for what is expected to take so long [s]."""
    return seconds * (1.0 + _MARGIN_SHARE) + _MARGIN_S


def _stopping_m(speed_mps: FloatArray, acceleration_mps2: float) -> FloatArray:
    """How far a vehicle flies until it stands, as ArduCopter computes its stopping point [m]."""
    fast = speed_mps > acceleration_mps2
    braking_m = 0.5 * acceleration_mps2 + speed_mps**2 / (2.0 * acceleration_mps2)
    return np.where(fast, braking_m, speed_mps)


def _sampled(ends_s: FloatArray, turns_m: FloatArray) -> FloatArray:
    """A path through turns as places of it."""
    clock_s = np.arange(0.0, ends_s[-1] + _STEP_S, _STEP_S)
    return interpolated(clock_s, ends_s, turns_m)


def _near(way: Way, paths: _Paths, others: Sequence[Other], begins_s: float) -> tuple[Span, ...]:
    """When ways home would come too close to another UAS."""
    if not others:
        return ()
    ways = [way(k) for k in range(len(paths.times_s))]
    mine_m = np.concatenate(ways)
    starts = np.cumsum([0, *map(len, ways)])[:-1]
    begun_s = np.concatenate(
        [t + _STEP_S * np.arange(len(w)) for t, w in zip(paths.times_s, ways, strict=True)]
    )
    found: list[Span] = []
    for other in others:
        places_m = other.followed.places_m
        clock_s = begins_s + begun_s - other.begins_s
        at = np.clip(np.rint(clock_s / DT_S).astype(np.intp), 0, len(places_m) - 1)
        flying = (-mine_m[:, 2] > _FLYING_M) | (-places_m[at, 2] > _FLYING_M)
        too_near = apart_m(mine_m, places_m[at]) < other.kept_m
        close = np.logical_or.reduceat(flying & too_near, starts)
        found += [span._replace(of=other.name) for span in _spans(paths.times_s, close)]
    return tuple(found)


def _spans(times_s: FloatArray, marked: NDArray[np.bool_]) -> tuple[Span, ...]:
    """The stretches of time that are marked."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
    return tuple(
        Span(float(times_s[a]), float(times_s[b - 1]))
        for a, b in zip(edges[::2], edges[1::2], strict=True)
    )

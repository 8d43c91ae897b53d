"""Leg times between waypoints, from where the UAS are and home.

A leg goes straight where the way is free, round tall obstacles along the corners that the world's
routes turn at, and over low ones. It takes as long as the slower of its horizontal and its
vertical part. Where an autopilot flies the mission, what a corner costs is the time to stop at it.
In a wind, a leg takes as long as at the ground speed that the wind leaves from its start to its
end.
"""

from __future__ import annotations

import math
from copy import copy
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from uas_coverage_env.autopilot.belief import (
    GUSTS,
    LEAST_GROUND_MPS,
    ground_speed,
    wind_growth,
)
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.planning.execution.leg_model import Autopilot
from uas_coverage_env.planning.routing.clock import CUTTING, STOPPING
from uas_coverage_env.vehicle.range import (
    ROUTED,
    SpeedLimits,
    flight_seconds,
    level_seconds,
    speeds_of,
    vertical_seconds,
)
from uas_coverage_env.world import build_arena
from uas_coverage_env.world.routes import CLEAR, IN_SIGHT, crossing, route

FloatArray = NDArray[np.float64]
_AGILITY = 0.75  # share of the largest horizontal acceleration that a turn uses on average
_NEIGHBOURS = 24
"""Legs to so many nearest waypoints are routed past obstacles; longer ones are taken straight."""
_FROM_HERE = 64
"""Likewise from where a UAS is."""
_AT_ONCE = 2**20  # straight legs: more than so many are computed in parts, for the memory
_OCTAGON = np.array([[math.cos(a), math.sin(a)] for a in np.arange(8) * math.pi / 4])


class Legs:
    """The leg times of a mission; what does not change during a mission is computed once.

    To a waypoint that a UAS cannot cover there is no leg: it takes for ever, inf.

    Attributes:
        arena: The mission as arrays.
        between_s: (V, W, W) between waypoints, for each kind of vehicle, and of what it carries.
        waypoints_m: (W, 3).
        homes_m: (U, 3) where they land.
        home_s: (U, W) from a waypoint to each UAS's home.
        kind: (U,) row of each UAS in `between_s`.
        neighbours: (W, K) the nearest other waypoints of each, nearest first.
        speed_mps: (U,) of each UAS.
        acceleration_mps2: (U,) horizontal, what a turn uses of it on average.
        turn_s: (U, W) time that the radius of a waypoint is worth; where an autopilot flies, what
            a corner of 90 degrees costs.
        turn_of_cosine: What turning at a waypoint costs, in `turn_s`, by the cosine of the angle
            from -1 to 1: of flights that cut through waypoints, or of an autopilot.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self.waypoints_m = np.array([w.position_m for w in brief.waypoints], float)
        self._credit_m = np.array([0.5 * w.radius_m for w in brief.waypoints])
        self.arena = build_arena(brief.as_scenario())
        self._can_cover = brief.can_cover
        carried = map(tuple, self._can_cover.tolist())
        of_each = list(zip(brief.vehicles, carried, strict=True))
        kinds = list(dict.fromkeys(of_each))
        self.kind = np.array([kinds.index(one) for one in of_each])
        self._speeds = [speeds_of(vehicle) for vehicle, _ in kinds]
        limits = [vehicle.limits for vehicle in brief.vehicles]
        gravity = [vehicle.airframe.gravity_mps2 for vehicle in brief.vehicles]
        self.speed_mps = np.array([limit.v_xy_max_mps for limit in limits])
        self.acceleration_mps2 = _AGILITY * np.array(
            [g * np.tan(limit.tilt_max_rad) for g, limit in zip(gravity, limits, strict=True)]
        )
        radius_m = np.array([w.radius_m for w in brief.waypoints])
        self.turn_s = radius_m / self.speed_mps[:, None]
        self.turn_of_cosine = CUTTING
        if brief.execution is not None:
            corner_m = brief.execution.corner_m
            stops_s = [Autopilot.of(vehicle, corner_m).turn_s for vehicle in brief.vehicles]
            self.turn_s = np.tile(np.array(stops_s)[:, None], len(radius_m))
            self.turn_of_cosine = STOPPING
        n = len(self.waypoints_m)
        nearest = min(_NEIGHBOURS, n - 1)
        found = KDTree(self.waypoints_m).query(self.waypoints_m, nearest + 1)[1]
        self.neighbours = _without_self(np.reshape(found, (n, nearest + 1)))
        self._carried = np.array([covers for _, covers in kinds])
        self.homes_m = np.array([uas.home_m for uas in brief.uas], float)
        self._wind: tuple[float, float, float] | None = None
        self._time()

    def in_wind(self, wind_mps: FloatArray, height_m: float) -> Self:
        """The same legs in a wind.

        Args:
            wind_mps: (2,) north and east [m/s].
            height_m: At which it blows like that [m]; higher up it blows harder. A leg is flown at
                the higher one of its ends.
        """
        legs = copy(self)
        legs._wind = float(wind_mps[0]), float(wind_mps[1]), height_m
        legs._time()
        return legs

    def _time(self) -> None:
        """Write `between_s` and `home_s`."""
        between_s = {speeds: self._between(speeds) for speeds in dict.fromkeys(self._speeds)}
        self.between_s = np.array(
            [
                np.where(covers, between_s[speeds], np.inf)
                for speeds, covers in zip(self._speeds, self._carried, strict=True)
            ]
        )
        self.home_s = np.array(
            [self._towards_home(u, home_m) for u, home_m in enumerate(self.homes_m)]
        )

    def ground_mps(self, uas: int, start_m: FloatArray, end_m: FloatArray) -> float:
        """The level speed of a UAS over ground, straight from a place to another [m/s]."""
        return float(self._level_mps(self._speeds[self.kind[uas]], start_m[None], end_m[None])[0])

    def _level_mps(self, speeds: SpeedLimits, start_m: FloatArray, end_m: FloatArray) -> FloatArray:
        """(N,) level speeds over ground from N places to others."""
        if self._wind is None:
            return np.full(len(start_m), speeds.level_mps)
        altitude_m = -np.minimum(start_m[:, 2], end_m[:, 2])
        return np.asarray(_ground_mps(speeds.level_mps, *self._wind, end_m - start_m, altitude_m))

    def from_here_s(self, uas: int, position_m: FloatArray) -> FloatArray:
        """(W,) leg times from a position to every waypoint; to near ones past obstacles."""
        speeds = self._speeds[self.kind[uas]]
        here = np.broadcast_to(position_m, self.waypoints_m.shape)
        level_mps = self._level_mps(speeds, here, self.waypoints_m)
        result = _straight_s(here, self.waypoints_m, self._credit_m, speeds, level_mps)
        near = np.argpartition(result, min(_FROM_HERE, len(result)) - 1)[:_FROM_HERE]
        result[near] = _legs_s(
            self.arena,
            near,
            here[near],
            self.waypoints_m[near],
            self._credit_m[near],
            speeds,
            level_mps[near],
            _OCTAGON,
        )
        return np.where(self._can_cover[uas], result, np.inf)

    def way_home_s(self, uas: int, position_m: FloatArray) -> float:
        """Leg time from a position of a UAS to its home."""
        target = np.array([len(self.waypoints_m) + uas])
        home_m = self.homes_m[[uas]]
        here = np.asarray(position_m, float)[None]
        speeds = self._speeds[self.kind[uas]]
        level_mps, no_credit = self._level_mps(speeds, here, home_m), np.zeros(1)
        return float(
            _legs_s(self.arena, target, here, home_m, no_credit, speeds, level_mps, _OCTAGON)[0]
        )

    def _between(self, speeds: SpeedLimits) -> FloatArray:
        n = len(self.waypoints_m)
        straight = np.empty((n, n))
        for rows in np.array_split(np.arange(n), max(n * n // _AT_ONCE, 1)):
            first, second = np.repeat(rows, n), np.tile(np.arange(n), len(rows))
            start_m, end_m = self.waypoints_m[first], self.waypoints_m[second]
            level_mps = self._level_mps(speeds, start_m, end_m)
            straight[rows] = _straight_s(
                start_m, end_m, self._credit_m[second], speeds, level_mps
            ).reshape(-1, n)
        near = np.repeat(np.arange(n), self.neighbours.shape[1]), self.neighbours.ravel()
        start_m, end_m = self.waypoints_m[near[0]], self.waypoints_m[near[1]]
        straight[near] = _legs_s(
            self.arena,
            near[1],
            start_m,
            end_m,
            self._credit_m[near[1]],
            speeds,
            self._level_mps(speeds, start_m, end_m),
            _OCTAGON,
        )
        np.fill_diagonal(straight, 0.0)
        return straight

    def _towards_home(self, uas: int, home_m: FloatArray) -> FloatArray:
        n = len(self.waypoints_m)
        speeds, end_m = self._speeds[self.kind[uas]], np.broadcast_to(home_m, (n, 3))
        return _legs_s(
            self.arena,
            np.full(n, n + uas),
            self.waypoints_m,
            end_m,
            np.zeros(n),
            speeds,
            self._level_mps(speeds, self.waypoints_m, end_m),
            _OCTAGON,
        )


def _without_self(found: NDArray[np.intp]) -> NDArray[np.intp]:
    """(W, K) the neighbours; a waypoint at the very same place may come before the waypoint."""
    rows = [row[row != w][: len(row) - 1] for w, row in enumerate(found)]
    return np.array(rows, np.intp).reshape(len(found), -1)


def _straight_s(
    start_m: FloatArray,
    end_m: FloatArray,
    credit_m: FloatArray,
    speeds: SpeedLimits,
    level_mps: FloatArray,
) -> FloatArray:
    away = end_m - start_m
    way_m = (away[:, :2] @ _OCTAGON.T).max(axis=1)
    up_m = np.maximum(-away[:, 2] - credit_m, 0.0)
    down_m = np.maximum(away[:, 2] - credit_m, 0.0)
    at_speed = speeds._replace(level_mps=level_mps)  # pyrefly: ignore[bad-argument-type]
    level_s = level_seconds(ROUTED, at_speed, way_m)
    return np.maximum(level_s, vertical_seconds(speeds, up_m, down_m))


@allocating_kernel
def _ground_mps(level_mps, north_mps, east_mps, height_m, way_m, altitude_m):
    """Ground speeds (N,) along ways (N, 3) at altitudes (N,), in a wind at a height."""
    result = np.empty(len(way_m))
    for i in range(len(way_m)):
        length_m = math.hypot(way_m[i, 0], way_m[i, 1]) + 1e-9
        along = way_m[i, 0] / length_m, way_m[i, 1] / length_m
        share = wind_growth(altitude_m[i], height_m)
        flown_mps = ground_speed(
            level_mps, GUSTS, share * north_mps, share * east_mps, along[0], along[1]
        )
        result[i] = max(flown_mps, LEAST_GROUND_MPS)
    return result


@allocating_kernel
def _legs_s(arena, targets, start_m, end_m, credit_m, speeds, level_mps, octagon):
    """Flight times past the fixed obstacles; `targets` are rows of the arena's routes."""
    result = np.empty(len(targets))
    for i in range(len(targets)):
        x0, y0, z0 = start_m[i, 0], start_m[i, 1], start_m[i, 2]
        x1, y1, z1 = end_m[i, 0], end_m[i, 1], end_m[i, 2]
        _, _, length_m, leg = route(arena, targets[i], x0, y0, z0, x1, y1, z1)
        up = max(z0 - z1 - credit_m[i], 0.0)
        down = max(z1 - z0 - credit_m[i], 0.0)
        if leg in (CLEAR, IN_SIGHT):
            straight_m = 0.0
            for face in range(octagon.shape[0]):
                along = (x1 - x0) * octagon[face, 0] + (y1 - y0) * octagon[face, 1]
                straight_m = max(straight_m, along)
            length_m = straight_m
        if leg == IN_SIGHT:
            top = min(z0, z1)  # down: the smallest is the highest
            for o in range(arena.obstacles.shape[0]):
                obstacle = arena.obstacles[o]
                at, _, _ = crossing(obstacle, arena.normals, arena.offsets_m, x0, y0, x1, y1)
                if at <= 1.0:
                    top = min(top, -obstacle.roof_m)
            up = max(up, z0 - top)
            down = max(down, z1 - top - credit_m[i])
        flown = SpeedLimits(level_mps[i], speeds.climb_mps, speeds.descent_mps)
        result[i] = flight_seconds(ROUTED, flown, 0.0, length_m, up, down)
    return result

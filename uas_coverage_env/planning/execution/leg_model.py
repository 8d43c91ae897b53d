"""How an autopilot flies a file of waypoints: a model of ArduCopter's waypoint navigation.

Each leg is flown from rest to rest within limits of speed, acceleration and jerk. The next leg
begins while this one still brakes, as soon as the turn stays within the waypoint radius and within
the acceleration of a corner; the vehicle flies the sum of both. So corners are rounded, and short
legs are slow: on 10 m no vehicle reaches 10 m/s. The rules are those of ArduPilot's `SCurve` and
`AC_WPNav`; take-off and landing are those of its modes.

Times of recorded flights of ArduCopter 4.7-dev in its simulator are met within 10 %
(tests/operations/test_leg_model.py).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from uas_coverage_env.vehicle import VehicleParams

FloatArray = NDArray[np.float64]

DT_S = 0.1
LAND_BELOW_M = 10.0
LAND_MPS = 0.5
"""Height below which ArduCopter lands slowly (LAND_ALT_LOW), and how fast (LAND_SPEED)."""

_SPOOL_UP_S, _DISARM_S = 3.5, 1.5
_SHORTEST_M = 0.05
_LEAST_LEVEL = 0.3


@dataclass(frozen=True)
class Autopilot:
    """Settings of an ArduCopter; the defaults are its own.

    Attributes:
        speed_mps: Largest horizontal speed, WPNAV_SPEED [m/s].
        up_mps: WPNAV_SPEED_UP [m/s].
        down_mps: WPNAV_SPEED_DN [m/s].
        acceleration_mps2: Horizontal, WPNAV_ACCEL [m/s²].
        vertical_mps2: WPNAV_ACCEL_Z [m/s²].
        jerk_mps3: WPNAV_JERK 1 with its soft onset, fitted to recorded flights [m/s³].
        corner_m: How far from a corner it may pass, WPNAV_RADIUS [m].
        corner_mps2: Acceleration in a corner: twice the horizontal one [m/s²].
    """

    speed_mps: float = 10.0
    up_mps: float = 2.5
    down_mps: float = 1.5
    acceleration_mps2: float = 2.5
    vertical_mps2: float = 1.0
    jerk_mps3: float = 0.8
    corner_m: float = 2.0
    corner_mps2: float = 5.0

    @classmethod
    def of(cls, vehicle: VehicleParams, corner_m: float) -> Autopilot:
        """One that is set to the limits of a vehicle, and may pass a corner so far from it [m]."""
        limits = vehicle.limits
        return cls(
            speed_mps=limits.v_xy_max_mps,
            up_mps=limits.v_up_max_mps,
            down_mps=limits.v_down_max_mps,
            corner_m=corner_m,
        )

    @property
    def turn_s(self) -> float:
        """What a corner of 90 degrees takes longer than flying straight on [s]."""
        leg_m = 5.0 * self.speed_mps
        corners = np.array([(0.0, 0.0, 0.0), (leg_m, 0.0, 0.0), (leg_m, leg_m, 0.0)])
        straight = np.array([(0.0, 0.0, 0.0), (2.0 * leg_m, 0.0, 0.0)])
        turning: list[FloatArray] = []
        _fly(_legs(corners, [self.speed_mps] * 2, self), self, turning)
        return DT_S * len(turning) - _Leg(straight[0], straight[1], self.speed_mps, self).total_s


class _Leg:
    """A straight leg from rest to rest: a ramp of limited jerk, cruise, the ramp backwards."""

    def __init__(self, start: FloatArray, end: FloatArray, speed_mps: float, by: Autopilot) -> None:
        way = end - start
        self.length = float(np.linalg.norm(way))
        self.start, self.along = start, way / self.length
        level, up = math.hypot(*self.along[:2]), -float(self.along[2])
        vertical_mps = by.up_mps if up >= 0.0 else by.down_mps
        self.a = min(by.acceleration_mps2 / max(level, 1e-6), by.vertical_mps2 / max(abs(up), 1e-6))
        self.j = by.jerk_mps3 / max(level, _LEAST_LEVEL)
        speed_mps = min(speed_mps, by.speed_mps)
        most = min(speed_mps / max(level, 1e-6), vertical_mps / max(abs(up), 1e-6))
        self.speed = self._reached(most)
        self.ramp_s = self._ramp_s(self.speed)
        cruise_m = max(0.0, self.length - 2.0 * self._ramp_m(self.speed))
        self.brakes_s = self.ramp_s + cruise_m / self.speed
        self.total_s = self.brakes_s + self.ramp_s
        self._peak = min(self.a, math.sqrt(self.speed * self.j))

    def _ramp_s(self, speed: float) -> float:
        if speed * self.j < self.a**2:  # the acceleration does not reach its limit
            return 2.0 * math.sqrt(speed / self.j)
        return speed / self.a + self.a / self.j

    def _ramp_m(self, speed: float) -> float:
        return 0.5 * speed * self._ramp_s(speed)

    def _reached(self, most: float) -> float:
        """The speed that the length allows."""
        if 2.0 * self._ramp_m(most) <= self.length:
            return most
        low, high = 0.0, most
        for _ in range(50):
            middle = 0.5 * (low + high)
            low, high = (
                (middle, high) if 2.0 * self._ramp_m(middle) <= self.length else (low, middle)
            )
        return high

    def at(self, t: float) -> tuple[float, float, float]:
        """Distance [m], speed [m/s] and acceleration [m/s²] along the leg at a time."""
        t = min(max(t, 0.0), self.total_s)
        if t > self.brakes_s:
            s, v, a = self._ramp(self.total_s - t)
            return self.length - s, v, -a
        if t > self.ramp_s:
            return self._ramp_m(self.speed) + self.speed * (t - self.ramp_s), self.speed, 0.0
        return self._ramp(t)

    def _ramp(self, t: float) -> tuple[float, float, float]:
        rise_s = self._peak / self.j
        hold_s = max(0.0, self.ramp_s - 2.0 * rise_s)
        t1 = min(t, rise_s)
        s, v, a = self.j * t1**3 / 6.0, 0.5 * self.j * t1**2, self.j * t1
        t2 = min(max(t - rise_s, 0.0), hold_s)
        s, v = s + v * t2 + 0.5 * a * t2**2, v + a * t2
        t3 = max(t - rise_s - hold_s, 0.0)
        s += v * t3 + 0.5 * a * t3**2 - self.j * t3**3 / 6.0
        v += a * t3 - 0.5 * self.j * t3**2
        return s, v, a - self.j * t3


@dataclass(frozen=True, eq=False)
class Followed:
    """A file as it is flown, from the command to start until it has landed.

    Attributes:
        times_s: (T,) every `DT_S` [s].
        places_m: (T, 3) north, east, down [m].
        corner_s: (C,) when each corner is passed or reached, and the first one left [s].
    """

    times_s: FloatArray
    places_m: FloatArray
    corner_s: FloatArray

    @property
    def duration_s(self) -> float:
        """From the command to start until it has landed [s]."""
        return float(self.times_s[-1])


def follow(
    corners_m: ArrayLike,
    speeds_mps: Sequence[float],
    holds_s: Sequence[float],
    by: Autopilot,
    wait_s: float = 0.0,
    *,
    takes_off: bool = True,
    hover_s: float = 0.0,
) -> Followed:
    """Take off to the first corner, fly the others one after the other, land under the last one.

    Args:
        corners_m: (C, 3) north, east, down [m]; two or more.
        speeds_mps: (C - 1,) of each leg.
        holds_s: (C - 1,) how long it stops at the end of each leg; 0: it flies on.
        by: The autopilot.
        wait_s: How long it waits on the ground before it takes off [s].
        takes_off: Whether it does; if not, it is at rest at the first corner.
        hover_s: How long it stays at the first corner before it flies on [s].
    """
    corners = np.asarray(corners_m, np.float64)
    places = [corners[0]]
    if takes_off:
        ground = corners[0] * (1.0, 1.0, 0.0)
        places = [ground] * round((wait_s + _SPOOL_UP_S) / DT_S)
        _fly(_legs([ground, corners[0]], [by.up_mps], by), by, places)
    places += [places[-1]] * round(hover_s / DT_S)
    corner_s = [(len(places) - 1) * DT_S]
    first = 0
    for last in range(len(corners) - 1):
        if holds_s[last] > 0.0 or last == len(corners) - 2:
            run = slice(first, last + 1)
            legs = _legs(corners[first : last + 2], speeds_mps[run], by)
            corner_s += _fly(legs, by, places)
            places += [places[-1]] * round(holds_s[last] / DT_S)
            first = last + 1
    _land(corners[-1], by, places)
    return Followed(
        DT_S * np.arange(len(places), dtype=np.float64), np.array(places), np.array(corner_s)
    )


def _legs(
    corners: Sequence[FloatArray] | FloatArray, speeds_mps: Sequence[float], by: Autopilot
) -> list[_Leg | None]:
    """The legs between corners; None where two corners are the same."""
    return [
        _Leg(start, end, speed, by) if np.linalg.norm(end - start) > _SHORTEST_M else None
        for start, end, speed in zip(corners, corners[1:], speeds_mps, strict=False)
    ]


def _fly(legs: Sequence[_Leg | None], by: Autopilot, places: list[FloatArray]) -> list[float]:
    """Append the places of legs that are flown without a stop; returns when each was done."""
    done_s: list[float] = []
    real = [leg for leg in legs if leg is not None]
    t, number, tail, tail_s = 0.0, 0, None, 0.0
    for leg in legs:
        if leg is None:
            done_s.append((len(places) - 1) * DT_S)
            continue
        number += 1
        after = real[number] if number < len(real) else None
        after_s, left_s = 0.0, math.inf
        while tail is not None or not (left_s <= 0.0 or after_s >= left_s):
            t += DT_S
            left_s = leg.total_s - t
            place = leg.start + leg.at(t)[0] * leg.along
            if tail is not None:  # half a turn may be left of the leg before
                tail_s += DT_S
                place = place - (tail.length - tail.at(tail_s)[0]) * tail.along
                tail = tail if tail_s < tail.total_s else None
            elif after is not None and (after_s > 0.0 or _may_turn(leg, after, t, by)):
                after_s += DT_S
                place = place + after.at(after_s)[0] * after.along
            places.append(place)
        done_s.append((len(places) - 1) * DT_S)
        tail, tail_s, t = (leg if left_s > 0.0 else None), t, after_s
    return done_s


def _may_turn(leg: _Leg, after: _Leg, t: float, by: Autopilot) -> bool:
    """Whether the next leg may begin: half of the turn from now is allowed."""
    left_s = leg.total_s - t
    if t < leg.brakes_s or left_s > after.ramp_s:
        return False
    half_s = 0.5 * max(left_s, 0.0)
    s1, v1, a1 = leg.at(t + half_s)
    s2, v2, a2 = after.at(half_s)
    off_m = (s1 - leg.length) * leg.along + s2 * after.along
    speed = np.linalg.norm(v1 * leg.along + v2 * after.along)
    pull = a1 * leg.along + a2 * after.along
    return bool(
        np.linalg.norm(off_m) < by.corner_m
        and speed < min(leg.speed, after.speed)
        and math.hypot(*pull[:2]) < by.corner_mps2
        and abs(pull[2]) < by.vertical_mps2
    )


def leg_s(start_m: ArrayLike, end_m: ArrayLike, by: Autopilot) -> float:
    """How long one leg takes from rest to rest, as fast as the autopilot is set to [s].

    Args:
        start_m: (3,) north, east, down [m].
        end_m: (3,) likewise.
        by: The autopilot.
    """
    start, end = np.asarray(start_m, np.float64), np.asarray(end_m, np.float64)
    if np.linalg.norm(end - start) <= _SHORTEST_M:
        return 0.0
    return _Leg(start, end, by.speed_mps, by).total_s


def landing_s(height_m: float, by: Autopilot) -> float:
    """How long landing takes from a height until it has disarmed [s]."""
    slow_m = min(height_m, LAND_BELOW_M)
    return (height_m - slow_m) / by.down_mps + slow_m / LAND_MPS + _DISARM_S


def _land(above: FloatArray, by: Autopilot, places: list[FloatArray]) -> None:
    height_m = -float(above[2])
    while height_m > 0.0:
        height_m -= DT_S * (by.down_mps if height_m > LAND_BELOW_M else LAND_MPS)
        places.append(np.array([above[0], above[1], min(-height_m, 0.0)]))
    places += [places[-1]] * round(_DISARM_S / DT_S)

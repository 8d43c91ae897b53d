"""How fast plan time may pass, so that every vehicle can follow, and stop.

Plan time s passes at a rate r = ds/dt for all vehicles. A plan with velocity v and acceleration a
is then flown with r v and r² a + r' v. Where that is more than a vehicle can do, time is stretched.
Braking time at a standing target would leave a vehicle at 12 m/s no room: it needs 29 m. So rates,
too, change only as fast as vehicles can follow: a forward and a backward pass over r² (path
parameterisation with bounded acceleration, Bobrow et al. 1985).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d

from uas_coverage_env.operations.stream.surroundings import SwarmSurroundings, stopping_place_m
from uas_coverage_env.operations.stream.timeline import Timeline
from uas_coverage_env.operations.stream.vehicle_limits import Limits
from uas_coverage_env.planning.execution.lateness import apart_m

FloatArray = NDArray[np.float64]

STEP_S = 0.1
SHARE = 0.9
"""Of its accelerations that a vehicle is asked for, and of its speed to make up for what it is
late; the rest is for wind, and for what it is behind."""
_FASTEST, _SLOWEST = 1.5, 0.05
_RATE_PER_S = 0.5
_SLOWER = (1.0, 0.8, 0.65, 0.5, 0.35, 0.2, 0.1, 0.05)
_NEAR_CORNERS = 5
"""Steps; accelerations jump at samples."""


class _Motion:
    """A plan at the times of the grid, and what its vehicle can do."""

    def __init__(self, plan: Timeline, limits: Limits, times_s: FloatArray) -> None:
        self.limits, self.places_m = limits, plan.places_at_m(times_s)
        self.velocities_mps = plan.velocities_at_mps(times_s)
        accelerations = plan.accelerations_at_mps2(times_s)
        level, up = self.velocities_mps[:, :2], -self.velocities_mps[:, 2]
        self.level_mps = np.hypot(*level.T)
        along = level / np.maximum(self.level_mps, 1e-9)[:, None]
        self._total = np.hypot(*accelerations[:, :2].T)
        self._along = (accelerations[:, :2] * along).sum(axis=1)
        self._across = np.abs(accelerations[:, 0] * along[:, 1] - accelerations[:, 1] * along[:, 0])
        self._climb, self._up = up, -accelerations[:, 2]

    def most_squared(self) -> FloatArray:
        """(K,) of the rate, by the vehicle's speeds and accelerations."""
        by, tiny = self.limits, 1e-9
        climbs = self._climb > 0.0
        upright = np.where(climbs, by.up_mps, by.down_mps) / np.maximum(np.abs(self._climb), tiny)
        most = np.maximum(SHARE * by.speed_mps, np.minimum(self.level_mps, by.speed_mps))
        speed = np.minimum(most / np.maximum(self.level_mps, tiny), upright)
        turning = SHARE * by.acceleration_mps2 / np.maximum(self._total, tiny)
        heaving = SHARE * by.vertical_mps2 / np.maximum(np.abs(self._up), tiny)
        return np.minimum.reduce([speed**2, turning, heaving, np.full(len(speed), _FASTEST**2)])

    def rate_range(self, k: int, rate: float, share: float = SHARE) -> tuple[float, float]:
        """How fast the rate may fall and rise at a place of the grid [1/s]; never the wrong way."""
        low, high = -_RATE_PER_S, _RATE_PER_S
        squared, by = rate * rate, self.limits
        across = squared * float(self._across[k])
        most = share * by.acceleration_mps2
        for speed, along, limit in (
            (float(self.level_mps[k]), float(self._along[k]), _other_leg(most, across)),
            (float(self._climb[k]), float(self._up[k]), share * by.vertical_mps2),
        ):
            if abs(speed) > 1e-3:
                ends = (-limit - squared * along) / speed, (limit - squared * along) / speed
                low, high = max(low, min(ends)), min(high, max(ends))
        return min(low, -0.02), max(high, 0.02)


def _other_leg(hypotenuse: float, leg: float) -> float:
    return math.sqrt(max(hypotenuse**2 - leg**2, 0.0))


class Pace:
    """The rates at which the plans of all vehicles can be flown.

    Args:
        plans: By name of the UAS.
        limits: Likewise, what its vehicle can do.
        around: What they have to be clear of.
        silent_s: After so long without a word a vehicle counts as lost, and all slow down [s].
        may_hurry: Whether plan time may pass faster than time where it is late: not where waypoints
            ask for a speed.
    """

    def __init__(
        self,
        plans: Mapping[str, Timeline],
        limits: Mapping[str, Limits],
        around: SwarmSurroundings,
        silent_s: float,
        may_hurry: bool,
    ) -> None:
        self.first_s = min(plan.first_s for plan in plans.values())
        last_s = max(plan.last_s for plan in plans.values())
        self._times_s = np.arange(self.first_s, last_s + STEP_S, STEP_S)
        self._motions = {name: _Motion(p, limits[name], self._times_s) for name, p in plans.items()}
        squared = np.minimum.reduce([m.most_squared() for m in self._motions.values()])
        if not may_hurry:
            squared = np.minimum(squared, 1.0)
        rates = np.sqrt(minimum_filter1d(squared, _NEAR_CORNERS))
        self.slowed = {"stopping": 0, "others": 0}
        rates = self._with_room_to_stop(rates, around)
        rates = self._apart(rates, around, silent_s)
        self._rates = self._smooth(np.maximum(rates, _SLOWEST))

    def at(self, plan_s: float) -> float:
        """The largest rate at a time of the plan."""
        return float(np.interp(plan_s, self._times_s, self._rates))

    def change(self, plan_s: float, rate: float, share: float = SHARE) -> tuple[float, float]:
        """How fast the rate may fall (negative) and rise, for all to follow [1/s]."""
        k = min(int((plan_s - self.first_s) / STEP_S), len(self._times_s) - 1)
        ranges = [motion.rate_range(k, rate, share) for motion in self._motions.values()]
        return max(low for low, _ in ranges), min(high for _, high in ranges)

    def late_s(self) -> float:
        """How much longer than planned it takes, made up for where that can be [s]."""
        late_s = 0.0
        for rate in self._rates.tolist():
            late_s = max(late_s + STEP_S * (1.0 / rate - 1.0), 0.0)
        return late_s

    def _with_room_to_stop(self, rates: FloatArray, around: SwarmSurroundings) -> FloatArray:
        """Slower where a vehicle that hears no more would come too close to what stands there."""
        rates = rates.copy()
        for name, motion in self._motions.items():
            for k in range(0, len(rates), 2):
                place_m = motion.places_m[k]
                needs_m = min(max(around.room_m(name, place_m, place_m) - 0.3, 0.0), 1.0)
                for slower in _SLOWER:
                    rate = slower * rates[k]
                    velocity = rate * motion.velocities_mps[k]
                    if around.stops_in_m(name, place_m, velocity, motion.limits) >= needs_m:
                        break
                if slower < 1.0:
                    self.slowed["stopping"] += 1
                    rates[max(k - 1, 0) : k + 2] = np.minimum(rates[max(k - 1, 0) : k + 2], rate)
        return rates

    def _apart(self, rates: FloatArray, around: SwarmSurroundings, silent_s: float) -> FloatArray:
        """Slower where one that stops would be in the way of another that has not noticed yet."""
        rates = rates.copy()
        names = list(self._motions)
        for one in names:
            for other in names:
                if one != other:
                    self._let_stop(rates, one, other, around.kept_m(one, other), silent_s)
        return rates

    def _let_stop(
        self, rates: FloatArray, one: str, other: str, kept_m: float, silent_s: float
    ) -> None:
        stopping, flying = self._motions[one], self._motions[other]
        planned_m = apart_m(stopping.places_m, flying.places_m)
        last, by = len(rates) - 1, flying.limits
        for k in np.flatnonzero(planned_m < 150.0)[::2]:
            for slower in _SLOWER:
                rate = slower * rates[k]
                velocity = rate * stopping.velocities_mps[k]
                end_m = stopping_place_m(stopping.places_m[k], velocity, stopping.limits)
                line_m = np.linspace(stopping.places_m[k], end_m, 6)
                brakes_s = rate * float(flying.level_mps[k]) / (SHARE * by.acceleration_mps2)
                ahead = int(rate * (silent_s + 0.5 * brakes_s) / STEP_S) + 2
                way_m = flying.places_m[k : min(k + ahead, last) + 1 : 2]
                least_m = min(kept_m, float(planned_m[k : k + ahead].min()) - 0.5)
                if apart_m(way_m[:, None], line_m[None]).min() >= least_m:
                    break
            if slower < 1.0:
                self.slowed["others"] += 1
                rates[max(k - 1, 0) : k + 2] = np.minimum(rates[max(k - 1, 0) : k + 2], rate)

    def _smooth(self, rates: FloatArray) -> FloatArray:
        """Rates that rise and fall no faster than all can follow."""
        squared = rates**2
        motions = list(self._motions.values())
        for k in range(len(squared) - 2, -1, -1):
            rate = math.sqrt(squared[k + 1])
            fall = max(motion.rate_range(k + 1, rate)[0] for motion in motions)
            squared[k] = min(squared[k], squared[k + 1] - 2.0 * STEP_S * fall)
        for k in range(1, len(squared)):
            rate = math.sqrt(squared[k - 1])
            rise = min(motion.rate_range(k - 1, rate)[1] for motion in motions)
            squared[k] = min(squared[k], squared[k - 1] + 2.0 * STEP_S * rise)
        return np.sqrt(squared)

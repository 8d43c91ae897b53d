"""Lower bounds of a mission: the least energy, and the fewest steps, with which it can be flown."""

from __future__ import annotations

import math
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.bound.carried import Carried
from uas_coverage_env.bound.legs import (
    LegBounds,
    Places,
    legs_between,
    steps_to_middles,
    triples,
)
from uas_coverage_env.bound.passing import Costs, Passing
from uas_coverage_env.bound.prices import STEPS, Ends, cheapest, energy_prices
from uas_coverage_env.bound.program import Cut, least_routes
from uas_coverage_env.bound.turning import Turning, motion_of, turning_of_fleet
from uas_coverage_env.compiled.purpose import compiling_for
from uas_coverage_env.scenario import Scenario

FloatArray = NDArray[np.float64]

MOST_WAYPOINTS = 120
"""The bound of larger missions is not computed: its time and memory grow with the third power."""

_J_PER_WH = 3600.0
_SIZES = 16  # of sets into which several routes must lead
_ROUNDING = 1e-6  # share of a bound that is left to the rounding of the solver


class MissionBound:
    """What no flight that accomplishes a mission can do with less, in the LPV model and still air.

    The derivation, with its assumptions: docs/bound.md.

    Args:
        scenario: Without wind and disturbances, with at most `MOST_WAYPOINTS` waypoints.

    Raises:
        ValueError: There is no such bound for the scenario.
    """

    def __init__(self, scenario: Scenario) -> None:
        reason = _why_not(scenario)
        if reason:
            raise ValueError(f"{scenario.name}: no bound, {reason}")
        corners_m = np.array(scenario.geofence.vertices_m)
        heights_m = corners_m[:, 2]
        self._across_m = float(np.linalg.norm(np.ptp(corners_m, axis=0)))
        ends = Ends(
            scenario.dt_s,
            scenario.landing_distance_m,
            scenario.landing_speed_mps,
            float(heights_m.max() - heights_m.min()),
        )
        self._vehicles = tuple(scenario.vehicles)
        self._ends = ends
        self._prices = cheapest(
            [
                energy_prices(vehicle, ends, dod_max)
                for vehicle, dod_max in set(
                    zip(self._vehicles, (uas.dod_max for uas in scenario.uas), strict=True)
                )
            ]
        )
        self._places = _places(scenario)
        self._uas = len(scenario.uas)
        self._time: dict[tuple[int, int], float] = {}
        self._energy: dict[tuple[int, ...], float] = {}

    @cached_property
    def steps(self) -> int:
        """Fewest steps until the last UAS has landed."""
        together = self._least_time(self._uas, len(self._order))
        return max(1, self._whole(together / self._uas))

    def energy_Wh(self, steps: int | None = None) -> float:
        """The least energy of the swarm.

        Args:
            steps: Of flights with at most so many steps; None: of all flights.
        """
        needed = () if steps is None else self._needed(steps)
        if needed:
            self.energy_Wh()  # first, so that its prices do not depend on what was asked before
        if needed not in self._energy:
            self._energy[needed] = self._least_energy_J(needed) / _J_PER_WH
        return max(self._energy[needed], self.energy_Wh()) if needed else self._energy[needed]

    def _least_energy_J(self, needed: tuple[int, ...]) -> float:
        step_J, once_J = self._prices.step, self._prices.once
        idle_J = self._uas * (step_J - once_J)  # each UAS flies for a step at least
        if not len(self._places.waypoints_m):
            return max(idle_J, 0.0)
        n = len(self._order)
        cuts = [
            Cut(self._farthest(size), routes)
            for routes, smallest in enumerate(needed, 2)
            for size in range(n, max(smallest, routes) - 1, -max(1, n // _SIZES))
        ]
        routes_J = least_routes(self._cost(self._prices_turning), step_J, cuts=cuts)
        if self._carried is not None:
            with compiling_for("lower bounds"):
                routes_J = max(routes_J, self._carried.least_routes(step_J, cuts))
        return max(idle_J + routes_J * (1.0 - _ROUNDING), 0.0)

    def _needed(self, steps: int) -> tuple[int, ...]:
        """For one UAS, two, ...: the fewest of the farthest waypoints that so many cannot visit.

        In so many steps, as far as the bound of their time shows; shorter where they can visit all.
        """
        n, found = len(self._order), []
        for k in range(1, self._uas):
            if not self._takes_more(k, n, steps):
                break
            few, many = 0, n
            while many - few > 1:
                middle = (few + many) // 2
                few, many = (few, middle) if self._takes_more(k, middle, steps) else (middle, many)
            found.append(many)
        return tuple(found)

    def _takes_more(self, uas: int, size: int, steps: int) -> bool:
        return self._whole(self._least_time(uas, size)) > uas * steps

    def _whole(self, steps: float) -> int:
        return math.ceil(steps * (1.0 - _ROUNDING) - _ROUNDING)

    def _least_time(self, uas: int, size: int) -> float:
        """Steps that at most so many UAS take together for so many of the farthest waypoints."""
        if not size:
            return 0.0
        if (uas, size) not in self._time:
            cost = self._cost(self._steps_turning)
            inside = np.flatnonzero(self._farthest(size))
            nodes = np.append(inside, np.arange(len(cost), cost.shape[1]))
            part = cost[np.ix_(inside, nodes, nodes)]
            self._time[uas, size] = least_routes(part, most=uas)
        return self._time[uas, size]

    @cached_property
    def _order(self) -> NDArray[np.int64]:
        """(W,) the waypoints, that farthest from all homes first."""
        way_m = self._places.waypoints_m[:, None] - self._places.homes_m
        return np.argsort(-np.linalg.norm(way_m, axis=2).min(axis=1), kind="stable")

    def _farthest(self, size: int) -> NDArray[np.bool_]:
        inside = np.zeros(len(self._order), dtype=bool)
        inside[self._order[:size]] = True
        return inside

    @cached_property
    def _prices_turning(self) -> Turning:
        ends = self._ends
        return turning_of_fleet(self._vehicles, ends.dt_s, self._prices, ends.landing_speed_mps)

    @cached_property
    def _steps_turning(self) -> Turning:
        ends = self._ends
        return turning_of_fleet(self._vehicles, ends.dt_s, STEPS, ends.landing_speed_mps)

    @cached_property
    def _legs(self) -> LegBounds:
        turning = self._steps_turning
        return legs_between(self._places, turning.reach_m, turning.reach_from_rest_m)

    @cached_property
    def _carried(self) -> Carried | None:
        """Where the velocity between waypoints has a price; None: several kinds of vehicles."""
        if len(set(self._vehicles)) > 1:
            return None
        turning, reach_m = self._prices_turning, self._prices_turning.reach_m
        prices, step_m = self._prices, float(reach_m[1])
        costs = Costs(prices.step, prices.mps, prices.rad, turning.per_m, step_m, self._across_m)
        legs = steps_to_middles(self._legs, reach_m, step_m)
        passing = Passing(motion_of(self._vehicles[0], self._ends.dt_s), costs)
        return Carried(legs, passing, turning, reach_m)

    def _cost(self, turning: Turning) -> FloatArray:
        return triples(self._legs, turning)


@lru_cache(maxsize=256)
def bound_of(scenario: Scenario) -> MissionBound | None:
    """The bound of a mission; None where there is none."""
    try:
        return MissionBound(scenario)
    except ValueError:
        return None


def _why_not(scenario: Scenario) -> str:
    if scenario.sorties is not None and not scenario.sorties.together:
        return "as its UAS swap packs on their own"
    if scenario.wind is not None or scenario.disturbances:
        return "the air is not still, or something else acts on the UAS"
    if len(scenario.waypoints) > MOST_WAYPOINTS:
        return f"it has more than {MOST_WAYPOINTS} waypoints"
    return ""


def _places(scenario: Scenario) -> Places:
    """Waypoints that a UAS may touch while it stands or lands are left out: they may be free."""
    waypoints_m = np.array([one.position_m[:2] for one in scenario.waypoints]).reshape(-1, 2)
    radii_m = np.array([one.radius_m for one in scenario.waypoints])
    starts_m = np.array([uas.start_m[:2] for uas in scenario.uas])
    homes_m = np.array([uas.home_m[:2] for uas in scenario.uas])
    ends_m = np.concatenate([starts_m, homes_m])
    away_m = np.linalg.norm(waypoints_m[:, None] - ends_m, axis=2).min(axis=1)
    kept = away_m > radii_m + scenario.landing_distance_m
    return Places(waypoints_m[kept], radii_m[kept], starts_m, homes_m, scenario.landing_distance_m)

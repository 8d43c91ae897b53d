"""Do the batteries suffice? A rough plan that any fleet could fly: back and forth, row by row.

The plan bounds from above what a mission takes: a sensible planner needs less. Legs that an
obstacle blocks are flown over the top of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.scenario.unchecked import UncheckedScenario
from uas_coverage_env.vehicle.range import (
    SpeedLimits,
    TravelTimeModel,
    level_seconds,
    seconds_until,
    speeds_of,
    vertical_seconds,
)

GENERATED = TravelTimeModel(speed_share=0.85, landing_s=3.0)
"""Of generated scenarios, and of the warning of batteries too small; the landing's time is that of
a take-off, too. Chosen by hand: it determines the batteries of generated scenarios, which keep
their seeds."""

# Power on the way, relative to hovering: drag at speed, climbs and turns.
_POWER = 1.11


@dataclass(frozen=True)
class RoughPlan:
    """What each UAS has to fly when the waypoints are visited back and forth.

    Attributes:
        flight_s: (U,) time in the air [s].
        air_time_s: (U,) time in the air that the battery allows [s].
        complete: Whether every waypoint has been given to a UAS whose battery allows it.
    """

    flight_s: NDArray[np.float64]
    air_time_s: NDArray[np.float64]
    complete: bool

    @property
    def makespan_s(self) -> float:
        """When the last UAS is home [s]."""
        return float(self.flight_s.max())


def back_and_forth(scenario: UncheckedScenario, spare: float = 0.0) -> RoughPlan:
    """Visit the waypoints row by row, split into one run per UAS of about equal time.

    Args:
        scenario: The mission.
        spare: Share of every battery that the plan must leave [-].

    Returns:
        The quickest of the plans tried that the batteries allow; where they allow none, the plan
        of a fleet with endless batteries, marked as not complete. Waypoints that the same UAS can
        cover are shared out among these; a UAS then flies all its runs one after the other.
    """
    if scenario.can_cover.all():
        return _shared_among_all(scenario, spare)
    n_uas = len(scenario.uas)
    flight_s, air_time_s, complete = np.zeros(n_uas), np.zeros(n_uas), True
    for team in np.unique(scenario.can_cover, axis=1).T:
        what = np.flatnonzero((scenario.can_cover == team[:, None]).all(axis=0))
        if team.any():  # the others are warned of elsewhere
            plan = _shared_among_all(_part_of(scenario, np.flatnonzero(team), what), spare)
            flight_s[team] += plan.flight_s
            air_time_s[team] = plan.air_time_s
            complete = complete and plan.complete
    complete = complete and bool((flight_s <= air_time_s * (1.0 - spare)).all())
    return RoughPlan(flight_s, air_time_s, complete)


def _part_of(
    scenario: UncheckedScenario, uas: NDArray[np.intp], waypoints: NDArray[np.intp]
) -> UncheckedScenario:
    """The mission of some UAS and waypoints."""
    known = {name: getattr(scenario, name) for name in UncheckedScenario.model_fields}
    known["uas"] = tuple(scenario.uas[u] for u in uas)
    known["waypoints"] = tuple(scenario.waypoints[w] for w in waypoints)
    part = UncheckedScenario.model_construct(**known)
    vars(part)["vehicles"] = tuple(scenario.vehicles[u] for u in uas)
    return part


def _shared_among_all(scenario: UncheckedScenario, spare: float) -> RoughPlan:
    """The plan of UAS that can cover all waypoints."""
    waypoints = np.array([waypoint.position_m for waypoint in scenario.waypoints])
    starts = np.array([uas.start_m for uas in scenario.uas])
    homes = np.array([uas.home_m for uas in scenario.uas])
    air_time_s = np.array(
        [
            seconds_until(vehicle, 1.0 - uas.soc_0, dod, _POWER * vehicle.power.hover_W)
            for vehicle, uas, dod in zip(
                scenario.vehicles, scenario.uas, scenario.dod_landed, strict=True
            )
        ]
    )
    legs = _Legs(scenario)
    limits_s = air_time_s * (1.0 - spare)
    ends = _Ends.of(legs, starts, homes, waypoints)
    runs = [_Runs(legs, waypoints[order], ends.through(order)) for order in _orders(waypoints)]
    plans = [flight_s for run in runs if (flight_s := run.balanced(limits_s)) is not None]
    if (starts != homes).any():
        along_s = _flown_along_ways(_Legs(scenario, around=True), starts, homes, waypoints)
        plans += [along_s] if (along_s <= limits_s).all() else []
    complete = bool(plans)
    if not complete:
        endless = np.full(len(starts), math.inf)
        plans = [flight_s for run in runs if (flight_s := run.balanced(endless)) is not None]
    return RoughPlan(min(plans, key=lambda flight_s: flight_s.max()), air_time_s, complete)


def along_ways(
    starts_m: NDArray[np.float64],
    homes_m: NDArray[np.float64],
    waypoints_m: NDArray[np.float64],
    can_cover: NDArray[np.bool_],
) -> list[list[int]]:
    """Each waypoint on the way, from start to home, that it lengthens the least, in that order.

    Args:
        starts_m: (U, 3) [m].
        homes_m: (U, 3) [m].
        waypoints_m: (W, 3) [m].
        can_cover: (U, W) which UAS may cover which waypoint.

    Returns:
        Waypoints of each UAS; of none those that no UAS may cover.
    """
    there_m, back_m = (
        np.linalg.norm(ends_m[:, None] - waypoints_m, axis=2) for ends_m in (starts_m, homes_m)
    )
    ways_m = homes_m - starts_m
    longer_m = there_m + back_m - np.linalg.norm(ways_m, axis=1)[:, None]
    taker = np.where(can_cover, longer_m, np.inf).argmin(axis=0)
    runs = []
    for uas, way_m in enumerate(ways_m):
        mine = np.flatnonzero((taker == uas) & can_cover[uas])
        runs.append(mine[np.argsort(waypoints_m[mine] @ way_m, kind="stable")].tolist())
    return runs


def _flown_along_ways(
    legs: _Legs,
    starts: NDArray[np.float64],
    homes: NDArray[np.float64],
    waypoints: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(U,) flight times of `along_ways` of UAS that can cover all; places (N, 3) [m]."""
    ends = _Ends.of(legs, starts, homes, waypoints)
    flight_s = np.where(ends.idle_s > 0.0, ends.idle_s + 2.0 * GENERATED.landing_s, 0.0)
    everyone = np.ones(ends.out_s.shape, np.bool_)
    for uas, run in enumerate(along_ways(starts, homes, waypoints, everyone)):
        if run:
            between_s = legs.between(waypoints[run[:-1]], waypoints[run[1:]]).there_s
            flight_s[uas] = ends.out_s[uas, run[0]] + between_s.sum() + ends.home_s[uas, run[-1]]
            flight_s[uas] += 2.0 * GENERATED.landing_s
    return flight_s


class _Legs:
    """Flight times between points: straight where that is free, else over the obstacles.

    Args:
        scenario: The mission.
        around: Whether ways lead round what reaches up to the ceiling; otherwise over it, too.
    """

    def __init__(self, scenario: UncheckedScenario, *, around: bool = False) -> None:
        ceiling_m = scenario.fence.vertices_m[:, 2].min() + scenario.geofence.margin_m
        self.over_m = ceiling_m if around else -math.inf
        slowest = np.min([speeds_of(vehicle) for vehicle in scenario.vehicles], axis=0)
        self.speeds = SpeedLimits(*slowest.tolist())
        radius_m = max(uas.radius_m for uas in scenario.uas)
        kept_m = [radius_m + obstacle.safe_distance_m for obstacle in scenario.obstacles]
        corners = [hull.vertices_m for hull in scenario.hulls]
        self.boxes = [
            (points.min(axis=0) - kept, points.max(axis=0) + kept)
            for points, kept in zip(corners, kept_m, strict=True)
        ]

    def between(self, start_m: NDArray[np.float64], end_m: NDArray[np.float64]) -> _Times:
        """Flight times from start_m (..., 3) to end_m (..., 3), broadcast together, and back."""
        way = end_m - start_m
        start_m = end_m - way
        way_m = np.hypot(way[..., 0], way[..., 1])
        top_m = np.full(way.shape[:-1], -np.inf)
        for low, high in self.boxes:
            hit = _meets_box(start_m, way, low, high)
            if low[2] < self.over_m:
                way_m = np.where(hit, way_m + _round_m(start_m, end_m, low, high), way_m)
                continue
            top_m = np.where(hit, np.maximum(top_m, -low[2]), top_m)
        ground_s = level_seconds(GENERATED, self.speeds, way_m)
        before_m, after_m = top_m + start_m[..., 2], top_m + end_m[..., 2]
        return _Times(
            there_s=np.maximum(
                np.maximum(ground_s, self._vertical_s(-way[..., 2], way[..., 2])),
                ground_s + self._vertical_s(before_m, after_m),
            ),
            back_s=np.maximum(
                np.maximum(ground_s, self._vertical_s(way[..., 2], -way[..., 2])),
                ground_s + self._vertical_s(after_m, before_m),
            ),
        )

    def _vertical_s(self, climb_m: NDArray, sink_m: NDArray) -> NDArray:
        return vertical_seconds(self.speeds, np.maximum(climb_m, 0.0), np.maximum(sink_m, 0.0))


@dataclass(frozen=True)
class _Times:
    """Flight times of legs and of the same legs flown back (..., W) [s]."""

    there_s: NDArray[np.float64]
    back_s: NDArray[np.float64]


@dataclass(frozen=True)
class _Ends:
    """Flight times (U, W) from starts to waypoints and from there home, and (U,) without any."""

    out_s: NDArray[np.float64]
    home_s: NDArray[np.float64]
    idle_s: NDArray[np.float64]

    @classmethod
    def of(cls, legs: _Legs, starts: NDArray, homes: NDArray, waypoints: NDArray) -> _Ends:
        """Those between places (U, 3), (U, 3) and (W, 3) [m]."""
        stays = (starts == homes).all(axis=1)
        return cls(
            out_s=legs.between(starts[:, None], waypoints[None]).there_s,
            home_s=legs.between(homes[:, None], waypoints[None]).back_s,
            idle_s=np.where(stays, 0.0, legs.between(starts, homes).there_s),
        )

    def through(self, order: NDArray[np.intp]) -> _Ends:
        """The same with the waypoints in another order."""
        return _Ends(self.out_s[:, order], self.home_s[:, order], self.idle_s)


def _meets_box(start_m: NDArray, way: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """(...) Whether the segments start_m + [0, 1] way enter an upright box."""
    enters: NDArray | float = 0.0
    leaves: NDArray | float = 1.0
    for axis in range(3):
        start, step = start_m[..., axis], way[..., axis]
        # along a wall, a tiny step keeps the quotients finite and their order right
        per_step = 1.0 / np.where(np.abs(step) < 1e-12, 1e-12, step)
        one, other = (low[axis] - start) * per_step, (high[axis] - start) * per_step
        enters = np.maximum(enters, np.minimum(one, other))
        leaves = np.minimum(leaves, np.maximum(one, other))
    return np.less(enters, leaves)


def _round_m(start_m: NDArray, end_m: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """(...) By how much the shortest way along one side of an upright box is longer, level [m]."""
    corners = [np.array([n, e]) for n, e in ((low[0], low[1]), (low[0], high[1]),
                                             (high[0], high[1]), (high[0], low[1]))]  # fmt: skip
    start, end = start_m[..., :2], end_m[..., :2]
    before, after = (
        np.stack([np.linalg.norm(corner - place, axis=-1) for corner in corners])
        for place in (start, end)
    )
    sides = [(a, b) for k in range(4) for a, b in ((k, (k + 1) % 4), ((k + 1) % 4, k))]
    round_m = np.min(
        [before[a] + np.linalg.norm(corners[b] - corners[a]) + after[b] for a, b in sides], axis=0
    )
    return round_m - np.linalg.norm(end - start, axis=-1)


def _orders(waypoints: NDArray[np.float64]) -> list[NDArray[np.intp]]:
    """Back and forth along rows to the north and to the east, each from both ends."""
    orders = []
    for across, along in ((0, 1), (1, 0)):
        size = np.ptp(waypoints[:, :2], axis=0) + 1.0
        n_rows = max(1, round(math.sqrt(len(waypoints) * size[across] / size[along])))
        share = (waypoints[:, across] - waypoints[:, across].min()) / size[across]
        row = np.minimum((share * n_rows).astype(int), n_rows - 1)
        order = np.lexsort([waypoints[:, along] * (1 - 2 * (row % 2)), row])
        orders += [order, order[::-1]]
    return orders


class _Runs:
    """An order of waypoints that is cut into one run per UAS."""

    def __init__(self, legs: _Legs, route: NDArray[np.float64], ends: _Ends) -> None:
        between_s = legs.between(route[:-1], route[1:]).there_s
        self.at_s = np.concatenate([[0.0], np.cumsum(between_s)])
        self.out_s = ends.out_s + GENERATED.landing_s
        self.home_s = ends.home_s + GENERATED.landing_s
        # a UAS that lands elsewhere flies, whether it has a run or not
        self.idle_s = np.where(ends.idle_s > 0.0, ends.idle_s + 2.0 * GENERATED.landing_s, 0.0)

    def balanced(self, limits_s: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """(U,) flight times with the smallest largest one; None where the limits allow none."""
        best = self._greedy(limits_s)
        if best is None:
            return None
        low, high = 0.0, float(best.max())
        while high - low > 1.0:
            middle = 0.5 * (low + high)
            found = self._greedy(np.minimum(limits_s, middle))
            if found is None:
                low = middle
            else:
                best, high = found, middle
        return best

    def _greedy(self, limits_s: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Give each UAS the longest run that its limit allows."""
        flight_s = self.idle_s.copy()
        first = 0
        for uas, limit_s in enumerate(limits_s):
            if first == len(self.at_s):
                break
            run_s = self.at_s[first:] - self.at_s[first] + self.home_s[uas, first:]
            run_s += self.out_s[uas, first]
            too_long = run_s > limit_s
            length = int(np.argmax(too_long)) if too_long.any() else len(run_s)
            if length:
                flight_s[uas] = run_s[length - 1]
                first += length
        complete = first == len(self.at_s) and (self.idle_s <= limits_s).all()
        return flight_s if complete else None

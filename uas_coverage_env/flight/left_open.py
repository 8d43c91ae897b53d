"""Why waypoints are left open at the end of a flight: decided here, for all planners alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight.record import LANDED, LOST, FlightRecord, LeftOpen, Why
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.mission import Access, MissionBrief, Range, Ways
from uas_coverage_env.scenario import out_of_reach
from uas_coverage_env.vehicle import DOD, N_STATES, dod_per_s

FloatArray = NDArray[np.float64]


def left_open(flight: FlightRecord, said: Mapping[int, str] | None = None) -> tuple[LeftOpen, ...]:
    """What a flight has left open, and why.

    Charge and time are those of flights at full speed in still air, home with return mode's margin.

    Args:
        flight: The flight.
        said: What the planner says about waypoints that it has given up, by their number.
    """
    history = SceneHistory.of(flight)
    waypoints = np.flatnonzero(history.open_at_end).tolist()
    if not waypoints:
        return ()
    end = _End(flight, history)
    return tuple(LeftOpen(w, *end.why(w, (said or {}).get(w, ""))) for w in waypoints)


@dataclass(frozen=True)
class _Trip:
    """To a waypoint and home again.

    Attributes:
        uas: Which UAS.
        takes_s: How long it takes.
        spare_s: What the charge gives beyond that; negative: it does not last.
    """

    uas: int
    takes_s: float
    spare_s: float

    @property
    def lasts_s(self) -> float:
        """How long the charge lasts."""
        return self.takes_s + self.spare_s


class _End:
    """How a flight has ended, and what each UAS could still do then."""

    def __init__(self, flight: FlightRecord, history: SceneHistory) -> None:
        self._flight, self._scenario = flight, history.scenario
        self._brief = MissionBrief.of(self._scenario)
        self._ways, self._range, self._access = (
            make(self._brief) for make in (Ways, Range, Access)
        )
        self._closed_in = set(out_of_reach(self._scenario, 0.0))
        self._lost = flight.mode[-1] == LOST
        self._in_the_air = flight.mode[-1] < LANDED
        self._moving_m = history.moving_position_m[-1]

    def why(self, w: int, said: str) -> tuple[Why, str]:
        """Why a waypoint was left open, and the same in a line."""
        brief, names = self._brief, self._flight.names
        carriers = np.flatnonzero(brief.can_cover[:, w])
        if not len(carriers):
            return Why.NO_SENSOR, f"no UAS carries {brief.waypoints[w].sensor!r}"
        if w in self._closed_in:
            return Why.NO_ROOM, "no part of its sphere keeps all safe distances"
        able = carriers[self._access.has_way[carriers, w]]
        if not len(able):
            return Why.NO_WAY, self._access.why_closed(int(carriers[0]), w)
        trips = [self._from_start(u, w) for u in able.tolist()]
        best = max(trips, key=lambda trip: trip.spare_s)
        if best.spare_s < 0.0:
            return Why.TOO_FAR, _too_long(names[best.uas], best, "")
        left = able[~self._lost[able]].tolist()
        if not left:
            return Why.LOST, f"{', '.join(names[u] for u in able)} could have covered it"
        trips = [self._from_end(u, w) for u in left]
        best = max(trips, key=lambda trip: trip.spare_s)
        if best.spare_s < 0.0:
            return Why.CHARGE, _too_long(names[best.uas], best, " that was left")
        trips = [trip for trip in trips if trip.spare_s >= 0.0]
        in_time = [trip for trip in trips if trip.takes_s <= self._clock_s(trip.uas)]
        if not in_time:
            best = min(trips, key=lambda trip: trip.takes_s - self._clock_s(trip.uas))
            left_s = self._clock_s(best.uas)
            return Why.TIME, f"there and home takes {best.takes_s:.0f} s, {left_s:.0f} s were left"
        flying = [trip for trip in in_time if self._in_the_air[trip.uas]]
        if flying:
            limit = "by hand" if self._flight.ended == "stopped" else "at its limit of steps"
            return Why.ENDED, f"{limit}, with {names[flying[0].uas]} in the air"
        if closed_by := self._blocked_by(w):
            return Why.BLOCKED, f"{closed_by} kept it closed in the end"
        best = max(in_time, key=lambda trip: trip.spare_s)
        what = f"{names[best.uas]} landed with charge for {best.lasts_s:.0f} s, there and home"
        return Why.PLANNER, f"{what} takes {best.takes_s:.0f} s{f'; {said}' if said else ''}"

    def _from_start(self, uas: int, w: int) -> _Trip:
        start = self._flight.scenario.uas[uas]
        return self._trip(uas, w, np.array(start.start_m, float), 1.0 - start.soc_0)

    def _from_end(self, uas: int, w: int) -> _Trip:
        x = self._flight.x[-1, uas]
        return self._trip(uas, w, x[:3], float(x[DOD]))

    def _trip(self, uas: int, w: int, place_m: FloatArray, dod: float) -> _Trip:
        per_s = dod_per_s(self._brief.vehicles[uas], self._brief.uas[uas].dod_max)
        there_s = self._ways.seconds(uas, w, place_m)
        x = np.zeros(N_STATES)
        x[:3], x[DOD] = self._brief.waypoints[w].position_m, dod + per_s * there_s
        home = self._range.home(uas, x)
        takes_s = there_s + home.time_s + home.time_margin_s
        return _Trip(uas, takes_s, self._range.spare_dod(uas, x) / per_s)

    def _clock_s(self, uas: int) -> float:
        """Time of the mission that was left when a UAS had landed, or at the end [s]."""
        steps = self._scenario.max_steps - int(self._flight.last_sample[uas])
        return steps * self._scenario.dt_s

    def _blocked_by(self, w: int) -> str:
        place_m = np.array(self._scenario.waypoints[w].position_m, float)
        radius_m = max(uas.radius_m for uas in self._scenario.uas)
        for moving, centre_m in zip(self._scenario.moving_obstacles, self._moving_m, strict=True):
            north_m, east_m, down_m = (place_m - centre_m).tolist()
            keep_m = moving.safe_distance_m + radius_m
            if (
                np.hypot(north_m, east_m) < moving.radius_m + keep_m
                and abs(down_m) < 0.5 * moving.height_m + keep_m
            ):
                return moving.name
        return ""


def _too_long(name: str, trip: _Trip, which: str) -> str:
    return (
        f"there and home takes {name} {trip.takes_s:.0f} s, its charge{which} lasts "
        f"{max(trip.lasts_s, 0.0):.0f} s"
    )

"""Flights of the coming half minute in a wind, planned for the UAS that `tour` steers.

The program of still air plans over ground in the wind that has been learnt (`in_wind`). Its model
is off by turbulence in every step, so what is far away is not worth planning: a flight visits the
next waypoints only, and ends at the one after them. It is solved again in every step from where
the UAS is, with the same visits, a step or two later where that is necessary; it is planned anew
where that fails, and after each waypoint.

The inner loop asks for -gain · (v - r, tilt - trim · r, rate). Told the velocity r for which that
is the planned angular acceleration, it flies as planned, within the governor's bounds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.flight_model import (
    DOWN,
    EAST,
    NORTH,
    V_DOWN,
    flight_model,
    in_wind,
    reduced_state,
)
from uas_coverage_baselines.trajectory.program import Air, FlightProgram, Landing, PlannedFlight
from uas_coverage_baselines.trajectory.retiming import draft, finished, retimed, shorten
from uas_coverage_baselines.trajectory.work import done
from uas_coverage_env.autopilot.belief import wind_growth
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.learnt_wind import MEAN_HEIGHT_M, LearntWind
from uas_coverage_env.vehicle.governor import ON_RATE, ON_SPEED, ON_TILT, design_velocity_loop
from uas_coverage_env.world import Arena

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_AHEAD = 6  # waypoints that a flight visits before it ends at the next
_PROGRAMS = 80  # solved for a new flight, at most
_PROGRAMS_AGAIN = 4  # to make a flight that is followed shorter
_LATER = (0, 1, 2)  # steps
_AGAIN_S = 3.0  # where no flight was found, another is looked for after this time
_TUBE_S = 3.0  # flights keep so much more from obstacles as turbulence leads off in this time
_KEPT_BACK = 0.02  # share of the limits that is left to what the model does not know
_MEAN_SHARE = 0.5  # of the mean wind of the fleet in what is planned with: gusts pass
_INSIDE_M, _INSIDE_SHARE = 1.5, 0.15  # of a waypoint's radius, at most, that flights visit within
_INSIDE_SOON_M, _INSIDE_PER_STEP_M = 0.1, 0.3  # less is kept of a visit that is near


@dataclass(frozen=True)
class _Ahead:
    """The flight that a UAS follows.

    Attributes:
        route: (K,) waypoints that it visits.
        end: The waypoint at which it ends; -1: it lands.
        flight: From the present sample.
    """

    route: IntArray
    end: int
    flight: PlannedFlight


class Lead:
    """Plans flights ahead along the routes of a fleet, and commands what flies them.

    Args:
        brief: The mission.
        arena: The same as arrays, with tubes.
        margin_m: Planned beyond the distances that count as a breach.
    """

    def __init__(self, brief: MissionBrief, arena: Arena, margin_m: float) -> None:
        self._dt_s, self._arena = brief.dt_s, arena
        step = min(round(_TUBE_S / brief.dt_s), arena.tube_m.shape[1] - 1)
        self._fleet = Fleet(brief, margin_m + float(arena.tube_m[:, step].max()))
        self._loops = [design_velocity_loop(vehicle, brief.dt_s) for vehicle in brief.vehicles]
        self._again = max(round(_AGAIN_S / brief.dt_s), 1)
        self._ahead: dict[int, _Ahead] = {}
        self._failed: dict[int, tuple[bytes, int]] = {}

    def commands(
        self, uas: int, step: int, x: FloatArray, route: IntArray, learnt: LearntWind, n_steps: int
    ) -> FloatArray | None:
        """What flies a UAS along its route; None: no flight was found.

        Args:
            uas: Index of the UAS.
            step: Number of the sample.
            x: (14,) its state.
            route: (K,) waypoints that it is to visit before it lands.
            learnt: The wind.
            n_steps: N.

        Returns:
            (N, 3) velocities over ground, north and east [m/s], and altitudes [m].
        """
        own_mps = learnt.wind_mps[uas]
        mean_mps = learnt.mean_mps * wind_growth(-float(x[2]), MEAN_HEIGHT_M)
        wind_mps = (1.0 - _MEAN_SHARE) * own_mps + _MEAN_SHARE * mean_mps
        start = reduced_state(x)
        ahead = self._followed(uas, start, route, wind_mps)
        if ahead is None:
            ahead = self._planned(uas, step, start, route, wind_mps)
        if ahead is None:
            self._ahead.pop(uas, None)
            return None
        self._ahead[uas] = ahead
        return self._flying(uas, ahead.flight, own_mps, n_steps)

    def _program(
        self, uas: int, start: FloatArray, end: int, wind_mps: FloatArray, inside_m: FloatArray
    ) -> FlightProgram:
        """Flights that end at a waypoint, or land; `inside_m` (W,) is kept of the radii."""
        fleet, vehicle = self._fleet, self._arena.vehicles[uas]
        program = fleet.programs[uas]
        radius_m = fleet.radius_m - inside_m
        landing = program.landing
        if end >= 0:
            fast_mps = 2.0 * float(vehicle.v_xy_max_mps)
            landing = Landing(fleet.waypoints_m[end], float(radius_m[end]), fast_mps)
        model = in_wind(flight_model(vehicle, _KEPT_BACK), wind_mps)
        air = Air(np.append(wind_mps, 0.0), float(vehicle.v_xy_max_mps))
        return replace(
            program,
            model=model,
            landing=landing,
            radius_m=radius_m,
            air=air,
            solved=0,
        )

    @property
    def _inside_m(self) -> FloatArray:
        """(W,) how far inside their spheres visits far ahead are planned."""
        return np.minimum(_INSIDE_M, _INSIDE_SHARE * self._fleet.radius_m)

    def _followed(
        self, uas: int, start: FloatArray, route: IntArray, wind_mps: FloatArray
    ) -> _Ahead | None:
        """The flight of the step before from here; None where another is to be planned."""
        before = self._ahead.get(uas)
        if before is None or before.flight.steps < 2:
            return None
        kept = np.flatnonzero(np.isin(before.route, route))
        rest, left = before.route[kept], before.flight.after(1, kept)
        n = len(rest)
        end = int(route[n]) if n < len(route) else -1
        if not np.array_equal(rest, route[:n]) or end != before.end:
            return None
        if n < min(_AHEAD, len(route)):  # one has been visited: the flight may go on farther
            return None
        visits = np.maximum(left.visits, 1)
        inside_m = self._inside_m
        soon_m = _INSIDE_SOON_M + _INSIDE_PER_STEP_M * (visits - 1)
        inside_m[rest] = np.minimum(inside_m[rest], soon_m)
        program = self._program(uas, start, end, wind_mps, inside_m)
        left = replace(left, visits=visits)
        for later in _LATER:
            new = retimed(program, start, rest, left, visits + later, left.steps + later)
            if new.is_clear:
                until = program.solved + _PROGRAMS_AGAIN
                return _Ahead(rest, end, done(shorten(program, start, rest, new, until)))
        return None

    def _planned(
        self, uas: int, step: int, start: FloatArray, route: IntArray, wind_mps: FloatArray
    ) -> _Ahead | None:
        """A new flight; None where none is found, or none was found along this route just now."""
        key = route.tobytes()
        if uas in self._failed:
            of, at = self._failed[uas]
            if of == key and step < at + self._again:
                return None
        ahead = route[:_AHEAD]
        end = int(route[_AHEAD]) if len(route) > _AHEAD else -1
        program = self._program(uas, start, end, wind_mps, self._inside_m)
        begun = done(draft(program, self._fleet.terrain, uas, start, ahead, _PROGRAMS))
        flight = done(finished(program, start, ahead, begun))
        if not flight.is_clear:
            self._failed[uas] = key, step
            return None
        return _Ahead(ahead.copy(), end, flight)

    def _flying(
        self, uas: int, flight: PlannedFlight, wind_mps: FloatArray, n_steps: int
    ) -> FloatArray:
        """(N, 3) commands that lead to the angular accelerations and the heights of a flight."""
        gain, trim = self._loops[uas].gain, float(self._arena.vehicles[uas].trim_rad_per_mps)
        n = min(n_steps, flight.steps)
        wanted = np.zeros((n_steps, 3))
        wanted[:, 2] = -flight.x[-1, DOWN]
        for axis, first in enumerate((NORTH, EAST)):
            speed, tilt, rate = flight.x[:n, first + 1 : first + 4].T
            asked = flight.u[:n, axis] + gain[ON_SPEED] * (speed - wind_mps[axis])
            asked += gain[ON_TILT] * tilt + gain[ON_RATE] * rate
            wanted[:n, axis] = wind_mps[axis] + asked / (gain[ON_SPEED] + trim * gain[ON_TILT])
        # the inner loop stops at an altitude: that of the planned climb is half a step farther
        after = flight.x[1 : n + 1]
        wanted[:n, 2] = -after[:, DOWN] - 0.5 * self._dt_s * after[:, V_DOWN]
        return wanted

"""Why waypoints are left open at the end of a flight: decided here, for all planners alike."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight.record import LANDED, LOST, FlightRecord, LeftOpen, Why
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.access import Access
from uas_coverage_env.mission.errands import Errand, Errands
from uas_coverage_env.scenario.checks import out_of_reach
from uas_coverage_env.vehicle.layout import DOD

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


class _End:
    """How a flight has ended, and what each UAS could still do then."""

    def __init__(self, flight: FlightRecord, history: SceneHistory) -> None:
        self._flight, self._scenario = flight, history.scenario
        self._brief = MissionBrief.of(self._scenario)
        self._errands, self._access = Errands(self._brief), Access(self._brief)
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
        best = max((self._from_start(u, w) for u in able.tolist()), key=_spare_s)
        if best.spare_s < 0.0:
            return Why.TOO_FAR, too_long(best)
        left = able[~self._lost[able]].tolist()
        if not left:
            return Why.LOST, f"{', '.join(names[u] for u in able)} could have covered it"
        errands = {u: self._from_end(u, w) for u in left}
        best = max(errands.values(), key=_spare_s)
        if best.spare_s < 0.0:
            return Why.CHARGE, too_long(best, " that was left")
        lasting = {u: errand for u, errand in errands.items() if errand.spare_s >= 0.0}
        late_s = {u: errand.takes_s - self._clock_s(u) for u, errand in lasting.items()}
        u = min(late_s, key=lambda u: late_s[u])
        if late_s[u] > 0.0:
            takes_s, left_s = lasting[u].takes_s, self._clock_s(u)
            return Why.TIME, f"there and home takes {takes_s:.0f} s, {left_s:.0f} s were left"
        in_time = [u for u in lasting if late_s[u] <= 0.0]
        flying = [names[u] for u in in_time if self._in_the_air[u]]
        if flying:
            how = "by hand" if self._flight.ended == "stopped" else "at its limit of steps"
            return Why.ENDED, f"{how}, with {flying[0]} in the air"
        if closed_by := self._blocked_by(w):
            return Why.BLOCKED, f"{closed_by} kept it closed in the end"
        best = max((lasting[u] for u in in_time), key=_spare_s)
        what = f"{best.name} landed with charge for {best.lasts_s:.0f} s, there and home"
        return Why.PLANNER, f"{what} takes {best.takes_s:.0f} s{f'; {said}' if said else ''}"

    def _from_start(self, uas: int, w: int) -> Errand:
        start = self._flight.scenario.uas[uas]
        return self._errands.to(uas, w, np.array(start.start_m, float), 1.0 - start.soc_0)

    def _from_end(self, uas: int, w: int) -> Errand:
        x = self._flight.x[-1, uas]
        return self._errands.to(uas, w, x[:3], float(x[DOD]))

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


def _spare_s(errand: Errand) -> float:
    return errand.spare_s


def too_long(errand: Errand, which: str = "") -> str:
    """That the charge of a UAS does not last, in figures.

    Args:
        errand: That it does not last for.
        which: Which charge.
    """
    return (
        f"there and home takes {errand.name} {errand.takes_s:.0f} s, its charge{which} lasts "
        f"{errand.lasts_s:.0f} s"
    )

"""When a UAS returns, and which waypoints are too far for it: DoD_r (Sec. III-C.6, return mode)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.blocks.battery_reserve import settling_s
from uas_coverage_env.entities.commands import HOME
from uas_coverage_env.mission import MissionBrief, Ways
from uas_coverage_env.vehicle.params import return_threshold
from uas_coverage_env.vehicle.range import ROUTED, dod_per_s, flight_seconds, speeds_of

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class ReturnRule:
    """D_r,max, the overestimated way home: by a waypoint that is left, past what stands in the way.

    A UAS returns once its charge allows no open waypoint and the way home from it. What the plan's
    end holds back (`BatteryReserve`) is held back here, too, so that a plan may cover what is
    flown to.

    Args:
        brief: the mission.
        detours: of each UAS over the quickest way to a waypoint and home; None: D_r,max is that of
            the vehicle file, wherever the waypoints are.
        ways: past the fixed obstacles; where None, ways are straight.
    """

    def __init__(
        self, brief: MissionBrief, detours: Sequence[float | None], ways: Ways | None
    ) -> None:
        self._detours, self._ways = tuple(detours), ways
        self._row = {uas.name: row for row, uas in enumerate(brief.uas)}
        self._vehicles = brief.vehicles
        self._settling_s = [settling_s(vehicle, brief.dt_s) for vehicle in brief.vehicles]
        self._speeds = [speeds_of(vehicle) for vehicle in brief.vehicles]
        self._dod_max = np.array(brief.dod_landed)
        self._dod_per_s = np.array(
            [
                dod_per_s(vehicle, dod)
                for vehicle, dod in zip(brief.vehicles, brief.dod_landed, strict=True)
            ]
        )
        self._waypoints_m = np.array([w.position_m for w in brief.waypoints], float)
        self._homes_m = np.array([uas.home_m for uas in brief.uas], float)
        self._home_s = np.zeros((len(brief.uas), len(brief.waypoints)))
        for uas, (detour, home_s) in enumerate(zip(self._detours, self._home_s, strict=True)):
            if detour is not None:
                home_s[:] = [self._seconds(uas, HOME, place_m) for place_m in self._waypoints_m]

    def __str__(self) -> str:
        """What is kept back, in a few words."""
        detours = [detour for detour in self._detours if detour is not None]
        if not detours:
            return "the vehicle file's return_rule"
        settling_s = max(self._settling_s)
        return f"{max(detours):g} times the way to a waypoint and home, and {settling_s:g} s"

    def dod_return(self, name: str, position_m: FloatArray, uncovered: BoolArray) -> float:
        """DoD_r of a UAS.

        Args:
            name: of the UAS.
            position_m: (3,) where it is.
            uncovered: (K,) the open waypoints.
        """
        uas = self._row[name]
        if self._detours[uas] is None or not uncovered.any():
            return return_threshold(self._vehicles[uas], float(self._dod_max[uas]))
        return self._dod_before(uas, self._least_s(uas, position_m, np.flatnonzero(uncovered)))

    def beyond(
        self, name: str, position_m: FloatArray, dod: float, uncovered: BoolArray
    ) -> set[int]:
        """The open waypoints from which its charge would not bring a UAS home.

        Args:
            name: of the UAS.
            position_m: (3,) where it is.
            dod: its depth of discharge.
            uncovered: (K,) the open waypoints.
        """
        uas, open_now = self._row[name], np.flatnonzero(uncovered)
        if self._detours[uas] is None or not len(open_now):
            return set()
        # by way of home none takes longer
        longest_s = self._seconds(uas, HOME, position_m) + 2.0 * self._home_s[uas, open_now].max()
        if dod < self._dod_before(uas, longest_s):
            return set()
        return {
            w
            for w in open_now.tolist()
            if dod >= self._dod_before(uas, self._by(uas, w, position_m))
        }

    def _dod_before(self, uas: int, seconds: float) -> float:
        """The depth of discharge at which so long a flight home is due."""
        detour = self._detours[uas]
        assert detour is not None
        due_s = detour * seconds + self._settling_s[uas]
        return float(self._dod_max[uas] - self._dod_per_s[uas] * due_s)

    def _least_s(self, uas: int, position_m: FloatArray, waypoints: NDArray[np.intp]) -> float:
        """The quickest way home by one of some waypoints; the nearest are looked at first."""
        places_m = self._waypoints_m[waypoints]
        there_s = np.linalg.norm(places_m - position_m, axis=1) / np.linalg.norm(self._speeds[uas])
        at_least_s = there_s + self._home_s[uas, waypoints]
        least_s = np.inf
        for k in np.argsort(at_least_s, kind="stable"):
            if at_least_s[k] >= least_s:
                break
            least_s = min(least_s, self._by(uas, int(waypoints[k]), position_m))
        return least_s

    def _by(self, uas: int, waypoint: int, position_m: FloatArray) -> float:
        """Flight time home by a waypoint."""
        return self._seconds(uas, waypoint, position_m) + float(self._home_s[uas, waypoint])

    def _seconds(self, uas: int, target: int, position_m: FloatArray) -> float:
        if self._ways is not None:
            return self._ways.seconds(uas, target, position_m)
        end_m = self._homes_m[uas] if target == HOME else self._waypoints_m[target]
        north_m, east_m, down_m = (end_m - position_m).tolist()
        way_m, up_m = float(np.hypot(north_m, east_m)), max(-down_m, 0.0)
        return float(flight_seconds(ROUTED, self._speeds[uas], 0.0, way_m, up_m, max(down_m, 0.0)))

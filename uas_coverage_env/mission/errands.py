"""How long it takes to a waypoint and home again, and whether the charge lasts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.mission.range import Range
from uas_coverage_env.mission.ways import Ways
from uas_coverage_env.vehicle.layout import DOD, N_STATES
from uas_coverage_env.vehicle.range import dod_per_s


@dataclass(frozen=True)
class Errand:
    """To a waypoint and home again.

    Attributes:
        name: Of the UAS.
        takes_s: How long it takes [s].
        spare_s: For how much longer the charge lasts; negative: it does not last [s].
    """

    name: str
    takes_s: float
    spare_s: float

    @property
    def lasts_s(self) -> float:
        """How long the charge lasts [s]."""
        return max(self.takes_s + self.spare_s, 0.0)


class Errands:
    """Flights at full speed in still air, past the fixed obstacles; home with a margin (`Range`).

    Args:
        brief: The mission.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._brief, self._ways, self._range = brief, Ways(brief), Range(brief)

    def to(self, uas: int, waypoint: int, position_m: NDArray[np.float64], dod: float) -> Errand:
        """To a waypoint from a place, and home.

        Args:
            uas: Index of the UAS.
            waypoint: Index of the waypoint.
            position_m: (3,) where it is [m].
            dod: Its depth of discharge.
        """
        entry = self._brief.uas[uas]
        per_s = dod_per_s(self._brief.vehicles[uas], entry.dod_max)
        there_s = self._ways.seconds(uas, waypoint, position_m)
        x = np.zeros(N_STATES)
        x[:3], x[DOD] = self._brief.waypoints[waypoint].position_m, dod + per_s * there_s
        home = self._range.home(uas, x)
        takes_s = there_s + home.time_s + home.time_margin_s
        return Errand(entry.name, takes_s, self._range.spare_dod(uas, x) / per_s)

    def from_start(self, uas: int, waypoint: int) -> Errand:
        """The same with the charge with which the mission begins, from where it begins."""
        entry = self._brief.uas[uas]
        return self.to(uas, waypoint, np.array(entry.start_m, float), 1.0 - entry.soc_0)

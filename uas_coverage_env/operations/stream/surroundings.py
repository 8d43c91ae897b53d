"""What UAS have to be clear of while they are streamed, with the path on which they would stop."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.operations.clearance import Surroundings
from uas_coverage_env.operations.stream.vehicle_limits import Limits
from uas_coverage_env.planning.execution.lateness import apart_m, kept_m
from uas_coverage_env.scenario import Scenario

FloatArray = NDArray[np.float64]

_ENOUGH_M = 1.5
"""Room beside a path that is as good as any: what GUIDED leaves of a path, and the next gust."""
_SHARE = 0.8
_ABOVE_GROUND_M = 0.5


class SwarmSurroundings:
    """Zones, obstacles, the fence, and other UAS.

    Args:
        scenario: The mission.
        names: Its UAS that are streamed.
    """

    def __init__(self, scenario: Scenario, names: list[str]) -> None:
        everyone = [uas.name for uas in scenario.uas]
        self._index = {name: everyone.index(name) for name in names}
        self._rooms = {name: Surroundings(scenario, u) for name, u in self._index.items()}
        self._scenario = scenario

    def kept_m(self, one: str, other: str) -> float:
        """Distance that two UAS keep, level or upright [m]."""
        return kept_m(self._scenario, self._index[one], self._index[other])

    def room_m(self, name: str, start_m: FloatArray, end_m: FloatArray) -> float:
        """Room of a UAS to obstacles, zones and the fence on a line, at most `_ENOUGH_M` [m]."""
        return min(self._rooms[name].room(start_m, end_m, 2.0).contact_m, _ENOUGH_M)

    def stops_in_m(
        self, name: str, place_m: FloatArray, velocity_mps: FloatArray, limits: Limits
    ) -> float:
        """Room on the way on which a UAS would stop if its link were cut now [m]."""
        return self.room_m(name, place_m, stopping_place_m(place_m, velocity_mps, limits))

    def is_clear(
        self, name: str, start_m: FloatArray, end_m: FloatArray, others_m: Mapping[str, FloatArray]
    ) -> bool:
        """Whether a UAS may fly a straight line: past what stands there, and past other UAS.

        Args:
            name: The UAS.
            start_m: (3,) [m].
            end_m: (3,) [m].
            others_m: (3,) where other UAS hover, by name [m].
        """
        ends = [self.room_m(name, place_m, place_m) for place_m in (start_m, end_m)]
        if self.room_m(name, start_m, end_m) <= max(_SHARE * min(ends), 0.0):
            return False
        line_m = np.linspace(start_m, end_m, 2 + int(np.linalg.norm(end_m - start_m)))
        return all(
            apart_m(line_m, place_m[None]).min() >= self.kept_m(name, other)
            for other, place_m in others_m.items()
            if other != name
        )

    def goes_straight_home(
        self, name: str, place_m: FloatArray, home_m: FloatArray, return_m: float
    ) -> bool:
        """Whether climbing to a height, flying straight home and landing is clear from a place."""
        top_m = np.array([*place_m[:2], min(float(place_m[2]), -return_m)])
        above_m = np.array([*home_m[:2], top_m[2]])
        low_m = np.array([*home_m[:2], min(-_ABOVE_GROUND_M, float(home_m[2]))])
        ways = ((place_m, top_m), (top_m, above_m), (above_m, low_m))
        return all(self.room_m(name, a, b) > 0.0 for a, b in ways)

    def may_land(self, name: str, place_m: FloatArray, others_m: Mapping[str, FloatArray]) -> bool:
        """Whether the way straight down is clear, of zones and of other UAS too."""
        ground_m = np.array([*place_m[:2], -_ABOVE_GROUND_M])
        return self.is_clear(name, place_m, ground_m, others_m)


def stopping_place_m(place_m: FloatArray, velocity_mps: FloatArray, limits: Limits) -> FloatArray:
    """(3,) where a UAS comes to rest, straight on, if its link is cut now [m]."""
    speed_mps = math.hypot(*velocity_mps)
    if speed_mps < 1e-6:
        return place_m
    return place_m + velocity_mps * (limits.stops_m(speed_mps) / speed_mps)

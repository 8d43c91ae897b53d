"""What a replay page knows of the area from which home can still be reached.

A grid over the fence, for each UAS: the charge below which coming home from there is not sure, by
`mission.Range` (docs/range.md). The page adds the straight flight there, and draws how far that
goes at a moment; docs/replay.md says it in words.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.mission import MissionBrief, Range
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle.layout import DOD, N_STATES
from uas_coverage_env.vehicle.range import CALIBRATED, dod_per_s, level_seconds, speeds_of

GRID = 21
_MARGIN_SHARE = 0.1
"""Of the time of flight there, as of the way home."""


class Reach(NamedTuple):
    """What reaching a place and coming home from it takes, at the current of an empty battery.

    Attributes:
        north_m: (N,) of the grid [m].
        east_m: (E,) of the grid [m].
        height_m: Above the origin, at which places are reached: of the highest waypoint [m].
        needed_soc: (U, N, E) the charge below which coming home from rest there is not sure.
        per_m: (U,) charge that a metre of level flight takes, with a margin of a tenth [1/m].
        fixed: (U,) charge that slowing down takes there.
    """

    north_m: NDArray[np.float64]
    east_m: NDArray[np.float64]
    height_m: float
    needed_soc: NDArray[np.float64]
    per_m: NDArray[np.float64]
    fixed: NDArray[np.float64]


def reach(scenario: Scenario) -> Reach:
    """What reaching each place of a mission and coming home from it takes."""
    brief = MissionBrief.of(scenario)
    range_ = Range(brief)
    corners_m = scenario.fence.vertices_m
    north_m, east_m = (
        np.linspace(corners_m[:, axis].min(), corners_m[:, axis].max(), GRID) for axis in (0, 1)
    )
    height_m = -min(waypoint.position_m[2] for waypoint in scenario.waypoints)
    needed = np.empty((len(scenario.uas), GRID, GRID))
    per_m, fixed = [], []
    x = np.zeros(N_STATES)
    for i, dod_landed in enumerate(scenario.dod_landed):
        x[DOD] = dod_landed
        for row, north in enumerate(north_m):
            for column, east in enumerate(east_m):
                x[:3] = (north, east, -height_m)
                home = range_.home(i, x)
                needed[i, row, column] = 1.0 - dod_landed + home.dod + home.dod_margin
        vehicle = brief.vehicles[i]
        per_s = (1.0 + _MARGIN_SHARE) * dod_per_s(vehicle, dod_landed)
        # the last part of it is flown at less than full speed
        per_m.append(per_s * level_seconds(CALIBRATED, speeds_of(vehicle), 1.0))
        fixed.append(per_s * CALIBRATED.level_s)
    return Reach(north_m, east_m, height_m, needed, np.array(per_m), np.array(fixed))

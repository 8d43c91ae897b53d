"""What a replay page knows of the way home: the charge that it takes, with margin, from everywhere.

The numbers are those of `mission.Range`, the one answer to how far home is (docs/range.md).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.mission import MissionBrief, Range
from uas_coverage_env.vehicle.layout import DOD


@dataclass(frozen=True)
class WayHome:
    """Charge and the way home, at each sample while a UAS flies.

    Attributes:
        needed_soc: (T, U) the charge below which coming home is not sure; where a UAS does not
            fly, the least charge that is allowed.
        least_spare: Per UAS the sample in which least charge was left beyond the way home, and
            that charge; the charge is negative beyond the point of no return.
        no_return: Per UAS the sample of the point of no return: the first in which nothing was
            left. None: there was always something left.
    """

    needed_soc: NDArray[np.float64]
    least_spare: tuple[tuple[int, float], ...]
    no_return: tuple[int | None, ...]


def way_home(flight: Flight, history: SceneHistory) -> WayHome:
    """The way home at every sample of a flight, among the obstacles that there are, to its home."""
    began = [since for since, _ in history.changes]
    ranges = [Range(MissionBrief.of(scenario)) for _, scenario in history.changes]
    present = np.searchsorted(began, np.arange(len(flight.x)), side="right") - 1
    lowest_soc = np.array([1.0 - dod for dod in flight.scenario.dod_landed])
    needed = np.tile(lowest_soc, (len(flight.x), 1))
    least: list[tuple[int, float]] = []
    no_return: list[int | None] = []
    for i, last in enumerate(flight.last_sample):
        states = zip(present.tolist(), flight.x[: last + 1, i], strict=False)
        spare = np.array([ranges[scene].spare_dod(i, x) for scene, x in states])
        # on the ground nothing is needed
        rests = flight.resting[: last + 1, i]
        spare[rests] = 1.0 - flight.x[: last + 1, i, DOD][rests] - lowest_soc[i]
        needed[: last + 1, i] = 1.0 - flight.x[: last + 1, i, DOD] - spare
        # at the last sample it is down, where nothing is needed any more
        flown = spare[:last] if last else spare
        least.append((int(flown.argmin()), float(flown.min())))
        no_return.append(int((flown <= 0.0).argmax()) if (flown <= 0.0).any() else None)
    return WayHome(needed, tuple(least), tuple(no_return))

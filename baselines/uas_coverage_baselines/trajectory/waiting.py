"""Who waits for a waypoint that is blocked, nobody knows for how long, and until when."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.fleet import Fleet, Moment
from uas_coverage_baselines.trajectory.movers import NEVER
from uas_coverage_env.mission import Range
from uas_coverage_env.vehicle import DOD

_AS_LONG_S = 10.0  # who can wait nearly as long as another may do so, too
_TOO_LATE_S = 12.0  # before a UAS has to set off home: then it no longer waits


class Waiting(NamedTuple):
    """Who may be sent to what is blocked, and when at the latest.

    Attributes:
        barred: (U, W) UAS that must not visit it: another one could wait longer.
        latest: (W,) steps from now; `NEVER` where nothing is known to be blocked, or where nobody
            can wait any longer.
    """

    barred: NDArray[np.bool_]
    latest: NDArray[np.int64]


def who_waits(
    fleet: Fleet, way_home: Range, moment: Moment, blocked: NDArray[np.bool_]
) -> Waiting:
    """The UAS that can wait longest, and all whose battery outlasts the mission.

    The others fly home when they have nothing else to do. Were it the other way round, nobody would
    be left when the charge of the one that waits runs out.

    Args:
        fleet: The mission.
        way_home: Of its UAS.
        moment: From where.
        blocked: (W,) for nobody knows how long.
    """
    brief, x = fleet.brief, moment.x
    there = np.flatnonzero(blocked)
    mission_s = brief.max_steps * brief.dt_s - moment.time_s
    battery_s = fleet.battery_s(x)
    until_s = np.full((len(x), len(blocked)), -np.inf)
    for u in np.flatnonzero(moment.may_work):
        for w in there:
            hover = np.zeros(x.shape[1])
            hover[:3], hover[DOD] = fleet.waypoints_m[w], x[u, DOD]
            home = way_home.home(int(u), hover)
            back_s = home.time_s + home.time_margin_s
            until_s[u, w] = min(float(battery_s[u]), mission_s) - back_s
    longest_s = until_s.max(axis=0)
    keeps = until_s >= longest_s - _AS_LONG_S
    keeps[moment.may_work & (battery_s >= mission_s)] = True
    latest = np.full(len(blocked), NEVER)
    waits = blocked & (longest_s >= _TOO_LATE_S)
    latest[waits] = np.round(longest_s[waits] / brief.dt_s)
    return Waiting(blocked & ~keeps, latest)

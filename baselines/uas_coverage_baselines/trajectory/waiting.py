"""Which UAS waits for a waypoint that is blocked for an unknown time, and until when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.fleet import Fleet, Moment
from uas_coverage_baselines.trajectory.mission_plan import Planned
from uas_coverage_env.mission import Range
from uas_coverage_env.planning.routing import SearchEffort, empty_routes, improve_routes
from uas_coverage_env.vehicle.layout import DOD

_AS_LONG_S = 10.0  # a UAS that can wait nearly as long as another may do so, too
_OPENS_SHARE = 0.85  # of the other work: so late is what is blocked visited at first
_OPENS_AGAIN_SHARE = 0.75  # later: of what is left of the mean flight,
_OPENS_AGAIN_S = 26.0  # and at least so long
_TOO_LATE_S = 12.0  # before a UAS has to set off home: then it no longer waits


class Waiting(NamedTuple):
    """Which UAS could wait for what is blocked, and when it is visited at the latest.

    Attributes:
        forbidden: (U, W) UAS that must not be the ones to wait: another one could wait longer.
        latest: (W,) steps from now; negative where no UAS can wait any longer.
    """

    forbidden: NDArray[np.bool_]
    latest: NDArray[np.int64]

    def is_left_to_others(
        self, planned: Mapping[int, Planned], step: int, uncovered: NDArray[np.bool_]
    ) -> bool:
        """Whether all that could wait longest for a waypoint have nothing to do but fly home.

        Args:
            planned: What the UAS are to do.
            step: Number of the sample.
            uncovered: (W,).
        """
        busy = [u for u, p in planned.items() if p.open_visits(step, uncovered).any()]
        asked = uncovered & self.forbidden.any(axis=0) & (self.latest >= 0)
        return bool(self.forbidden[busy][:, asked].all(axis=0).any())


def choose_waiting(
    fleet: Fleet, way_home: Range, moment: Moment, blocked: NDArray[np.bool_]
) -> Waiting:
    """The UAS that can wait longest, and all whose battery outlasts the mission.

    Were these to fly home while another one waits, none would be left when its charge runs out.

    Args:
        fleet: The mission.
        way_home: Of its UAS.
        moment: From where.
        blocked: (W,) for an unknown time.
    """
    brief, x = fleet.brief, moment.x
    there = np.flatnonzero(blocked)
    mission_s = brief.max_steps * brief.dt_s - moment.time_s
    battery_s = fleet.battery_s(x)
    until_s = np.full((len(x), len(blocked)), -np.inf)
    may_cover = moment.may_work[:, None] & brief.can_cover
    for u in np.flatnonzero(moment.may_work):
        for w in there[may_cover[u, there]]:
            hover = np.zeros(x.shape[1])
            hover[:3], hover[DOD] = fleet.waypoints_m[w], x[u, DOD]
            home = way_home.home(int(u), hover)
            back_s = home.time_s + home.time_margin_s
            until_s[u, w] = min(float(battery_s[u]), mission_s) - back_s
    longest_s = until_s.max(axis=0)
    keeps = until_s >= longest_s - _AS_LONG_S
    keeps |= may_cover & (battery_s >= mission_s)[:, None]
    latest = np.where(longest_s >= _TOO_LATE_S, np.round(longest_s / brief.dt_s), -1.0)
    return Waiting(blocked & ~keeps, latest.astype(np.int64))


def opens_first(
    fleet: Fleet, moment: Moment, unknown: NDArray[np.bool_], moves: int, seed: int
) -> int:
    """Steps after which a visit to what is blocked is planned at first: at the end of other work.

    Args:
        fleet: The mission.
        moment: From where.
        unknown: (W,) what is blocked.
        moves: Of the search for the other work's order.
        seed: Likewise.
    """
    others = moment.uncovered & ~unknown
    problem = fleet.problem(replace(moment, uncovered=others))
    order = improve_routes(problem, empty_routes(problem.n_uas), SearchEffort(moves), seed)
    late_s = _OPENS_SHARE * float(order.seconds.mean())
    return round(max(_OPENS_AGAIN_S, late_s) / fleet.brief.dt_s)


def opens_again(left_steps: Sequence[int], dt_s: float) -> int:
    """Steps after which such a visit is planned later.

    Args:
        left_steps: What is left of each flight.
        dt_s: Length of a step [s].
    """
    later_s = _OPENS_AGAIN_SHARE * float(np.mean([dt_s * n for n in left_steps] or [0.0]))
    return round(max(_OPENS_AGAIN_S, later_s) / dt_s)

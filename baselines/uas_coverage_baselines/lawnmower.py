"""Lawnmower: the waypoints row by row, back and forth, cut into one run per UAS."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.targets import Targets, warm_up_once
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.flight import AssistedOptions
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.following.following import first_of
from uas_coverage_env.planning.reserves import LAWNMOWER
from uas_coverage_env.scenario.feasibility import along_ways
from uas_coverage_env.vehicle.range import dod_per_s, level_seconds, speeds_of
from uas_coverage_env.world import Command, GoTo, SwarmState

# Share of the charge that a run may be planned to use.
_USABLE = 0.9


class Lawnmower:
    """Flies back and forth over the rows of waypoints, each UAS its own part; home in the end."""

    Options = AssistedOptions
    goes_to = True

    def __init__(self, options: AssistedOptions | None = None) -> None:
        self.options = options or AssistedOptions()
        self.assistants = self.options.assistants
        self.routes: list[list[int]] | None = None

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile what the first decision compiles."""
        warm_up_once(self, brief)

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Order the waypoints and cut the order into runs of about equal time."""
        self._targets = Targets(brief)
        self._can_cover = brief.can_cover
        self._runs = self._runs_of(brief)
        self.routes = None if brief.execution is None else self._runs

    def _runs_of(self, brief: MissionBrief) -> list[list[int]]:
        """The run of each UAS; where one lands elsewhere, what lies on the ways."""
        waypoints_m = np.array([waypoint.position_m for waypoint in brief.waypoints])
        ends_m = np.array([(uas.start_m, uas.home_m) for uas in brief.uas])
        if (ends_m[:, 0] != ends_m[:, 1]).any():
            return along_ways(ends_m[:, 0], ends_m[:, 1], waypoints_m, brief.can_cover)
        runs: list[list[int]] = [[] for _ in brief.uas]
        kinds = np.unique(brief.can_cover, axis=1)
        for able in kinds.T:
            # waypoints that the same UAS can cover, cut among these
            what = np.flatnonzero((brief.can_cover == able[:, None]).all(axis=0))
            order = what[back_and_forth(waypoints_m[what])].tolist()
            team = np.flatnonzero(able).tolist()
            if team:
                for u, run in zip(team, plan_runs(_brief_of(brief, team), order), strict=True):
                    runs[u] += run
        return runs

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are given up, and why in a few words."""
        return self._targets.given_up

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Fly each run in order; a UAS that has finished helps with the nearest waypoints."""
        if self.routes is not None:  # an autopilot flies along them
            self.routes = self._left(swarm)
            targets = first_of(self.routes, swarm)
            return {name: GoTo(targets.get(name)) for name in swarm.active}
        return self._targets.commands(swarm, self._next)

    def _left(self, swarm: SwarmState) -> list[list[int]]:
        """What is left of the runs; one that is lost leaves its run to the one that has least."""
        works = (swarm.status == FLYING) & ~swarm.returning
        left = [[w for w in run if swarm.uncovered[w]] for run in self._runs]
        for u in np.flatnonzero(~works & (np.array([len(run) for run in left]) > 0)):
            for w in left[u]:
                able = np.flatnonzero(works & self._can_cover[:, w])
                if len(able):
                    heir = min(able, key=lambda v: len(left[v]))
                    self._runs[u].remove(w)
                    self._runs[heir].append(w)
                    left[heir].append(w)
            left[u] = []
        return left

    def _next(self, swarm: SwarmState, uas: int, candidates: NDArray[np.bool_]) -> int:
        own = [waypoint for waypoint in self._runs[uas] if candidates[waypoint]]
        return own[0] if own else self._targets.nearest(swarm, uas, candidates)


def _brief_of(brief: MissionBrief, team: Sequence[int]) -> MissionBrief:
    """The mission of some of its UAS."""
    if len(team) == len(brief.uas):
        return brief
    fleet: dict[str, Any] = {
        "uas": tuple(brief.uas[u] for u in team),
        "vehicles": tuple(brief.vehicles[u] for u in team),
    }
    known: dict[str, Any] = {name: getattr(brief, name) for name in type(brief).model_fields}
    return MissionBrief.model_construct(**known | fleet)


def back_and_forth(waypoints_m: NDArray[np.float64]) -> list[int]:
    """Order waypoints (W, 3) [m] row by row, along the longer side of the area."""
    size_m = np.ptp(waypoints_m[:, :2], axis=0) + 1.0
    along = int(size_m.argmax())
    across = 1 - along
    n_rows = max(1, round(np.sqrt(len(waypoints_m) * size_m[across] / size_m[along])))
    # rows are centred on the first and last waypoints: a wobble of half a pitch does no harm
    pitch_m = size_m[across] / max(1, n_rows - 1)
    row = np.rint((waypoints_m[:, across] - waypoints_m[:, across].min()) / pitch_m).astype(int)
    forth = 1 - 2 * (row % 2)
    return np.lexsort([waypoints_m[:, along] * forth, row]).tolist()


def plan_runs(brief: MissionBrief, order: Sequence[int]) -> list[list[int]]:
    """Cut an order of waypoints into one run per UAS: the slowest one as quick as can be.

    No run takes longer than the charge of its UAS allows, unless all charges together are too
    little: then the cut is that of a fleet with endless batteries.
    """
    cuts = _Cuts(brief, order)
    allowed_s = _allowed_times_s(brief)
    if not cuts.complete(cuts.within(allowed_s)):
        allowed_s = np.full(len(allowed_s), np.inf)
    best = cuts.within(allowed_s)
    low_s, high_s = 0.0, cuts.longest_s
    while high_s - low_s > 1.0:
        middle_s = (low_s + high_s) / 2
        runs = cuts.within(np.minimum(allowed_s, middle_s))
        if cuts.complete(runs):
            best, high_s = runs, middle_s
        else:
            low_s = middle_s
    return best


class _Cuts:
    """Ways to cut an order of waypoints; times are those of straight flight."""

    def __init__(self, brief: MissionBrief, order: Sequence[int]) -> None:
        cruise_mps = min(vehicle.limits.v_cruise_mps for vehicle in brief.vehicles)
        speeds = speeds_of(brief.vehicles[0])._replace(level_mps=cruise_mps)
        route_m = np.array([brief.waypoints[waypoint].position_m for waypoint in order])
        homes_m = np.array([uas.home_m for uas in brief.uas])
        between_m = np.linalg.norm(np.diff(route_m, axis=0), axis=1)
        at_m = np.concatenate([[0.0], np.cumsum(between_m)])
        self._at_s = level_seconds(LAWNMOWER, speeds, at_m)
        home_m = np.linalg.norm(route_m - homes_m[:, None], axis=2)
        self._home_s = level_seconds(LAWNMOWER, speeds, home_m)
        self._order = list(order)
        # whoever starts nearer to the beginning of the order takes the earlier part
        self._takers = self._home_s[:, 0].argsort(kind="stable")

    @property
    def longest_s(self) -> float:
        """More than the time of any cut."""
        return float(self._at_s[-1] + 2.0 * self._home_s.max() + 1.0)

    def within(self, limits_s: NDArray[np.float64]) -> list[list[int]]:
        """Give each UAS in turn the longest run that its limit (U,) [s] allows."""
        runs: list[list[int]] = [[] for _ in limits_s]
        first = 0
        for uas in self._takers:
            rest = slice(first, None)
            run_s = self._at_s[rest] - self._at_s[rest][:1]
            run_s += self._home_s[uas, rest][:1] + self._home_s[uas, rest]
            allowed = np.maximum.accumulate(run_s) <= limits_s[uas]
            runs[uas] = self._order[first : first + int(allowed.sum())]
            first += len(runs[uas])
        return runs

    def complete(self, runs: list[list[int]]) -> bool:
        """Whether every waypoint belongs to a run."""
        return sum(map(len, runs)) == len(self._order)


def _allowed_times_s(brief: MissionBrief) -> NDArray[np.float64]:
    """(U,) [s] flight at full speed that the charge of each UAS allows."""
    return np.array(
        [
            _USABLE * (dod - (1.0 - uas.soc_0)) / dod_per_s(vehicle, dod)
            for uas, vehicle, dod in zip(brief.uas, brief.vehicles, brief.dod_landed, strict=True)
        ]
    )

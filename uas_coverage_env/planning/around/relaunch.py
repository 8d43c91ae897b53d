"""Which UAS that have landed take off again, where the scenario lets them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import interpreted
from uas_coverage_env.entities.state import FLYING, LANDED, LOST
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.range import Range
from uas_coverage_env.mission.views import WorldView
from uas_coverage_env.mission.ways import Ways
from uas_coverage_env.planning.around.handover import Handover
from uas_coverage_env.vehicle.layout import DOD, VX
from uas_coverage_env.vehicle.range import dod_per_s
from uas_coverage_env.world import SwarmState
from uas_coverage_env.world.packs import is_clear

BoolArray = NDArray[np.bool_]


class Relaunch:
    """The rule by which UAS that have landed take off again, for every planner the same.

    They do where no UAS is at work any more: all others have landed, are lost, take no commands
    (`Handover`), or are on their way home in return mode. Then each goes that reaches an open
    waypoint and comes home again with the charge that it has, and stands clear of everything.
    Where nothing has been covered since, and no UAS was lost, they do not go a second time. When a
    waypoint is asked for again they go at once, even while others work: it is on no route yet.

    Args:
        brief: The mission as it is now.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._brief = brief
        self._handover, self._view = Handover(brief), WorldView(brief)
        self._ways, self._range = Ways(brief), Range(brief)
        self._tried: tuple[bytes, bytes] | None = None

    def due(self, swarm: SwarmState, *, asked_again: bool = False) -> BoolArray:
        """(U,) which UAS take off now; to be called once per sample.

        Args:
            swarm: What is seen.
            asked_again: Whether a waypoint is asked for again at this sample.
        """
        again = np.zeros(len(swarm.status), np.bool_)
        at_work = self._handover.at_work(swarm) & ~swarm.returning
        waits = (swarm.status == LANDED) & swarm.responds
        works = at_work.any() and not asked_again
        if works or not waits.any() or not swarm.uncovered.any():
            return again
        situation = swarm.uncovered.tobytes(), (swarm.status == LOST).tobytes()
        if situation == self._tried:
            return again
        self._view.update(swarm)
        wanted = swarm.uncovered & ~self._view.blocked()
        for u in np.flatnonzero(waits).tolist():
            mine = np.flatnonzero(wanted & self._brief.can_cover[u]).tolist()
            if self._is_clear(u, swarm, again) and any(self._reaches(u, w, swarm) for w in mine):
                again[u] = True
        if again.any():
            self._tried = situation
        return again

    def _reaches(self, u: int, w: int, swarm: SwarmState) -> bool:
        """Whether a UAS has charge and time to cover a waypoint and come home, with margin."""
        brief, here = self._brief, swarm.x[u]
        there = here.copy()
        there[:3] = brief.waypoints[w].position_m
        there[VX:DOD] = 0.0
        home = self._range.home(u, there)
        out_s = self._ways.seconds(u, w, here[:3])
        needs_s = out_s + home.time_s + 2.0 * home.time_margin_s  # there as much as back
        left_s = brief.dt_s * (brief.max_steps - swarm.step)
        needs = needs_s * dod_per_s(brief.vehicles[u], float(here[DOD]))
        return needs_s < left_s and float(here[DOD]) + needs < brief.dod_landed[u]

    def _is_clear(self, u: int, swarm: SwarmState, going: BoolArray) -> bool:
        """Whether a UAS that flies where it stands keeps all safe distances."""
        arena, uas = self._view.arena, self._view.state.uas.copy()
        uas["status"] = np.where(going, FLYING, swarm.status)
        return bool(interpreted(is_clear)(arena, arena.moving_path_m[0], swarm.x, uas, u, 0.0))

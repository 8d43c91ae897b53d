"""UAS that come no nearer to their targets, and waypoints that are therefore left for later."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.commands import HOME
from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.mission.ways import Ways
from uas_coverage_env.world import SwarmState

BoolArray = NDArray[np.bool_]

PATIENCE_S = 30.0
"""For so long a UAS may fly to a target without coming nearer to it [s]."""

_LOOK_EVERY_S = 3.0
_NEARER_S = 0.1
"""Nearer is a way that takes this much less than any before [s]."""

_GIVEN_UP_FOR_GOOD = 3
"""Attempts that a waypoint is worth: as ever, then flown carefully, then once more in the end."""


class Attempts:
    """Watches every UAS on its way to its target.

    The first `PATIENCE_S` in which a UAS comes no nearer to its target make the target a hard one:
    it is to be flown to with more care (`Approach`). The next ones make it one to be left until no
    other waypoint is wanted, and the ones after that one that is given up. How near is the time of
    the way past the fixed obstacles, so that a detour is no standstill. No time counts while a
    moving obstacle blocks the target, or return mode flies the UAS home.

    Args:
        brief: The mission.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._ways = Ways(brief)
        n_uas, self._n = len(brief.uas), len(brief.waypoints)
        self._dt_s = brief.dt_s
        self._every = max(round(_LOOK_EVERY_S / brief.dt_s), 1)
        # the last column is home
        self._nearest_s = np.full((n_uas, self._n + 1), np.inf)
        self._waited_s = np.zeros((n_uas, self._n + 1))
        self._failed = np.zeros(self._n, np.int64)
        self._lost_home = np.zeros(n_uas, np.bool_)
        self._later = np.zeros(self._n, np.bool_)

    def update(
        self, swarm: SwarmState, targets: Mapping[str, int], blocked: BoolArray | None = None
    ) -> None:
        """Note how near each UAS is to its target; to be called once per sample.

        Args:
            swarm: What is seen.
            targets: Index of the waypoint that each UAS flies to, or `world.HOME`.
            blocked: (W,) waypoints for which it is waited now.
        """
        if swarm.step % self._every:
            return
        for name, target in targets.items():
            uas = swarm.names.index(name)
            if name not in swarm.active or swarm.returning[uas]:
                continue
            if target != HOME and (
                not swarm.uncovered[target] or (blocked is not None and blocked[target])
            ):
                continue
            seconds = self._ways.seconds(uas, target, swarm.x[uas, :3])
            if seconds < self._nearest_s[uas, target] - _NEARER_S:
                self._nearest_s[uas, target] = seconds
                self._waited_s[uas, target] = 0.0
                continue
            self._waited_s[uas, target] += self._every * self._dt_s
            if self._waited_s[uas, target] >= PATIENCE_S:
                self._fail(uas, target)

    def is_hard(self, uas: int, target: int) -> bool:
        """Whether a UAS has come no nearer to a target once; see `update`."""
        return bool(self._lost_home[uas] if target == HOME else self._failed[target] > 0)

    def wanted(self, uncovered: BoolArray) -> BoolArray:
        """(W,) which of the open waypoints are to be flown to now.

        Args:
            uncovered: (W,) the open ones.
        """
        if not self._later.any():
            return uncovered
        if not (uncovered & ~self._later).any():
            self._later = self._failed >= _GIVEN_UP_FOR_GOOD
        return uncovered & ~self._later

    def wanted_of(self, uncovered: BoolArray, mine: BoolArray) -> BoolArray:
        """(W,) the same of a UAS that can cover some of them only.

        Args:
            uncovered: (W,) the open ones.
            mine: (W,) those that it can cover.
        """
        now = uncovered & mine & ~self._later
        return now if now.any() else uncovered & mine & (self._failed < _GIVEN_UP_FOR_GOOD)

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are given up, and why in a few words."""
        why = f"UAS came no nearer to it in {_GIVEN_UP_FOR_GOOD} attempts"
        return dict.fromkeys(np.flatnonzero(self._failed >= _GIVEN_UP_FOR_GOOD).tolist(), why)

    def _fail(self, uas: int, target: int) -> None:
        self._nearest_s[:, target] = math.inf
        self._waited_s[:, target] = 0.0
        if target == HOME:
            self._lost_home[uas] = True
            return
        self._failed[target] += 1
        self._later[target] = self._failed[target] > 1

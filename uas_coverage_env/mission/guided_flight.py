"""Flights to waypoints under the world's guidance: with care, or later, where one is hard."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.mission.approach import Approach
from uas_coverage_env.mission.attempts import Attempts
from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.world import Command, GoTo, SwarmState

BoolArray = NDArray[np.bool_]


class GuidedFlight:
    """Sends UAS to waypoints. What one comes no nearer to is flown to with care (`Approach`).

    If that does not help either, the waypoint is left for later, and given up in the end
    (`Attempts`).

    Args:
        brief: The mission.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._attempts, self._approach = Attempts(brief), Approach(brief)

    def wanted(self, uncovered: BoolArray) -> BoolArray:
        """(W,) which of the open waypoints are to be flown to now.

        Args:
            uncovered: (W,) the open ones.
        """
        return self._attempts.wanted(uncovered)

    def wanted_of(self, uncovered: BoolArray, mine: BoolArray) -> BoolArray:
        """(W,) the same of a UAS that can cover some of them only.

        Args:
            uncovered: (W,) the open ones.
            mine: (W,) those that it can cover.
        """
        return self._attempts.wanted_of(uncovered, mine)

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are given up, and why in a few words."""
        return self._attempts.given_up

    def is_hard(self, uas: int, waypoint: int) -> bool:
        """Whether a waypoint is flown to with care."""
        return self._attempts.is_hard(uas, waypoint)

    def commands(
        self, swarm: SwarmState, targets: Mapping[str, int], blocked: BoolArray | None = None
    ) -> dict[str, Command]:
        """A command for each UAS that has a target; to be called once per sample.

        Args:
            swarm: What is seen.
            targets: Index of the waypoint that each UAS flies to.
            blocked: (W,) waypoints for which it is waited now.
        """
        self._attempts.update(swarm, targets, blocked)
        return {name: self._command(swarm, name, target) for name, target in targets.items()}

    def _command(self, swarm: SwarmState, name: str, target: int) -> Command:
        uas = swarm.names.index(name)
        if self.is_hard(uas, target):
            return self._approach.command(swarm, uas, target)
        return GoTo(target, mode="covering")

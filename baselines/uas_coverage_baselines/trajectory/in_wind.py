"""In a stated wind no flight that is planned in still air comes true: the pursuit of `tour` flies.

It follows an order of its own, searched with the moves and the weight of energy of `trajectory`.
"""

from __future__ import annotations

from collections.abc import Mapping

from uas_coverage_baselines.routing import SearchEffort
from uas_coverage_baselines.tour import Tour
from uas_coverage_env.flight.planner import Decision
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.world import Command, SwarmState


def blows(brief: MissionBrief) -> bool:
    """Whether a mean wind is stated."""
    return brief.conditions is not None and brief.conditions.mean_mps > 0.0


class InWind:
    """Flies the missions in which a wind blows."""

    def __init__(self) -> None:
        self._tour: Tour | None = None
        self._effort: SearchEffort | None = None

    def takes(self, brief: MissionBrief, effort: SearchEffort, seed: int) -> bool:
        """Whether it flies a mission, which it then begins, or goes on with."""
        if not blows(brief):
            self._tour = None
            return False
        if self._tour is None or effort != self._effort:
            self._tour, self._effort = Tour(effort=effort), effort
        self._tour.reset(brief, seed)
        return True

    def act(self, swarm: SwarmState) -> tuple[Mapping[str, Command], Decision | None] | None:
        """The commands of a step and what is decided; None where nothing is flown here."""
        if self._tour is None:
            return None
        return self._tour.act(swarm), self._tour.last_decision

"""In a stated wind no flight that is planned in still air comes true: `tour` flies.

It follows an order of its own, searched with the moves and the weight of energy of `trajectory`.
In light wind, flights of the coming half minute are planned (`lead`), and flown where `tour` finds
them safe; else its pursuit.
"""

from __future__ import annotations

from collections.abc import Mapping

from uas_coverage_baselines.tour import Tour
from uas_coverage_baselines.trajectory.lead import Lead
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.decision import Decision
from uas_coverage_env.planning.routing import SearchEffort
from uas_coverage_env.world import Arena, Command, SwarmState

_LED_MPS = 4.0  # in a stronger mean wind the pursuit flies alone


def blows(brief: MissionBrief) -> bool:
    """Whether a mean wind is stated."""
    return brief.conditions is not None and brief.conditions.mean_mps > 0.0


class InWind:
    """Flies the missions in which a wind blows.

    Args:
        margin_m: Planned beyond the distances that count as a breach.
    """

    def __init__(self, margin_m: float) -> None:
        self._margin_m = margin_m
        self._tour: Tour | None = None
        self._effort: SearchEffort | None = None

    def takes(self, brief: MissionBrief, effort: SearchEffort, seed: int) -> bool:
        """Whether it flies a mission, which it then begins, or goes on with."""
        if not blows(brief):
            self._tour = None
            return False
        if self._tour is None or effort != self._effort:
            self._tour, self._effort = Tour(effort=effort, make_leader=self._lead), effort
        self._tour.reset(brief, seed)
        return True

    def _lead(self, brief: MissionBrief, arena: Arena) -> Lead | None:
        conditions = brief.conditions
        if conditions is None or conditions.mean_mps > _LED_MPS:
            return None
        return Lead(brief, arena, self._margin_m)

    def act(self, swarm: SwarmState) -> tuple[Mapping[str, Command], Decision | None] | None:
        """The commands of a step and what is decided; None where nothing is flown here."""
        if self._tour is None:
            return None
        return self._tour.act(swarm), self._tour.last_decision

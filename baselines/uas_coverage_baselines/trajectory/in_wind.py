"""In a stated wind no flight that is planned in still air comes true: `tour` flies.

It follows an order of its own, searched with the moves and the weight of energy of `trajectory`.
In light wind, flights of the coming half minute are planned (`lead`), and flown where `tour` finds
them safe; else its pursuit.
"""

from __future__ import annotations

from uas_coverage_baselines.tour import Tour
from uas_coverage_baselines.trajectory.lead import Lead
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.routing import SearchEffort
from uas_coverage_env.world import Arena

_LED_MPS = 4.0  # in a stronger mean wind the pursuit flies alone


def blows(brief: MissionBrief) -> bool:
    """Whether a mean wind is stated."""
    return brief.conditions is not None and brief.conditions.mean_mps > 0.0


def tour_in_wind(effort: SearchEffort, margin_m: float) -> Tour:
    """The planner for missions in which a wind blows.

    Args:
        effort: Of its order's searches.
        margin_m: Planned beyond the distances that count as a breach.
    """

    def lead(brief: MissionBrief, arena: Arena) -> Lead | None:
        conditions = brief.conditions
        if conditions is None or conditions.mean_mps > _LED_MPS:
            return None
        return Lead(brief, arena, margin_m)

    return Tour(effort=effort, make_leader=lead)

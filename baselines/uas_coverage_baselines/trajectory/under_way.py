"""What a planner had of a mission under way whose scene has become another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from uas_coverage_baselines.trajectory.course import Course
from uas_coverage_baselines.trajectory.mission_plan import Planned
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.routing import Routes
from uas_coverage_env.world import SwarmState


@dataclass(frozen=True)
class UnderWay:
    """What was flown until then.

    Attributes:
        order: Of the search; None: there was none.
        planned: Flights that are as good as they were, by index of the UAS.
        backups: Backup trajectories that are as good as they were, likewise.
    """

    order: Routes | None = None
    planned: Mapping[int, Planned] = field(default_factory=dict)
    backups: Mapping[int, Course] = field(default_factory=dict)

    def at(self, swarm: SwarmState) -> UnderWay:
        """What of it holds for UAS that are where they are now."""
        planned = {}
        for u, each in self.planned.items():
            rest = each.course.rest(swarm.step)
            if rest.begins_at(swarm.x[u]):
                planned[u] = each
        return UnderWay(self.order, planned, self.backups)


def still_clear(before: MissionBrief, now: MissionBrief) -> bool:
    """Whether what was planned is as clear of everything: at most waypoints have been added."""
    rest = (name for name in MissionBrief.model_fields if name != "waypoints")
    known = len(before.waypoints)
    return now.waypoints[:known] == before.waypoints and all(
        getattr(before, name) == getattr(now, name) for name in rest
    )

"""Nearest waypoint: every UAS to the open waypoint nearest to it, one after the other."""

from collections.abc import Mapping

from uas_coverage_baselines.targets import Targets, warm_up_once
from uas_coverage_env.flight import AssistedOptions
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.world import Command, SwarmState


class NearestWaypoint:
    """Flies each UAS to the nearest open waypoint that no other UAS flies to; home in the end."""

    Options = AssistedOptions
    goes_to = True

    def __init__(self, options: AssistedOptions | None = None) -> None:
        self.options = options or AssistedOptions()
        self.assistants = self.options.assistants

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile what the first decision compiles."""
        warm_up_once(self, brief)

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Forget the targets of the mission before."""
        self._targets = Targets(brief)

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are given up, and why in a few words."""
        return self._targets.given_up

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Keep a target until it is covered or blocked, then take the nearest one."""
        return self._targets.commands(swarm, self._targets.nearest)

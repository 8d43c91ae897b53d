"""Hover: climb a little and stay; what the mission costs a swarm that does nothing for it."""

from collections.abc import Mapping

from pydantic import Field

from uas_coverage_env.flight import PlannerOptions
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.world import Command, SwarmState, Velocity


class HoverOptions(PlannerOptions):
    """Options of `Hover`."""

    climb_m: float = Field(
        default=5.0, ge=0.0, le=1e5, description="height above the start to hold [m]"
    )


class Hover:
    """Holds position above the start until the battery is empty; covers nothing."""

    Options = HoverOptions

    def __init__(self, options: HoverOptions | None = None) -> None:
        self.options = options or HoverOptions()

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Nothing to prepare."""

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """The same command for every UAS, always."""
        altitudes_m = self.options.climb_m - swarm.home_m[:, 2]
        hold = {
            name: Velocity(0.0, 0.0, altitude_m)
            for name, altitude_m in zip(swarm.names, altitudes_m, strict=True)
        }
        return {name: hold[name] for name in swarm.active}

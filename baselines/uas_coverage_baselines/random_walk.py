"""Random walk: a drawn velocity and altitude held for some seconds, then the next."""

from collections.abc import Mapping

import numpy as np
from pydantic import Field

from uas_coverage_env.flight import AssistedOptions
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.world import Command, GoTo, SwarmState, Velocity


class RandomWalkOptions(AssistedOptions):
    """Options of `RandomWalk`."""

    hold_s: float = Field(
        default=8.0, gt=0.0, le=1e6, description="how long a drawn command is held [s]"
    )
    speed: float = Field(default=0.8, gt=0.0, le=1.0, description="part of the largest speed")


class RandomWalk:
    """Flies drawn velocities, each held for some seconds; the seed repeats the flight."""

    Options = RandomWalkOptions

    def __init__(self, options: RandomWalkOptions | None = None) -> None:
        self.options = options or RandomWalkOptions()
        self.assistants = self.options.assistants

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Seed the generator; note the speeds of the vehicles and the heights inside the fence."""
        self._random = np.random.default_rng(seed)
        self._hold_steps = max(1, round(self.options.hold_s / brief.dt_s))
        limits_mps = np.array([vehicle.limits.v_xy_max_mps for vehicle in brief.vehicles])
        self._speed_mps = self.options.speed * limits_mps
        down_m = brief.fence.vertices_m[:, 2]
        room_m = brief.geofence.margin_m + max(uas.radius_m for uas in brief.uas)
        self._altitudes_m = (room_m - down_m.max(), -down_m.min() - room_m)
        self._held: dict[str, Command] = {}

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Hold what was drawn, draw anew when its time is over, go home when all is covered."""
        if not swarm.uncovered.any():
            return {name: GoTo(None) for name in swarm.active}
        if swarm.step % self._hold_steps == 0:
            self._held = self._draw(swarm)
        return {name: self._held[name] for name in swarm.active}

    def _draw(self, swarm: SwarmState) -> dict[str, Command]:
        # for all UAS, flying or not: the numbers of one do not depend on the fate of another
        headings_rad = self._random.uniform(0.0, 2.0 * np.pi, len(swarm.names))
        altitudes_m = self._random.uniform(*self._altitudes_m, len(swarm.names))
        return {
            name: Velocity(
                float(self._speed_mps[i] * np.cos(headings_rad[i])),
                float(self._speed_mps[i] * np.sin(headings_rad[i])),
                float(altitudes_m[i]),
            )
            for i, name in enumerate(swarm.names)
        }

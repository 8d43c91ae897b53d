"""What a planner sees, as the arrays that the kernels of the world take."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.mission.blocked import find_blocked
from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.simulation import World
from uas_coverage_env.simulation.world import initial_state
from uas_coverage_env.world import SwarmState, build_arena


class WorldView:
    """Arena and state of a mission as far as a planner sees them, for the world's kernels.

    Moving obstacles are where they were seen last, at every sample.

    Args:
        brief: The mission.

    Attributes:
        arena: The mission as arrays; those of moving obstacles have one row, which `update` writes.
        state: Arrays of its own, at t = 0 until the first `update`.
    """

    def __init__(self, brief: MissionBrief) -> None:
        scenario = brief.as_scenario()
        arena = build_arena(scenario)
        self.arena = arena._replace(
            moving_path_m=arena.moving_path_m[:1].copy(),
            moving_velocity_mps=arena.moving_velocity_mps[:1].copy(),
        )
        self.state = initial_state(scenario)

    def update(self, swarm: SwarmState) -> None:
        """Write what is seen now into arena and state."""
        state = self.state
        state.x[:] = swarm.x
        state.uas["reference_mps"][:] = swarm.reference_mps
        state.uas["status"][:] = swarm.status
        if len(swarm.away):
            state.uas["status"][swarm.away] = FLYING
        state.uas["departed"][:] = swarm.departed
        state.uas["returning"][:] = swarm.returning
        state.uncovered[:] = swarm.uncovered
        state.step[0] = swarm.step
        self.arena.moving_path_m[0] = swarm.moving_position_m
        self.arena.moving_velocity_mps[0] = swarm.moving_velocity_mps

    def blocked(
        self, level_share: float = 0.0, up_share: float = 0.0, margin_m: float = 0.0
    ) -> NDArray[np.bool_]:
        """Which waypoints moving obstacles block now; the arguments are those of `find_blocked`.

        Returns:
            (W,).
        """
        blocked = np.zeros(len(self.state.uncovered), np.bool_)
        find_blocked(self.arena, 0, level_share, up_share, margin_m, blocked)
        return blocked


def first_sight(brief: MissionBrief) -> SwarmState:
    """What a planner will see at t = 0, with moving obstacles at rest, for what it does before."""
    return World(brief.as_scenario()).swarm_state()

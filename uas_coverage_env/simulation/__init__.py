"""The one compiled step, and a mission that is flown with it."""

from uas_coverage_env.simulation.step import advance, begin_mission, first_invalid
from uas_coverage_env.simulation.world import Dynamics, World, initial_state, swarm_state

__all__ = [
    "Dynamics",
    "World",
    "advance",
    "begin_mission",
    "first_invalid",
    "initial_state",
    "swarm_state",
]

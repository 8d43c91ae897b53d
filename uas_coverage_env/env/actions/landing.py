"""What no action but home as a waypoint can express: to land where a UAS has not left."""

from uas_coverage_env.entities.commands import command_mode
from uas_coverage_env.world import Command, WorldState


def refuse_landing_unless_departed(state: WorldState, i: int, command: Command) -> None:
    """Refuse a command that lands a UAS at its start before it has left.

    Raises:
        ValueError: It would.
    """
    if command_mode(command) == "return" and not state.uas[i].departed:
        raise ValueError(
            "it has not left its start, and only home as a waypoint action lands it there"
        )

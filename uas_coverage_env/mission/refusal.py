"""Planners that do not plan for what waypoints may ask for refuse missions that ask for it."""

from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.scenario.payload import asks


def refuse_what_asks(brief: MissionBrief) -> None:
    """Refuse a mission in which a waypoint asks for a sensor, heights or a speed.

    Raises:
        ValueError: One does.
    """
    asking = [w for w, waypoint in enumerate(brief.waypoints) if asks(waypoint)]
    if asking:
        more = f" (+{len(asking) - 1} more)" if len(asking) > 1 else ""
        raise ValueError(
            f"waypoints[{asking[0]}]{more} asks for a sensor, heights or a speed, which it does "
            f"not plan for; take tour, trajectory, lawnmower or nearest-waypoint"
        )

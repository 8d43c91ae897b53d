"""Planners that went, and what follows each: the name is answered, it does not fly."""

from collections.abc import Mapping

FOLLOWERS: Mapping[str, str] = {
    "milp-mpc-guided": "milp-mpc with --option order=search, or trajectory",
    "learned-waypoint": 'learned-route, or a policy of your own on `action="waypoint"` '
    "(`uas-coverage train maskable-ppo`)",
}
"""A planner of an earlier version -> what to fly now, as it ends `fly ...`."""


def follower(name: str) -> str:
    """What follows a planner that went, in half a line; empty for every other name."""
    now = FOLLOWERS.get(name)
    return f"it went after version 0.3.0; fly {now}" if now else ""

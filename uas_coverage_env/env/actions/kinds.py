"""The kinds of action of each version."""

from uas_coverage_env.env.actions.acceleration import ACCELERATION
from uas_coverage_env.env.actions.planar import PLANAR
from uas_coverage_env.env.actions.velocity import VELOCITY, VELOCITY_V1
from uas_coverage_env.env.actions.waypoint import WAYPOINT, WAYPOINT_V1
from uas_coverage_env.env.actions.wrench import WRENCH

ACTIONS = (VELOCITY, ACCELERATION, WRENCH, WAYPOINT)
"""The kinds that `action=` knows by their names in `uas_coverage_v0`."""

ACTIONS_V1 = (VELOCITY_V1, ACCELERATION, WRENCH, PLANAR, WAYPOINT_V1)
"""Those of `uas_coverage_v1`."""

ACTION_NAMES = tuple(kind.name for kind in ACTIONS)
"""The names of the first version's."""

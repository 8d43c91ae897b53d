"""The kinds of action of this version."""

from uas_coverage_env.env.actions.acceleration import ACCELERATION
from uas_coverage_env.env.actions.velocity import VELOCITY
from uas_coverage_env.env.actions.waypoint import WAYPOINT
from uas_coverage_env.env.actions.wrench import WRENCH

ACTIONS = (VELOCITY, ACCELERATION, WRENCH, WAYPOINT)
"""The kinds that `action=` knows by their names."""

ACTION_NAMES = tuple(kind.name for kind in ACTIONS)
"""Their names."""

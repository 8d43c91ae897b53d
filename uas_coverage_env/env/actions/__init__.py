"""What a learner may do: kinds of action, each one file with its numbers and its kernel."""

from uas_coverage_env.env.actions.given import Actions, actions_of
from uas_coverage_env.env.actions.kind import ActionKind, Range
from uas_coverage_env.env.actions.kinds import ACTION_NAMES, ACTIONS
from uas_coverage_env.env.actions.velocity import ALTITUDE_MARGIN_M
from uas_coverage_env.env.actions.waypoint import HOME_CHOICE

__all__ = [
    "ACTIONS",
    "ACTION_NAMES",
    "ALTITUDE_MARGIN_M",
    "HOME_CHOICE",
    "ActionKind",
    "Actions",
    "Range",
    "actions_of",
]

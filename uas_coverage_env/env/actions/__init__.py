"""What a learner may do: kinds of action, each one file with its numbers and its kernel."""

from uas_coverage_env.env.actions.kind import ActionKind
from uas_coverage_env.env.actions.kinds import ACTIONS, ACTIONS_V1
from uas_coverage_env.env.actions.waypoint import CLIMB_CHOICE, HOLD_CHOICE, HOME_CHOICE

__all__ = ["ACTIONS", "ACTIONS_V1", "CLIMB_CHOICE", "HOLD_CHOICE", "HOME_CHOICE", "ActionKind"]

"""What a learner may do: kinds of action, each one file with its numbers and its kernel."""

from uas_coverage_env.env.actions.kind import ActionKind
from uas_coverage_env.env.actions.kinds import ACTIONS
from uas_coverage_env.env.actions.waypoint import HOME_CHOICE

__all__ = ["ACTIONS", "HOME_CHOICE", "ActionKind"]

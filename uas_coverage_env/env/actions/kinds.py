"""The kinds of action of this version."""

from typing import Any

from uas_coverage_env.env.actions.acceleration import ACCELERATION
from uas_coverage_env.env.actions.kind import ActionKind
from uas_coverage_env.env.actions.velocity import VELOCITY
from uas_coverage_env.env.actions.waypoint import WAYPOINT
from uas_coverage_env.env.actions.wrench import WRENCH

ACTIONS = (VELOCITY, ACCELERATION, WRENCH, WAYPOINT)
"""The kinds that `action=` knows by their names."""

ACTION_NAMES = tuple(kind.name for kind in ACTIONS)
"""Their names."""


def kind_of(action: Any) -> ActionKind:
    """The kind of action that is meant.

    Args:
        action: A kind, or the name of one of `ACTIONS`.

    Raises:
        ValueError: It is neither.
    """
    if isinstance(action, ActionKind):
        return action
    if action not in ACTION_NAMES:
        raise ValueError(
            f"action is {action!r}; it is one of {', '.join(ACTION_NAMES)}, or an ActionKind"
        )
    return ACTIONS[ACTION_NAMES.index(action)]

"""What may happen during a mission: the tables `[[events]]` of a scenario, a class per kind."""

import functools
import operator
import warnings
from typing import Annotated, Any

from pydantic import Field, Strict

from uas_coverage_env.features.event import GROUP, EventTable
from uas_coverage_env.features.table import shipped
from uas_coverage_env.plugins.installed import entry_points
from uas_coverage_env.plugins.users_code import described
from uas_coverage_env.scenario import scene_events


def _installed() -> list[type[EventTable]]:
    """The kinds of other packages; one that cannot be used is left out with a warning."""
    found = []
    for entry in entry_points(group=GROUP):
        try:
            kind = entry.load()
            if not issubclass(kind, EventTable) or "kind" not in kind.model_fields:
                raise TypeError(f"{kind!r} is no EventTable with a field kind")
            found.append(kind)
        except Exception as error:  # whatever a user's module raises is one line
            warnings.warn(f"event {entry.name!r} cannot be used: {described(error)}", stacklevel=2)
    return found


EVENT_KINDS: tuple[type[EventTable], ...] = (
    *shipped(EventTable),
    *scene_events.KINDS,
    *_installed(),
)
"""The classes of all kinds."""

_Event: Any = functools.reduce(operator.or_, EVENT_KINDS)

Event = Annotated[_Event, Field(discriminator="kind")]
"""A table of any kind: `kind` says which."""

Events = Annotated[tuple[Event, ...], Strict(False), Field(max_length=1000)]

# a kind is found in its own file, and imported from here
globals().update({kind.__name__: kind for kind in EVENT_KINDS})
__all__ = ["EVENT_KINDS"]
__all__ += [kind.__name__ for kind in EVENT_KINDS]

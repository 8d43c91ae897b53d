"""Tables in docstrings that come from where the facts are."""

import inspect
import textwrap
from typing import TypeVar

from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.observation import layout_table
from uas_coverage_env.env.rewards import rewards_table

C = TypeVar("C", bound=type)


def _settings() -> str:
    """What `MissionSettings` says of its attributes."""
    text = inspect.getdoc(MissionSettings) or ""
    _, _, rest = text.partition("Attributes:\n")
    return textwrap.dedent(rest.partition("\n\n")[0])


def with_tables(environment: C) -> C:
    """Put the tables of observations, rewards and settings into an environment's docstring."""
    if environment.__doc__ is not None:  # None under python -OO
        tables = {
            "{observations}": layout_table(),
            "{rewards}": rewards_table(),
            "{settings}": _settings(),
        }
        for place, table in tables.items():
            indented = table.replace("\n", "\n        ")
            environment.__doc__ = environment.__doc__.replace(place, indented)
    return environment

"""Tables in docstrings that come from where the facts are."""

from typing import TypeVar

from uas_coverage_env.env.layout import layout_table
from uas_coverage_env.env.rewards import rewards_table

C = TypeVar("C", bound=type)


def with_tables(environment: C) -> C:
    """Put the tables of observations and rewards into the docstring of an environment."""
    if environment.__doc__ is not None:  # None under python -OO
        for place, table in (("{observations}", layout_table()), ("{rewards}", rewards_table())):
            indented = table.replace("\n", "\n        ")
            environment.__doc__ = environment.__doc__.replace(place, indented)
    return environment

"""Tables of scenario files that belong to a feature, and where they are found.

A file of this folder is all that a feature takes: its table and its kinds of events are found by
what they are derived from. Another package announces a table in the entry-point group
`uas_coverage.disturbances` (then it is `[disturbances.NAME]`), a kind of event in
`uas_coverage.events`.
"""

import pkgutil
from collections.abc import Iterable
from functools import cache
from importlib import import_module
from typing import ClassVar, TypeVar

from uas_coverage_env.features.feature import MissionFeature
from uas_coverage_env.files.strict_toml import StrictModel

T = TypeVar("T")


class FeatureTable(StrictModel):
    """The fields of a feature in scenario files; to be derived from."""

    table: ClassVar[str] = ""
    """Its key, of a table that this package has."""

    def features(self) -> Iterable[MissionFeature]:
        """What a mission with this table has.

        Raises:
            NotImplementedError: The derived class does not say.
        """
        raise NotImplementedError(f"{type(self).__name__} has no method features()")


class DisturbanceTable(FeatureTable):
    """The fields of one disturbance, or another feature, in scenario files; to be derived from.

    A package announces its table in the entry-point group `uas_coverage.disturbances`, under the
    name that scenario files use.
    """

    def disturbance(self) -> MissionFeature:
        """The feature that the table describes, for example a `Disturbance`.

        Raises:
            NotImplementedError: The derived class does not say.
        """
        raise NotImplementedError(f"{type(self).__name__} has no method disturbance()")

    def features(self) -> Iterable[MissionFeature]:
        """This one."""
        return (self.disturbance(),)


@cache
def shipped(base: type[T]) -> tuple[type[T], ...]:
    """All classes derived from another that the files of this folder hold, in order of the files.

    Args:
        base: Of which they are.
    """
    package = __name__.rpartition(".")[0]
    found = []
    for module in pkgutil.iter_modules(import_module(package).__path__, f"{package}."):
        for value in vars(import_module(module.name)).values():
            own = isinstance(value, type) and value.__module__ == module.name
            if own and issubclass(value, base) and _is_named(value):
                found.append(value)
    return tuple(found)


def _is_named(table: type) -> bool:
    """Whether a class is a table, and not what tables are derived from."""
    fields = getattr(table, "model_fields", {})
    return bool(getattr(table, "table", "")) or "kind" in fields

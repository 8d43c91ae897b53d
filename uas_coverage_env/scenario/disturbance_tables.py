"""The tables `[disturbances.NAME]` of a scenario, each read by the package that installed NAME."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import PlainSerializer, PlainValidator, WithJsonSchema

from uas_coverage_env.features.table import FeatureTable
from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.plugins.installed import entry_points
from uas_coverage_env.plugins.users_code import described

GROUP = "uas_coverage.disturbances"


def _read(value: Any) -> tuple[tuple[str, FeatureTable], ...]:
    try:
        given = dict(value)
    except (TypeError, ValueError):
        raise ValueError("should be tables [disturbances.NAME]") from None
    return tuple((name, _table(str(name), given[name])) for name in sorted(given, key=str))


def _table(name: str, value: Any) -> FeatureTable:
    if isinstance(value, FeatureTable):
        return value
    installed = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name not in installed:
        known = ", ".join(sorted(installed)) or "none"
        raise ValueError(f"no disturbance {name[:80]!r} is installed; there are: {known}")
    if not isinstance(value, Mapping):
        raise ValueError(f"{name} should be a table [disturbances.{name}]")
    try:
        model = installed[name].load()
    except Exception as error:  # whatever a user's module raises is one line
        raise ValueError(f"disturbance {name!r} cannot be loaded: {described(error)}") from error
    if not isinstance(model, type) or not issubclass(model, FeatureTable):
        raise ValueError(f"disturbance {name!r} is installed as {model!r}, no DisturbanceTable")
    return parse(value, model, name)


def _plain(tables: tuple[tuple[str, FeatureTable], ...]) -> dict[str, Any]:
    return {name: table.model_dump(mode="json", by_alias=True) for name, table in tables}


DisturbanceTables = Annotated[
    tuple[tuple[str, FeatureTable], ...],
    PlainValidator(_read),
    PlainSerializer(_plain),
    WithJsonSchema({"type": "object", "additionalProperties": {"type": "object"}}),
]
"""Name -> table, as pairs in the order of the names: a scenario can be hashed."""

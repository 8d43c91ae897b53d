"""The JSON Schema of scenario files, with the meaning of every field, for editors and the docs."""

import inspect
import re
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel

from uas_coverage_env.features.parameter_errors import Uncertainty
from uas_coverage_env.features.sensing import Sensing
from uas_coverage_env.features.wind import Gust, RandomGusts, Wind
from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.scenario.events import EVENT_KINDS
from uas_coverage_env.scenario.execution import Execution
from uas_coverage_env.scenario.fields import (
    Decoration,
    Geofence,
    MovingObstacle,
    Obstacle,
    Place,
    ScheduledVelocity,
    Sensor,
    Uas,
    Waypoint,
)
from uas_coverage_env.scenario.model import Scenario
from uas_coverage_env.scenario.packs import Sorties
from uas_coverage_env.scenario.planar import PLACES, Planar
from uas_coverage_env.scenario.reserve import LandingReserve
from uas_coverage_env.scenario.walls import Door, Wall

_TABLES = (
    *(Geofence, Uas, Sensor, Waypoint, Obstacle, MovingObstacle, ScheduledVelocity, Decoration),
    *(Place, Wind, Gust, RandomGusts, Uncertainty, Sensing, Sorties, LandingReserve, Execution),
    *(Planar, Wall, Door),
    *EVENT_KINDS,
)
_ENTRY = re.compile(r"^    (\w+): (.*(?:\n {8}.*)*)", re.MULTILINE)


def scenario_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of a scenario file.

    It knows names, types, ranges and what has to be there. What takes geometry to tell (is a start
    clear of the obstacles?) only `load_scenario` checks.
    """
    schema = Scenario.model_json_schema(by_alias=True)
    _describe(schema, Scenario)
    for model in _TABLES:
        _describe(schema["$defs"][model.__name__], model)
    for name in ("Uas", "Waypoint", *(kind.__name__ for kind in EVENT_KINDS)):
        for key, entry in schema["$defs"][name]["properties"].items():
            if any(key in keys for keys in PLACES.values()) and "prefixItems" in entry:
                entry["minItems"] = 2
    # with their heights, unless the mission has one
    whole = {
        table: {"items": {"properties": {key: {"minItems": 3} for key in keys}}}
        for table, keys in PLACES.items()
    }
    schema |= {"if": {"required": ["planar"]}, "else": {"properties": whole}}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _describe(table: dict[str, Any], model: type[BaseModel]) -> None:
    """Put the docstring's sentences where editors show them."""
    summary = (inspect.getdoc(model) or "").partition("\nAttributes:")[0]
    table["description"] = " ".join(summary.split())
    meanings = {name: " ".join(text.split()) for name, text in _meanings(model)}
    for name, field in model.model_fields.items():
        entry = table["properties"][field.alias or name]
        entry["description"] = meanings.get(name, "")
        if entry.get("type") == "array" and "minLength" in entry:
            # where a validator stands before a tuple pydantic takes it for text
            entry["minItems"] = entry.pop("minLength")


def _meanings(model: type[BaseModel]) -> Iterator[tuple[str, str]]:
    """Name and meaning of each field, as its own class says it, or that it is derived from."""
    for each in reversed(model.__mro__):
        if issubclass(each, StrictModel):
            yield from _ENTRY.findall((inspect.getdoc(each) or "").partition("\nAttributes:")[2])

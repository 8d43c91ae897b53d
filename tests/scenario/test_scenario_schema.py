"""The JSON Schema of scenario files, for editors: it agrees with the reader."""

import json
import tomllib
from importlib.resources import files

import jsonschema
import pytest

from uas_coverage_env.files.strict_toml import InputError, parse
from uas_coverage_env.scenario import Scenario, scenario_names
from uas_coverage_env.scenario.schema import scenario_schema


@pytest.fixture(scope="module")
def validator():
    jsonschema.Draft202012Validator.check_schema(scenario_schema())
    return jsonschema.Draft202012Validator(scenario_schema())


def shipped(name):
    return tomllib.loads(files("uas_coverage_env.scenario").joinpath(f"{name}.toml").read_text())


@pytest.mark.parametrize("name", scenario_names())
def test_shipped_scenarios_obey_the_schema(name, validator):
    validator.validate(shipped(name))


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [
        ("geofence", "vertices_m", [[0.0, 0.0, 0.0]] * 3),
        ("geofence", "margin", 1.0),
        ("geofence", "margin_m", -1.0),
        ("geofence", "margin_m", "1"),
        ("uas", "soc_0", 0.0),
        ("uas", "dod_max", 1.0),
        ("waypoints", "position_m", [0.0, 0.0]),
        ("waypoints", "weight", None),
    ],
)
def test_schema_and_reader_refuse_the_same_mistakes(table, key, value, validator):
    data = shipped("open_field")
    part = data[table]
    (part[0] if isinstance(part, list) else part)[key] = value
    assert not validator.is_valid(data)
    with pytest.raises(InputError):
        parse(data, Scenario, "mine.toml")


def test_every_key_says_what_it_is():
    schema = scenario_schema()
    for part in (schema, *schema["$defs"].values()):
        assert part["description"]
        for key, entry in part["properties"].items():
            assert entry["description"], key
    json.dumps(schema, allow_nan=False)

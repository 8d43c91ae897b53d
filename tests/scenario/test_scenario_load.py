"""Generic mistakes in a scenario file: one line, with file, field, value and fix."""

from pathlib import Path

import pytest

from uas_coverage_env import rollout
from uas_coverage_env import scenario as room
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.scenario import load_scenario, scenario_names, warnings
from uas_coverage_env.scenario.families import installed_families

TEXT = (Path(room.__file__).parent / "open_field.toml").read_text(encoding="utf-8")
WAYPOINTS = TEXT[TEXT.index("[[waypoints]]") : TEXT.index("# Drawn only")]
MOVING = """
[[moving_obstacles]]
name = "van"
radius_m = 2.0
height_m = 3.0
safe_distance_m = 2.0
start_m = [150.0, 200.0, -1.5]
schedule = SCHEDULE
"""


def mistake_in(tmp_path, text):
    path = tmp_path / "mission.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    line = str(caught.value)
    assert len(line.splitlines()) == 1
    assert line.startswith(f"{path}: ")
    return line.removeprefix(f"{path}: ")


def test_the_shipped_scenarios_load_by_name_and_give_no_warning():
    known = (
        "air_taxi",
        "corridor",
        "gasche2025",
        "indoor",
        "karhula",
        "mixed_fleet",
        "open_field",
        "village",
    )
    assert scenario_names() == known
    for name in scenario_names():
        scenario = load_scenario(name)
        assert scenario.name == name
        assert warnings(scenario) == []


def test_an_unknown_name_lists_what_there_is():
    with pytest.raises(InputError, match="unknown scenario 'moon'; take air_taxi, corridor"):
        load_scenario("moon")
    with pytest.raises(InputError, match="unknown scenario ''"):
        load_scenario("")
    with pytest.raises(InputError, match="unknown scenario '3'"):
        load_scenario(3)


def test_a_generated_scenario_has_a_name_and_a_seed():
    for name, family in installed_families().items():
        assert load_scenario(f"{name}:5") == family.of_seed(5)


def test_a_generated_scenario_is_a_town_too_and_its_seed_may_be_called_one():
    assert (
        load_scenario("town:5") == load_scenario("generated:seed=5") == load_scenario("town:seed=5")
    )


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"mission\.toml: no such file; check the path"):
        load_scenario(tmp_path / "mission.toml")
    with pytest.raises(InputError, match=r"mission\.toml: no such file"):
        load_scenario("mission.toml")
    with pytest.raises(InputError, match="is a folder"):
        load_scenario(str(tmp_path))


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("schema = 1\n", "", "schema: is missing"),
        ("schema = 1", "schema = 2", "schema: should be less than or equal to 1, not 2"),
        ("schema = 1", "schema_version = 1", "schema_version: unknown key"),
        ("dt_s = 1.0", "dt_s = 0", "dt_s: should be greater than or equal to 0.02, not 0"),
        ("dt_s = 1.0", "dt_s = 12.5", "dt_s: should be less than or equal to 10, not 12.5"),
        ("dt_s = 1.0", "dt_s = nan", "dt_s: should be a finite number, not nan"),
        ("dt_s = 1.0", 'dt_s = "1"', 'dt_s: should be a number, not "1"'),
        ("dt_s = 1.0", "dt_s = true", "dt_s: should be a number, not true"),
        ("dt_s = 1.0", "dt = 1.0", "dt: unknown key; did you mean dt_s? (+1 more)"),
        ("dt_s = 1.0", "dt_s = ", "is not valid TOML"),
        ("max_steps = 300", "max_steps = 0", "max_steps: should be greater than or equal to 1"),
        ("max_steps = 300", "max_steps = 100001", "max_steps: should be less than or equal to"),
        ("max_steps = 300", "max_steps = 1.5", "max_steps: should be a whole number, not 1.5"),
        ("landing_distance_m = 2.0", "landing_distance_m = 0", "landing_distance_m: should be gr"),
        ("landing_speed_mps = 0.5", "landing_speed_mps = -1", "landing_speed_mps: should be gr"),
        ("uas_safe_distance_m = 5.0", "uas_safe_distance_m = -5", "uas_safe_distance_m: should"),
        ("[geofence]\nmargin_m = 0.5", "[geofence]", "geofence.margin_m: is missing; add it"),
        ("margin_m = 0.5", "margin_m = -0.5", "geofence.margin_m: should be greater than or equ"),
        ("[geofence]", "[fence]", "fence: unknown key; did you mean geofence? (+1 more)"),
        ("[300.0, 0.0, -40.0]", "[300.0, 0.0]", "geofence.vertices_m[5][2]: is missing"),
        ("[300.0, 0.0, -40.0]", "[300.0, 0.0, 1e6]", "geofence.vertices_m[5][2]: should be less"),
        (WAYPOINTS, "", "waypoints: is missing; add it"),
        (WAYPOINTS, "[waypoints]\n", "waypoints: should be a list, not {}"),
        ("radius_m = 15.0", "radius_m = -15", "waypoints[0].radius_m: should be greater than 0"),
        ("radius_m = 15.0\nweight = 1.0", "radius_m = 15\n", "waypoints[0].weight: is missing"),
        ("weight = 1.0", "weight = 0", "waypoints[0].weight: should be greater than 0, not 0"),
        ("weight = 1.0", "weigth = 1.0", "waypoints[0].weigth: unknown key; did you mean weight?"),
        ('kind = "field"', "kind = 3", "waypoints[0].kind: should be text in quotes, not 3"),
        ("soc_0 = 1.0", "soc_0 = 1.1", "uas[0].soc_0: should be less than or equal to 1, not 1.1"),
        ("soc_0 = 1.0", "soc_0 = 0", "uas[0].soc_0: should be greater than 0, not 0"),
        ("dod_max = 0.75", "dod_max = 1.0", "uas[0].dod_max: should be less than 1, not 1.0"),
        ("radius_m = 0.36", "radius_m = 0", "uas[0].radius_m: should be greater than 0, not 0"),
        ('name = "uas_1"', 'name = ""', "uas[0].name: '' is no valid name; use 1 to 64 letters"),
        ('name = "uas_1"', 'name = "a,b"', "uas[0].name: 'a,b' is no valid name"),
        ('name = "uas_1"', 'name = "../x"', "uas[0].name: '../x' is no valid name"),
        ('name = "uas_1"', 'name = "uäs"', "uas[0].name: 'uäs' is no valid name"),
        ('name = "uas_1"', 'name = "uas_2"', "uas[1].name: 'uas_2' is used twice; give each its"),
        (
            'vehicle = "s500_v2"',
            'vehicle = "s501"',
            "uas[0].vehicle: unknown vehicle 's501'; take air_taxi, crazyflie, hexacopter, s500_v2",
        ),
        ('vehicle = "s500_v2"', 'vehicle = "own.toml"', "uas[0].vehicle: no vehicle file at /"),
        (
            'vehicle = "s500_v2"',
            f'vehicle = "{"v" * 300}.toml"',
            f"uas[0].vehicle: vehicle file '{'v' * 80}' cannot be read (file name too long)",
        ),
        ("[[146.0, 0.0], [154.0, 0.0], ", "[", "decorations[0].polygon_m: needs at least 3"),
    ],
)
def test_a_generic_mistake_is_one_line_with_field_value_and_fix(tmp_path, old, new, expected):
    assert old in TEXT
    text = TEXT.replace(old, new, 1)
    assert mistake_in(tmp_path, text).startswith(expected)


@pytest.mark.parametrize(
    ("schedule", "expected"),
    [
        ("[]", "moving_obstacles[0].schedule: needs at least 1 of them, not 0"),
        (
            "[{from_s = 1.0, velocity_mps = [0, 0, 0]}]",
            "moving_obstacles[0].schedule: starts at from_s = 1; add a first entry at from_s = 0",
        ),
        (
            "[{from_s = 0, velocity_mps = [0, 0, 0]}, {from_s = 9, velocity_mps = [1, 0, 0]},"
            " {from_s = 9, velocity_mps = [2, 0, 0]}]",
            "moving_obstacles[0].schedule: from_s = 9 follows 9; list the entries in order",
        ),
        (
            "[{from_s = 0, velocity_mps = [0, 0]}]",
            "moving_obstacles[0].schedule[0].velocity_mps[2]: is missing; add it",
        ),
        (
            "[{from_s = 0, speed = 3, velocity_mps = [0, 0, 0]}]",
            "moving_obstacles[0].schedule[0].speed: unknown key; allowed here: from_s, velocity",
        ),
    ],
)
def test_the_schedule_of_a_moving_obstacle_starts_at_zero_and_increases(
    tmp_path, schedule, expected
):
    assert mistake_in(tmp_path, TEXT + MOVING.replace("SCHEDULE", schedule)).startswith(expected)


def test_obstacles_decorations_and_kinds_may_be_left_out(tmp_path):
    text = TEXT[: TEXT.index("# Drawn only")].replace('kind = "field"\n', "")
    path = tmp_path / "mission.toml"
    path.write_text(text, encoding="utf-8")
    scenario = load_scenario(str(path))
    assert scenario.obstacles == scenario.moving_obstacles == scenario.decorations == ()
    assert scenario.waypoints[0].kind is None
    assert len(scenario.waypoints) == 16


def test_a_mistake_in_a_vehicle_file_is_reported_with_the_field_that_names_it(tmp_path):
    (tmp_path / "own.toml").write_text("name = 3\n", encoding="utf-8")
    line = mistake_in(tmp_path, TEXT.replace('"s500_v2"', '"own.toml"', 1))
    assert line.startswith(f"uas[0].vehicle: {tmp_path / 'own.toml'}: ")


@pytest.mark.parametrize("name", ["area.kml", "areas/site.GeoJSON", "survey.plan"])
def test_a_drawn_area_is_no_scenario_yet_and_the_message_says_how_it_becomes_one(name):
    with pytest.raises(InputError, match="uas-coverage import") as refusal:
        load_scenario(name)
    assert f"--out {name.rpartition('/')[2].partition('.')[0]}.toml" in str(refusal.value)


def test_the_scenario_of_a_flight_is_flown_again_by_its_path(tmp_path):
    flight = rollout("open_field", "nearest-waypoint", seed=0, max_steps=3)
    flight.save(tmp_path / "flight")
    path = tmp_path / "flight" / "scenario.json"
    assert load_scenario(path) == load_scenario(str(path)) == load_scenario("open_field")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{", "is not valid JSON: Expecting property name"),
        ("[1]", "is not valid JSON: it should hold one object"),
        ('{"schema": "1"}', 'schema: should be a whole number, not "1"'),
        ("[" * 100_000, "brackets are nested too deeply"),
    ],
)
def test_a_wrong_json_file_is_one_line(tmp_path, text, expected):
    path = tmp_path / "mission.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    line = str(caught.value)
    assert line.startswith(f"{path}: {expected}")
    assert len(line.splitlines()) == 1

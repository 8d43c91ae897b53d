"""A scenario is one immutable value: from files, from code, through pickle, JSON and TOML."""

import json
import pickle
from importlib import resources

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from uas_coverage_env import vehicle
from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.scenario import (
    Decoration,
    Geofence,
    MovingObstacle,
    Obstacle,
    Place,
    Scenario,
    ScheduledVelocity,
    Uas,
    Waypoint,
    generate_scenario,
    load_scenario,
    scenario_names,
)

EXAMPLES = settings(max_examples=60, deadline=None, derandomize=True)


def box(north, east, down):
    return np.array([[x, y, z] for x in north for y in east for z in down], dtype=float)


def small(**changes):
    """A scenario built in Python, with lists and arrays where the fields hold tuples."""
    fields = {
        "schema": 1,
        "name": "small",
        "dt_s": 1,
        "max_steps": 50,
        "landing_distance_m": 2.0,
        "landing_speed_mps": 0.5,
        "uas_safe_distance_m": 5.0,
        "geofence": Geofence(margin_m=0.5, vertices_m=box((0, 100), (0, 100), (-40, 0))),
        "obstacles": [
            Obstacle(name="hut", safe_distance_m=2, vertices_m=box((40, 60), (40, 60), (-9, 0)))
        ],
        "uas": [
            Uas(
                name="uas_1",
                vehicle="s500_v2",
                start_m=[10, 10, -1],
                soc_0=1.0,
                radius_m=0.36,
                dod_max=0.75,
            )
        ],
        "waypoints": [
            Waypoint(position_m=np.array([80.0, 80.0, -15.0]), radius_m=15.0, weight=1),
            Waypoint(kind="roof", position_m=(50.0, 50.0, -20.0), radius_m=15.0, weight=2.5),
        ],
    }
    return Scenario(**(fields | changes))


@pytest.mark.parametrize("name", scenario_names())
def test_a_written_scenario_reads_back_equal(name, tmp_path):
    scenario = load_scenario(name)
    scenario.to_file(tmp_path / "copy.toml")
    again = load_scenario(tmp_path / "copy.toml")
    assert again == scenario
    assert hash(again) == hash(scenario)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    st.floats(0.1, 2.0),
    st.floats(1e-5, 1e6, allow_subnormal=False),
    st.text(min_size=1, max_size=20).filter(lambda text: text.isprintable()),
    st.floats(-100, 100),
)
def test_any_value_survives_the_file(tmp_path_factory, dt_s, weight, kind, speed_mps):
    scenario = small(
        dt_s=dt_s,
        waypoints=[Waypoint(kind=kind, position_m=(80, 80, -9.1), radius_m=1 / 3, weight=weight)],
        moving_obstacles=[
            MovingObstacle(
                name="van",
                radius_m=1e-3,
                height_m=2.0,
                safe_distance_m=0.0,
                start_m=(50.0, 90.0, -1.0),
                schedule=[
                    ScheduledVelocity(from_s=0, velocity_mps=(0, 0, 0)),
                    ScheduledVelocity(from_s=1e-3, velocity_mps=[0, speed_mps, 0]),
                ],
            )
        ],
        decorations=[Decoration(name="pond", polygon_m=[[1, 2], [3, 4.5], [5, 6]])],
    )
    path = tmp_path_factory.mktemp("scenario") / "any.toml"
    scenario.to_file(path)
    assert load_scenario(path) == scenario


def test_an_equal_scenario_comes_out_of_pickle_and_json():
    scenario = load_scenario("village")
    assert len(scenario.hulls) == 10
    thawed = pickle.loads(pickle.dumps(scenario))
    assert thawed == scenario
    assert hash(thawed) == hash(scenario)
    assert thawed.hulls[3].n_faces == scenario.hulls[3].n_faces
    text = json.dumps(scenario.model_dump(mode="json", by_alias=True))
    assert parse(json.loads(text), Scenario, "scenario.json") == scenario
    assert Scenario.model_validate_json(text) == scenario


def test_json_has_every_default_filled_in():
    dumped = small(obstacles=()).model_dump(mode="json", by_alias=True)
    assert dumped["schema"] == 1
    assert dumped["obstacles"] == dumped["moving_obstacles"] == dumped["decorations"] == []
    assert dumped["waypoints"][0]["kind"] is None


def test_what_has_been_computed_does_not_travel_to_other_processes():
    fresh, used = pickle.dumps(load_scenario("village")), load_scenario("village")
    assert (len(used.hulls), used.fence.n_faces, len(used.vehicles)) == (10, 6, 2)
    assert used.moving_positions(3.0).shape == (1, 3)
    assert len(pickle.dumps(used)) == len(fresh)


def test_a_scenario_cannot_be_changed_and_a_changed_copy_is_checked():
    scenario = small()
    with pytest.raises(ValueError, match="frozen"):
        scenario.dt_s = 0.5
    with pytest.raises(ValueError, match="frozen"):
        scenario.uas[0].soc_0 = 0.5
    assert len(scenario.hulls) == 1
    without = scenario.model_copy(update={"obstacles": ()})
    assert without.hulls == ()
    assert without != scenario
    flat_battery = scenario.uas[0].model_copy(update={"soc_0": 0.2})
    with pytest.raises(ValueError, match=r"uas\[0\]\.soc_0: 0\.2 is a depth of discharge of 0\.8"):
        scenario.model_copy(update={"uas": (flat_battery,)})


def test_python_code_gets_the_same_strictness_as_files():
    with pytest.raises(ValueError, match="valid number"):
        small(dt_s="1")
    with pytest.raises(ValueError, match="valid number"):
        small(dt_s=True)
    with pytest.raises(ValueError, match="finite"):
        Waypoint(position_m=[0, 0, float("nan")], radius_m=1, weight=1)
    with pytest.raises(ValueError, match=r"waypoints\[0\]\.position_m: \(50, 50, -3\)"):
        small(waypoints=[Waypoint(position_m=(50, 50, -3), radius_m=15, weight=1)])
    with pytest.raises(ValueError, match="Extra inputs"):
        small(colour="red")


def test_the_village_is_the_one_that_was_designed():
    village = load_scenario("village")
    assert (len(village.waypoints), len(village.obstacles), len(village.uas)) == (49, 10, 2)
    assert sum(waypoint.weight for waypoint in village.waypoints) == 65.0
    assert village.uas[1].soc_0 == 0.433
    assert [hull.n_faces for hull in village.hulls] == [8, 8, 8, 8, 6, 6, 6, 6, 6, 12]
    np.testing.assert_array_equal(np.sort(village.fence.offsets_m), [-500, -500, -50, 0, 0, 0])


def test_the_fleet_of_the_corridor_is_mixed():
    corridor = load_scenario("corridor")
    assert [uas.vehicle for uas in corridor.uas] == ["s500_v2", "hexacopter"]
    quadcopter, hexacopter = corridor.vehicles
    assert hexacopter.airframe.n_motors == 6
    assert quadcopter.airframe.n_motors == 4


def test_the_helicopter_of_the_village_waits_climbs_and_leaves_to_the_east():
    village = load_scenario("village")
    for time_s, expected in [
        (0.0, [250, 452, -3]),
        (115.0, [250, 452, -3]),
        (116.5, [250, 452, -7.5]),
        (121.0, [250, 452, -21]),
        (123.0, [250, 482, -25]),
        (181.0, [250, 1352, -141]),
        (9999.0, [250, 1352, -141]),
    ]:
        np.testing.assert_allclose(village.moving_positions(time_s), [expected], atol=1e-9)
    for time_s, expected in [
        (0.0, [0, 0, 0]),
        (114.999, [0, 0, 0]),
        (115.0, [0, 0, -3]),
        (121.0, [0, 15, -2]),
        (181.0, [0, 0, 0]),
    ]:
        np.testing.assert_array_equal(village.moving_velocities(time_s), [expected])


def test_many_times_at_once_give_what_each_gives_to_the_bit():
    times_s = 0.3 * np.arange(900)
    village = load_scenario("village")
    for at in (village.moving_positions, village.moving_velocities):
        assert at(times_s).tolist() == [at(time_s).tolist() for time_s in times_s.tolist()]


SPEED = st.floats(-20, 20)


@EXAMPLES
@given(
    st.lists(st.tuples(st.floats(0.1, 9), st.tuples(SPEED, SPEED, SPEED)), min_size=1, max_size=5),
    st.floats(0, 30),
)
def test_moving_obstacles_move_with_the_velocity_they_have(pieces, time_s):
    starts = np.cumsum([0.0, *(duration for duration, _ in pieces[1:])])
    van = MovingObstacle(
        name="van",
        radius_m=1.0,
        height_m=2.0,
        safe_distance_m=1.0,
        start_m=(50, 90, -1),
        schedule=[
            ScheduledVelocity(from_s=float(from_s), velocity_mps=velocity)
            for from_s, (_, velocity) in zip(starts, pieces, strict=True)
        ],
    )
    scenario = small(moving_obstacles=[van, van.model_copy(update={"name": "second_van"})])
    position = np.array(van.start_m)
    changes = [float(start) for start in starts if start <= time_s]
    for begin, end in zip(changes, [*changes[1:], time_s], strict=True):
        held = [entry for entry in van.schedule if entry.from_s <= begin][-1]
        assert scenario.moving_velocities(begin)[0] == pytest.approx(held.velocity_mps)
        position = position + (end - begin) * np.array(held.velocity_mps)
    found = scenario.moving_positions(time_s)
    assert found.shape == (2, 3)
    np.testing.assert_allclose(found, [position, position], atol=1e-9)


def test_without_moving_obstacles_there_are_no_positions():
    assert small().moving_positions(5.0).shape == (0, 3)
    assert small().moving_velocities(5.0).shape == (0, 3)


def test_a_vehicle_file_is_found_beside_the_scenario_and_kept_as_an_absolute_path(
    tmp_path, monkeypatch
):
    shipped = resources.files(vehicle) / "s500_v2.toml"
    (tmp_path / "vehicles").mkdir()
    own = tmp_path / "vehicles" / "own.toml"
    own.write_text(shipped.read_text(encoding="utf-8"), encoding="utf-8")
    mission = tmp_path / "mission.toml"
    small().to_file(mission)
    mission.write_text(
        mission.read_text(encoding="utf-8").replace('"s500_v2"', '"vehicles/own.toml"'),
        encoding="utf-8",
    )
    scenario = load_scenario(mission)
    assert scenario.uas[0].vehicle == str(own)
    monkeypatch.chdir(tmp_path.parent)
    assert pickle.loads(pickle.dumps(scenario)).vehicles == load_scenario(mission).vehicles
    monkeypatch.chdir(tmp_path)
    here = Uas(**(small().uas[0].model_dump() | {"vehicle": "vehicles/own.toml"}))
    assert here.vehicle == str(own)


def test_a_scenario_takes_its_vehicles_along_to_where_their_files_are_others(tmp_path):
    text = (resources.files(vehicle) / "s500_v2.toml").read_text(encoding="utf-8")
    own = tmp_path / "own.toml"
    own.write_text(text, encoding="utf-8")
    uas = small().uas[0].model_copy(update={"vehicle": str(own)})
    scenario = small().model_copy(update={"uas": (uas,)})
    copy = pickle.dumps(scenario)
    own.write_text(text.replace("capacity_Ah = 5.0", "capacity_Ah = 6.0"), encoding="utf-8")
    assert pickle.loads(copy) == scenario
    assert [known.battery.capacity_Ah for known in pickle.loads(copy).vehicles] == [5.0]
    own.unlink()
    assert [known.battery.capacity_Ah for known in pickle.loads(copy).vehicles] == [5.0]


def test_a_generated_scenario_is_a_scenario_like_any_other(tmp_path):
    scenario = generate_scenario(3, n_waypoints=9)
    scenario.to_file(tmp_path / "generated.toml")
    assert load_scenario(tmp_path / "generated.toml") == scenario


def test_a_place_on_the_earth_is_kept_in_the_file_and_absent_where_there_is_none(tmp_path):
    nowhere = small()
    assert "place" not in nowhere.content()
    there = nowhere.model_copy(update={"place": Place(latitude_deg=60.5, longitude_deg=-180)})
    there.to_file(tmp_path / "there.toml")
    assert "\n[place]\nlatitude_deg = 60.5\nlongitude_deg = -180.0\nheight_m = 0.0\n" in (
        tmp_path / "there.toml"
    ).read_text(encoding="utf-8")
    assert load_scenario(tmp_path / "there.toml") == there
    assert there != nowhere


@pytest.mark.parametrize("wrong", [{"latitude_deg": 90.1}, {"longitude_deg": -181}, {"x": 1}])
def test_a_place_that_is_none_is_refused(wrong):
    good = {"latitude_deg": 1.0, "longitude_deg": 2.0}
    data = small().model_dump(mode="json", by_alias=True)
    assert parse(data | {"place": good}, Scenario, "").place is not None
    with pytest.raises(ValueError, match="place"):
        parse(data | {"place": good | wrong}, Scenario, "")

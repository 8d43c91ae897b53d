"""What UAS carry and waypoints ask for, in scenario files."""

import pytest
from small_worlds import meadow, waypoint

from uas_coverage_env import load_scenario
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.refusal import refuse_what_asks
from uas_coverage_env.scenario import Scenario, warnings


def with_changes(waypoint_asks=None, sensors=None):
    data = meadow(waypoints=[waypoint((100.0, 150.0, -20.0))]).model_dump(
        mode="json", by_alias=True
    )
    data["waypoints"][0] |= waypoint_asks or {}
    if sensors is not None:
        data["uas"][0]["sensors"] = sensors
    return data


def refusal(**changes):
    with pytest.raises(InputError) as caught:
        parse(with_changes(**changes), Scenario, "mine")
    return str(caught.value)


def test_a_scenario_that_asks_for_nothing_has_none_of_the_keys():
    data = load_scenario("village").content()
    assert not {"sensor", "heights_m", "max_speed_mps"} & set(data["waypoints"][0])
    assert not {"sensors", "heading"} & set(data["uas"][0])


def test_a_file_with_sensors_reads_back_equal(tmp_path):
    scenario = load_scenario("mixed_fleet")
    scenario.to_file(tmp_path / "again.toml")
    assert load_scenario(tmp_path / "again.toml") == scenario


def test_mistakes_are_one_line_with_field_value_and_fix():
    assert "waypoints[0]: heights_m from 5 to 12 do not hold the height 20" in refusal(
        waypoint_asks={"heights_m": [5.0, 12.0]}
    )
    assert "waypoints[0].max_speed_mps" in refusal(waypoint_asks={"max_speed_mps": 0.0})
    assert "uas[0].sensors: 'gas' is carried twice" in refusal(
        sensors=[{"name": "gas"}, {"name": "gas"}]
    )
    assert "uas[0].sensors[0].field_of_view_deg[1]" in refusal(
        sensors=[{"name": "camera", "field_of_view_deg": [60.0, 180.0]}]
    )
    assert "uas[0].sensors[0].fov: unknown key" in refusal(sensors=[{"name": "a", "fov": 1}])


def test_where_a_uas_looks_is_one_of_two_and_reads_back_equal(tmp_path):
    data = meadow().model_dump(mode="json", by_alias=True)
    data["uas"][0]["heading"] = "course"
    scenario = parse(data, Scenario, "mine")
    scenario.to_file(tmp_path / "again.toml")
    assert load_scenario(tmp_path / "again.toml").uas[0].heading == "course"
    for wrong in ("east", 90.0, ""):
        data["uas"][0]["heading"] = wrong
        with pytest.raises(InputError, match=r"mine: uas\[0\].heading: .*'north' or 'course'"):
            parse(data, Scenario, "mine")


def test_a_sensor_that_no_uas_carries_is_warned_of_in_one_line():
    data = with_changes({"sensor": "termal"}, [{"name": "thermal"}])
    data["waypoints"] *= 3
    (line,) = [w for w in warnings(parse(data, Scenario, "mine")) if "carries" in w]
    assert line == (
        "waypoints[0].sensor (+2 more): no UAS carries 'termal', so none covers it; add it to "
        "uas.sensors (did you mean thermal?)"
    )


def test_heights_that_no_uas_may_fly_at_are_warned_of():
    data = with_changes({"heights_m": [0.0, 20.0], "position_m": [100.0, 150.0, -20.0]})
    data["min_height_m"] = 25.0
    data["uas"][0]["start_m"] = [20.0, 20.0, -26.0]
    assert "covered only from below min_height_m" in "".join(
        warnings(parse(data, Scenario, "mine"))
    )


def test_planners_know_which_uas_cover_what():
    brief = MissionBrief.of(load_scenario("mixed_fleet"))
    assert brief.can_cover.sum(axis=1).tolist() == [15, 5]
    assert (brief.can_cover.sum(axis=0) == 1).all()


def test_planners_that_do_not_plan_for_it_refuse_in_one_line():
    refuse_what_asks(MissionBrief.of(load_scenario("village")))
    with pytest.raises(ValueError, match=r"^waypoints\[0\] \(\+19 more\) asks for a sensor.*tour"):
        refuse_what_asks(MissionBrief.of(load_scenario("mixed_fleet")))

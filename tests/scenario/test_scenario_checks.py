"""Places and batteries that make a scenario wrong or doubtful."""

import copy

import pytest

from uas_coverage_env.files.strict_toml import InputError, parse
from uas_coverage_env.scenario import Scenario, load_scenario, warnings
from uas_coverage_env.scenario.feasibility import back_and_forth


def box(north, east, down):
    return [[x, y, z] for x in north for y in east for z in down]


def uas(name, north, east, **changes):
    fields = {"vehicle": "s500_v2", "soc_0": 1.0, "radius_m": 0.4, "dod_max": 0.75}
    return {"name": name, "start_m": [north, east, -1.0], **fields, **changes}


def waypoint(north, east, down, **changes):
    return {"position_m": [north, east, down], "radius_m": 15.0, "weight": 1.0, **changes}


DATA = {
    "schema": 1,
    "name": "checked",
    "dt_s": 1.0,
    "max_steps": 200,
    "landing_distance_m": 2.0,
    "landing_speed_mps": 0.5,
    "uas_safe_distance_m": 5.0,
    "geofence": {"margin_m": 0.5, "vertices_m": box((0, 200), (0, 200), (-50, 0))},
    "obstacles": [
        {"name": "hut", "safe_distance_m": 3.0, "vertices_m": box((90, 110), (90, 110), (-10, 0))},
        {"name": "tower", "safe_distance_m": 3.0, "vertices_m": box((20, 40), (80, 99), (-49, 0))},
    ],
    "moving_obstacles": [
        {
            "name": "van",
            "radius_m": 2.0,
            "height_m": 4.0,
            "safe_distance_m": 5.0,
            "start_m": [150.0, 100.0, -2.0],
            "schedule": [{"from_s": 0.0, "velocity_mps": [0.0, 1.0, 0.0]}],
        }
    ],
    "uas": [uas("uas_1", 50.0, 10.0), uas("uas_2", 70.0, 10.0)],
    "waypoints": [waypoint(100.0, 100.0, -20.0), waypoint(160.0, 40.0, -14.0)],
    "decorations": [{"name": "pond", "polygon_m": [[0, 0], [1, 0], [0, 1]]}],
}


def with_changes(*changes):
    """The sound scenario with values replaced: (path of keys, value)."""
    data = copy.deepcopy(DATA)
    for path, value in changes:
        entry = data
        for key in path[:-1]:
            entry = entry[key]
        entry[path[-1]] = value
    return parse(data, Scenario, "mission.toml")


def place(field, index, key, value):
    return ((field, index, key), value)


def test_the_scenario_of_these_tests_is_sound():
    scenario = with_changes()
    assert scenario.name == "checked"
    assert warnings(scenario) == []


WP, START, VERTICES = "position_m", "start_m", "vertices_m"
FLAT = box((90, 110), (90, 110), (0, 0))


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (
            [place("waypoints", 1, WP, [100.0, 95.0, -7.0])],
            "waypoints[1].position_m: (100, 95, -7) lies 3 m inside obstacle 'hut'; move it out",
        ),
        (
            [place("waypoints", 0, WP, [100.0, 203.5, -7.0])],
            "waypoints[0].position_m: (100, 203.5, -7) lies 3.5 m outside the geofence; "
            "move it inside",
        ),
        (
            [place("uas", 0, START, [-2.0, 10.0, -1.0])],
            "uas[0].start_m: (-2, 10, -1) lies 2 m outside the geofence; move it inside",
        ),
        (
            [place("uas", 0, START, [50.0, 10.0, -0.25])],
            "uas[0].start_m: (50, 10, -0.25) is 0.25 m from the geofence, within its margin_m "
            "0.5, where no planner can start; move it further in",
        ),
        (
            [place("uas", 0, START, [50.0, 10.0, 0.0])],
            "uas[0].start_m: (50, 10, 0) is 0 m from the geofence, within its margin_m "
            "0.5, where no planner can start; move it further in",
        ),
        (
            [place("uas", 0, START, [100.0, 89.75, -1.0])],
            "uas[0].start_m: (100, 89.75, -1) is 0.25 m from obstacle 'hut', closer than radius_m "
            "0.4: the UAS would be lost at once; move it away",
        ),
        (
            [place("uas", 1, START, [100.0, 88.0, -1.0])],
            "uas[1].start_m: (100, 88, -1) is 2 m from obstacle 'hut', closer than radius_m + "
            "safe_distance_m = 3.4, where no planner can start; move it away",
        ),
        (
            [place("uas", 0, START, [150.0, 97.75, -1.0])],
            "uas[0].start_m: (150, 97.75, -1) is 0.25 m from moving obstacle 'van' at t = 0, "
            "closer than radius_m 0.4: the UAS would be lost at once; move it away",
        ),
        (
            [place("uas", 0, START, [150.0, 100.0, -8.0])],
            "uas[0].start_m: (150, 100, -8) is 4 m from moving obstacle 'van' at t = 0, closer "
            "than radius_m + safe_distance_m = 5.4, where no planner can start; move it away",
        ),
        (
            [place("uas", 1, START, [53.0, 14.0, -2.0])],
            "uas[1].start_m: (53, 14, -2) is 5 m from the start of 'uas_1' (uas[0]), closer than "
            "both radii + uas_safe_distance_m = 5.8; move them apart",
        ),
        (
            [place("uas", 1, "soc_0", 0.25)],
            "uas[1].soc_0: 0.25 is a depth of discharge of 0.75, not below dod_max 0.75; charge it",
        ),
        (
            [place("obstacles", 0, VERTICES, FLAT)],
            "obstacles[0].vertices_m: the 8 points lie in one plane (thickness 0 m); give at "
            "least one point outside it",
        ),
        (
            [(("geofence", VERTICES), FLAT)],
            "geofence.vertices_m: the 8 points lie in one plane (thickness 0 m); give at least "
            "one point outside it",
        ),
        (
            [(("geofence", VERTICES), box((0, 200), (0, 200), (-0.9, 0)))],
            "geofence.margin_m: 0.5 leaves no room in a fence that is 0.9 m thin; make the margin "
            "smaller or the fence larger (+4 more)",
        ),
        (
            [place("obstacles", 1, "name", "hut")],
            "obstacles[1].name: 'hut' is used twice; give each its own",
        ),
        (
            [
                place("waypoints", 0, WP, [100.0, 100.0, -5.0]),
                place("waypoints", 1, WP, [0.0, 0.0, -60.0]),
                place("uas", 1, "name", "uas_1"),
            ],
            "uas[1].name: 'uas_1' is used twice; give each its own (+2 more)",
        ),
    ],
)
def test_what_no_uas_can_fly_is_one_line_with_place_value_and_fix(changes, expected):
    with pytest.raises(InputError) as caught:
        with_changes(*changes)
    assert str(caught.value) == f"mission.toml: {expected}"


@pytest.mark.parametrize(
    "changes",
    [
        [place("waypoints", 0, WP, [100.0, 100.0, -10.0])],
        [place("waypoints", 0, WP, [200.0, 100.0, -30.0])],
        [place("uas", 0, START, [50.0, 10.0, -0.5])],
        [place("uas", 0, START, [100.0, 86.5, -1.0])],
        [place("uas", 0, START, [150.0, 92.5, -1.0])],
        [place("uas", 0, START, [150.0, 100.0, -9.5])],
        [place("uas", 1, START, [50.0, 15.85, -1.0])],
        [place("uas", 1, START, [50.0, 10.0, -6.85])],
        [place("uas", 1, "soc_0", 0.26)],
    ],
)
def test_what_keeps_every_distance_exactly_is_sound(changes):
    assert with_changes(*changes).name == "checked"


def test_a_waypoint_whose_sphere_no_uas_may_enter_is_worth_a_warning():
    # in the gap between a tower and the ceiling
    scenario = with_changes(
        place("waypoints", 1, WP, [30.0, 90.0, -49.5]), place("waypoints", 1, "radius_m", 5.0)
    )
    assert warnings(scenario) == [
        "waypoints[1].position_m: no part of the sphere around (30, 90, -49.5) keeps all safe "
        "distances, so no planner will cover it; move it or enlarge radius_m"
    ]
    assert warnings(with_changes(place("waypoints", 1, WP, [30.0, 90.0, -49.5]))) == []


def test_a_mission_that_its_batteries_cannot_finish_is_valid_but_worth_a_warning():
    scenario = with_changes(place("uas", 0, "soc_0", 0.27), place("uas", 1, "soc_0", 0.27))
    (line,) = warnings(scenario)
    assert line.startswith("uas: the batteries will hardly finish this mission")
    assert "uas_1 2" in line
    assert line.endswith("add UAS, charge them or take waypoints away")


def test_a_mission_with_too_few_steps_is_worth_a_warning():
    (line,) = warnings(with_changes((("max_steps",), 20)))
    assert line.startswith("max_steps: 20 steps of 1 s end before a plan that flies back and forth")


def test_a_paper_battery_lasts_as_long_as_the_published_flight_says():
    """Fig. 3: UAS 1 flies 247 s for 14.18 Wh, UAS 2 147 s for 8.36 Wh: about 206 W."""
    fresh, used = back_and_forth(load_scenario("village")).air_time_s
    assert fresh == pytest.approx(0.75 * 5.0 * 15.1 * 3600 / 206, rel=0.06)
    assert used == pytest.approx(0.183 * 5.0 * 14.9 * 3600 / 206, rel=0.1)


def test_a_rough_plan_is_shared_between_the_uas_and_takes_longer_over_obstacles():
    village = load_scenario("village")
    plan = back_and_forth(village)
    assert plan.complete
    assert (plan.flight_s <= plan.air_time_s).all()
    assert (plan.flight_s > 0).all()
    alone = back_and_forth(village.model_copy(update={"uas": village.uas[:1]}))
    assert alone.complete
    assert alone.makespan_s > plan.makespan_s
    empty = back_and_forth(village.model_copy(update={"obstacles": ()}))
    assert empty.makespan_s < plan.makespan_s
    # lengths anybody can check: the anchors of the design need 226 to 400 vehicle-seconds
    assert 250 < plan.flight_s.sum() < 700

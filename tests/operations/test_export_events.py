"""Files of flights whose scene changed: a home that was closed, waypoints asked for again."""

import json
import math

import pytest

pytest.importorskip("pyproj")

from qgc_loader import problems
from small_worlds import meadow, waypoint

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.operations import ExportOptions, LocalFrame, make_export
from uas_coverage_env.scenario import Place, Scenario

HERE = Place(latitude_deg=47.0, longitude_deg=8.0, height_m=400.0)
START_M, OTHER_M = (40.0, 40.0, -1.0), (40.0, 150.0, -1.0)
TAKE_OFF, LAND = 22, 21


def flown(each=None, **changes):
    places = ((150.0, 60.0, -20.0), (150.0, 130.0, -20.0))
    waypoints = [waypoint(place_m, 8.0) | (each or {}) for place_m in places]
    scenario = meadow((START_M,), waypoints=waypoints, max_steps=600)
    data = scenario.model_dump(mode="json", by_alias=True) | changes
    mission = parse(data, Scenario, "mission").model_copy(update={"place": HERE})
    return rollout(mission, load_planner("nearest-waypoint"))


@pytest.fixture(scope="module")
def closed():
    event = {"kind": "home_closed", "at_s": 8.0, "uas": "uas_1", "alternative_m": OTHER_M}
    return flown(events=[event])


def place_of(item):
    return LocalFrame(HERE).to_ned(item["params"][4], item["params"][5], 0.0)[:2]


@pytest.mark.parametrize("firmware", [None, "px4"])
def test_a_plan_takes_off_at_the_start_and_lands_where_its_closed_home_sends_it(closed, firmware):
    made = make_export(closed, ExportOptions("qgc", firmware=firmware))
    assert problems(made.files["uas_1.plan"]) == []
    plan = json.loads(made.files["uas_1.plan"])
    (take_off,), (land,) = (
        [item for item in plan["mission"]["items"] if item["command"] == command]
        for command in (TAKE_OFF, LAND)
    )
    assert math.dist(place_of(take_off), START_M[:2]) < 0.01
    assert math.dist(place_of(land), OTHER_M[:2]) < 0.01
    frame = LocalFrame(HERE)
    home, rally = plan["mission"]["plannedHomePosition"], plan["rallyPoints"]["points"][0]
    assert math.dist(frame.to_ned(home[0], home[1], 0.0)[:2], START_M[:2]) < 0.01
    assert math.dist(frame.to_ned(rally[0], rally[1], 0.0)[:2], OTHER_M[:2]) < 0.01
    if firmware is None:
        assert "RALLY_INCL_HOME,0\n" in made.files["uas_1.param"]
    assert any("uas_1 lands 110 m from where it takes off" in note for note in made.notes)


def test_a_flight_that_ends_beside_its_home_is_refused(closed):
    x = closed.x.copy()
    x[-1, 0, 0] += 30.0
    beside = type(closed)(**{**vars(closed), "x": x})
    with pytest.raises(InputError, match=r"uas_1 lands 3\d m from its home; export a flight that"):
        make_export(beside, ExportOptions("qgc"))


def test_every_visit_of_a_waypoint_that_is_asked_for_again_is_in_the_files():
    flight = flown(relaunch=True, each={"again_after_s": (60.0,)})
    assert flight.covered[-1] == 4
    made = make_export(flight, ExportOptions("ardupilot"))
    assert sum(file["waypoints_passed"] for file in made.data["uas"]) == 4
    assert not any(note.endswith("may be missed") for note in made.notes)


def test_a_uas_that_lands_elsewhere_is_told_to_land_there_and_to_return_there():
    places = ((150.0, 60.0, -20.0), (150.0, 130.0, -20.0))
    data = meadow((START_M,), waypoints=[waypoint(place_m, 8.0) for place_m in places])
    data = data.model_dump(mode="json", by_alias=True)
    data["uas"][0]["land_m"] = OTHER_M
    mission = parse(data, Scenario, "mission").model_copy(update={"place": HERE})
    made = make_export(rollout(mission, load_planner("nearest-waypoint")), ExportOptions("qgc"))
    assert problems(made.files["uas_1.plan"]) == []
    plan = json.loads(made.files["uas_1.plan"])
    (land,) = [item for item in plan["mission"]["items"] if item["command"] == LAND]
    assert math.dist(place_of(land), OTHER_M[:2]) < 0.01
    rally = plan["rallyPoints"]["points"][0]
    assert math.dist(LocalFrame(HERE).to_ned(rally[0], rally[1], 0.0)[:2], OTHER_M[:2]) < 0.01
    assert "RALLY_INCL_HOME,0\n" in made.files["uas_1.param"]

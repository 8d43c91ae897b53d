"""Files pass waypoints as near, slow and high as they ask: read back, and flown by the model."""

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pyproj")
from pymavlink import mavwp
from qgc_loader import problems

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.operations import ExportOptions, make_export
from uas_coverage_env.operations.geodesy import LocalFrame
from uas_coverage_env.operations.mission_export.lay_tracks import make_tracks
from uas_coverage_env.operations.mission_export.tracks import Tolerances
from uas_coverage_env.operations.mission_export.waypoint_requirements import not_as_asked
from uas_coverage_env.planning.execution.leg_model import DT_S, Autopilot, follow
from uas_coverage_env.scenario import Execution, Place, load_scenario

PLACE = Place(latitude_deg=60.5, longitude_deg=26.9)
WAYPOINT, TAKE_OFF, CHANGE_SPEED, TRIGGER_DISTANCE = 16, 22, 178, 206
CORNER_M = 2.0


@pytest.fixture(scope="module", params=[None, Execution(flown_by="autopilot")], ids=str)
def flight(request):
    changes = {"execution": request.param, "place": PLACE}
    scenario = load_scenario("mixed_fleet").model_copy(update=changes)
    return rollout(scenario, load_planner("lawnmower"))


def items_by_pymavlink(text, path):
    path.write_text(text)
    loader = mavwp.MAVWPLoader()
    with warnings.catch_warnings():  # it leaves the file open
        warnings.simplefilter("ignore", ResourceWarning)
        loader.load(str(path))
    for n in range(1, loader.count()):
        item = loader.wp(n)
        yield item.command, (item.param1, item.param2), (item.x, item.y, item.z)


def items_of_plan(text):
    for item in json.loads(text)["mission"]["items"]:
        yield item["command"], item["params"][:2], item["params"][4:]


def flown(items, vehicle):
    """How an autopilot flies the items of a file."""
    frame, corners, speeds, holds, now = LocalFrame(PLACE), [], [], [], None
    for command, params, place in items:
        if command == CHANGE_SPEED:
            assert params[0] == 1.0  # ground speed
            now = params[1]
        elif command in (TAKE_OFF, WAYPOINT):
            corners.append(frame.to_ned(*place))
            if command == WAYPOINT:
                speeds.append(now)
                holds.append(params[0])
    return follow(corners, speeds, holds, Autopilot.of(vehicle, CORNER_M))


def passes(waypoint, followed):
    """Whether it is somewhere in the sphere as slow, and at such a height, as is asked."""
    speed_mps = np.linalg.norm(np.diff(followed.places_m, axis=0), axis=1) / DT_S
    places = followed.places_m[1:]
    away_m = np.linalg.norm(places - np.array(waypoint.position_m), axis=1)
    fits = away_m <= waypoint.radius_m + 0.05
    if waypoint.max_speed_mps is not None:
        fits &= speed_mps <= waypoint.max_speed_mps
    if waypoint.heights_m is not None:
        fits &= (waypoint.heights_m[0] <= -places[:, 2]) & (-places[:, 2] <= waypoint.heights_m[1])
    return fits.any()


@pytest.mark.parametrize("kind", ["ardupilot", "qgc"])
def test_a_file_read_back_and_flown_passes_every_waypoint_as_it_asks(flight, kind, tmp_path):
    made = make_export(flight, ExportOptions(kind, min_slack_s=0.0))
    asking = 0
    for i, uas in enumerate(made.data["uas"]):
        if kind == "qgc":
            items = items_of_plan(made.files[f"{uas['name']}.plan"])
        else:
            text = made.files[f"{uas['name']}.waypoints"]
            items = items_by_pymavlink(text, tmp_path / uas["name"])
        followed = flown(items, flight.scenario.vehicles[i])
        start_s = uas["start_delay_s"]
        assert followed.duration_s + start_s == pytest.approx(uas["duration_s"], abs=1.0)
        track = make_tracks(flight, i, Tolerances())[0]
        for w in track.waypoints:
            assert passes(flight.scenario.waypoints[w], followed)
            asking += flight.scenario.waypoints[w].max_speed_mps is not None
        assert uas["waypoints_not_as_asked"] == 0
    assert asking == 3


def pictures(items, followed):
    """(P, 3) where pictures are taken on the legs of a file that ask for them."""
    frame, corners, each, now = LocalFrame(PLACE), [], [], 0.0
    for command, params, place in items:
        if command == TRIGGER_DISTANCE:
            now = params[0]
        elif command in (TAKE_OFF, WAYPOINT):
            corners.append(frame.to_ned(*place))
            if command == WAYPOINT:
                each.append(now)
    assert now == 0.0, "switched off before it lands"
    taken, since = [], 0.0
    leg_of = np.searchsorted(followed.corner_s[1:], followed.times_s).clip(max=len(each) - 1)
    for k in range(1, len(followed.places_m)):
        apart_m, before_m = each[leg_of[k]], each[leg_of[k - 1]]
        since += np.linalg.norm(followed.places_m[k] - followed.places_m[k - 1])
        if apart_m and (not before_m or since >= apart_m):
            taken.append(followed.places_m[k])
            since = 0.0
    return np.array(taken).reshape(-1, 3)


@pytest.mark.parametrize("kind", ["ardupilot", "qgc"])
def test_a_picture_is_taken_in_the_sphere_of_every_waypoint_that_asks_for_a_camera(
    flight, kind, tmp_path
):
    made, scenario = make_export(flight, ExportOptions(kind, min_slack_s=0.0)), flight.scenario
    asking = 0
    for i, uas in enumerate(made.data["uas"]):
        if kind == "qgc":
            text = made.files[f"{uas['name']}.plan"]
            assert problems(text) == []
            items = list(items_of_plan(text))
        else:
            text = made.files[f"{uas['name']}.waypoints"]
            items = list(items_by_pymavlink(text, tmp_path / uas["name"]))
        cameras = {one.name for one in scenario.uas[i].sensors if one.field_of_view_deg}
        wanted = [
            scenario.waypoints[w]
            for w in make_tracks(flight, i, Tolerances())[0].waypoints
            if scenario.waypoints[w].sensor in cameras
        ]
        taken = pictures(items, flown(items, scenario.vehicles[i]))
        assert bool(wanted) == bool(len(taken)) == (uas["picture_each_m"] is not None)
        for waypoint in wanted:
            away_m = np.linalg.norm(taken - np.array(waypoint.position_m), axis=1)
            assert away_m.min() <= waypoint.radius_m + 0.5  # the model's samples are apart, too
        asking += len(wanted)
    assert asking > 3


def test_files_of_a_mission_that_asks_for_no_camera_trigger_none():
    scenario = load_scenario("open_field").model_copy(update={"place": PLACE})
    made = make_export(
        rollout(scenario, load_planner("lawnmower")), ExportOptions("qgc", min_slack_s=0.0)
    )
    for uas in made.data["uas"]:
        commands = [item[0] for item in items_of_plan(made.files[f"{uas['name']}.plan"])]
        assert TRIGGER_DISTANCE not in commands
        assert uas["picture_each_m"] is None


def test_a_speed_that_is_not_asked_for_is_not_limited(flight):
    made = make_export(flight, ExportOptions("ardupilot", min_slack_s=0.0))
    for uas in made.data["uas"]:
        speeds = [leg["speed_mps"] for leg in uas["legs"]]
        assert max(speeds) > 3.0 * 2.0


def test_what_is_passed_too_fast_or_too_high_is_named(flight):
    scenario = flight.scenario
    (slow, *_) = (w for w, one in enumerate(scenario.waypoints) if one.max_speed_mps)
    tracks = [make_tracks(flight, i, Tolerances())[0] for i in range(2)]
    (track,) = (one for one in tracks if slow in one.waypoints)
    by = Autopilot.of(scenario.vehicles[track.uas], CORNER_M)
    stops = [1.0] * len(track.legs)
    calm, hasty = (follow(track.corners_m, [s] * len(stops), stops, by) for s in (2.0, 12.0))
    assert slow not in not_as_asked(scenario, track, calm)
    middle = np.array([[0.0, 0.0, 0.0], [60.0, 0.0, 0.0]]) + scenario.waypoints[slow].position_m
    middle[:, 0] -= 30.0
    past = follow([middle[0], middle[1]], [12.0], [0.0], by, takes_off=False)
    assert slow in not_as_asked(scenario, track, past)
    higher = replace(hasty, places_m=calm.places_m - (0.0, 0.0, 3.0), times_s=calm.times_s)
    gas = [w for w in track.waypoints if scenario.waypoints[w].heights_m == (5.0, 10.0)]
    assert set(gas) <= set(not_as_asked(scenario, track, higher))

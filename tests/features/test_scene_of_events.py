"""Pictures and pages of a flight show a scene as it was at the time, whatever events changed."""

import json

import numpy as np
import pytest
from eventful import STARTS_M, WAYPOINTS, corners_m, event, field

from uas_coverage_env import rollout
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight, covered_at
from uas_coverage_env.flight.picture import flight_pictures
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.replay.figures import map_figure
from uas_coverage_env.replay.flight_data import flight_data

SHED_M = corners_m((100.0, 20.0, -15.0), (115.0, 30.0, 0.0))
ZONE_M = corners_m((150.0, 150.0, -45.0), (175.0, 175.0, 0.0))
ALTERNATIVE_M = (20.0, 100.0, -1.0)


@pytest.fixture(scope="module")
def flight():
    events = (
        event("waypoint_added", 4.0, position_m=(60.0, 130.0, -20.0), radius_m=5.0),
        event("obstacle_added", 6.0, name="shed", safe_distance_m=1.0, vertices_m=SHED_M),
        event(
            "moving_obstacle_added",
            8.0,
            name="balloon",
            radius_m=3.0,
            height_m=5.0,
            safe_distance_m=2.0,
            position_m=(190.0, 100.0, -45.0),
            velocity_mps=(0.0, 1.0, 0.0),
        ),
        event("no_fly_zone", 9.0, name="fire", safe_distance_m=1.0, vertices_m=ZONE_M),
        event("home_closed", 10.0, uas="uas_1", alternative_m=ALTERNATIVE_M),
        event("waypoint_dropped", 11.0, waypoint=4),
    )
    return rollout(field(*events), "nearest-waypoint")


@pytest.fixture(scope="module")
def history(flight):
    return SceneHistory.of(flight)


def test_what_events_add_is_there_from_their_time_on(history):
    assert history.obstacle_from.tolist() == [6, 9]
    assert history.moving_from.tolist() == [8]
    assert history.waypoint_from.tolist() == [0] * len(WAYPOINTS) + [4]
    assert [sample for sample, _ in history.changes] == [0, 4, 6, 8, 9, 10]


def test_a_waypoint_is_dropped_by_name_or_because_a_zone_closes_it(flight, history):
    never = len(flight.x)
    dropped = np.flatnonzero(history.waypoint_until < never)
    assert dropped.tolist() == [4, 8]
    assert history.waypoint_until[dropped].tolist() == [11, 9]
    assert (history.covered_at[dropped] >= history.waypoint_until[dropped]).all()


def test_the_waypoints_of_the_beginning_are_covered_when_the_flight_says(flight, history):
    n = len(WAYPOINTS)
    np.testing.assert_array_equal(history.covered_at[:n], covered_at(flight))
    assert 4 <= history.covered_at[n] < len(flight.x)


def test_what_is_left_open_is_what_the_world_counted(flight, history):
    assert int(history.open_at_end.sum()) == flight.open_waypoints == 0


def test_an_added_moving_obstacle_flies_from_its_time_on(flight, history):
    (path_m,) = history.moving_position_m.swapaxes(0, 1)
    assert (path_m[:9] == (190.0, 100.0, -45.0)).all()
    np.testing.assert_allclose(path_m[20], (190.0, 112.0, -45.0))
    assert history.moving_m(7).shape == (8, 0, 3)
    assert history.moving_m(8).shape == (9, 1, 3)


def test_home_is_where_it_was_at_the_time(history):
    assert history.home_m[9, 0].tolist() == list(STARTS_M[0])
    assert history.home_m[10, 0].tolist() == list(ALTERNATIVE_M)
    assert (history.home_m[:, 1] == STARTS_M[1]).all()


def test_a_scene_is_the_same_object_until_it_changes(history):
    assert history.scene_at(0)[0] is history.scene_at(3)[0]
    assert history.scene_at(11)[0] is history.scene_at(20)[0]
    scenario, there = history.scene_at(20)
    assert there.tolist() == [0, 1, 2, 3, 5, 6, 7, 9]
    assert len(scenario.waypoints) == 8
    assert scenario.can_cover.shape == (2, 8)


def test_pictures_show_what_is_there(flight):
    before, same, after = flight_pictures(flight, [0, 0, flight.steps], size_px=300)
    np.testing.assert_array_equal(before, same)
    changed = (before != after).any(axis=2)
    # the shed and the zone are in the picture of the end, and so is the balloon's path
    assert changed.mean() > 0.03


def test_the_map_counts_and_names_what_is_there_at_the_sample(flight):
    def words(step):
        figure = map_figure(flight, step=step)
        (axes,) = figure.axes
        return axes.get_title(), {text.get_text() for text in figure.legends[0].get_texts()}

    title, legend = words(0)
    assert "of 9 waypoints" in title
    assert not {"obstacle", "no-fly zone", "moving obstacle"} & legend
    title, legend = words(flight.steps)
    assert "8 of 8 waypoints" in title
    assert {"obstacle", "moving obstacle"} <= legend


def test_the_page_has_when_each_thing_is_there(flight):
    data = flight_data(flight, "here")
    scene = data["scene"]
    assert [(body["name"], body["from"]) for body in scene["obstacles"]] == [
        ("shed", 6),
        ("fire", 9),
    ]
    assert [waypoint["until"] for waypoint in scene["waypoints"]][4:] == [11, *[None] * 3, 9, None]
    assert [moving["from"] for moving in scene["moving"]] == [8]
    assert [home["from"] for home in scene["uas"][0]["homes"]] == [0, 10]
    assert [home["from"] for home in scene["uas"][1]["homes"]] == [0]
    assert [reach["from"] for reach in data["reach"]] == [0, 6, 9, 10]
    assert len(data["covered_at"]) == len(scene["waypoints"]) == 10
    assert len(data["moving"]["values"]) == 3 * len(flight.x)


def test_room_to_an_obstacle_counts_from_when_it_stands(flight):
    data = flight_data(flight, "here")
    room = np.array(data["room"]["obstacles"]["values"]).reshape(flight.mode.shape)
    far = round(50.0 / data["room"]["obstacles"]["unit"])
    assert (room[:6] == far).all()
    assert (room[6:] < far).any()


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"event": 17}, "events[0]: event is 17; the scenario has 6, from 0 on"),
        ({"kind": "uas_lost"}, "events[0]: kind is 'uas_lost'; event 0 is 'waypoint_added'"),
        ({"time_s": 1e300}, "events[0]: time_s is 1e+300; the flight ends at"),
    ],
)
def test_an_event_that_cannot_have_been_is_refused_by_name(flight, changed, words, tmp_path):
    flight.save(tmp_path / "it")
    assert Flight.load(tmp_path / "it").events == flight.events
    file = tmp_path / "it" / "run.json"
    data = json.loads(file.read_text())
    data["events"][0] |= changed
    file.write_text(json.dumps(data))
    with pytest.raises(InputError) as refusal:
        Flight.load(tmp_path / "it")
    assert words in str(refusal.value)

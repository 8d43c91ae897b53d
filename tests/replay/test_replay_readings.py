"""What the replay page reads out of a flight: the way home, room, roofs, and marks."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from small_worlds import box, meadow

from uas_coverage_env.flight import load_planner, rollout
from uas_coverage_env.flight.figure import NOTHING
from uas_coverage_env.flight.figures import printed
from uas_coverage_env.flight.record import DecisionRecord, EventRecord
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.mission import MissionBrief, Range
from uas_coverage_env.replay.flight_data import flight_data
from uas_coverage_env.replay.home_data import way_home
from uas_coverage_env.replay.safety_data import FAR_M, floors_m, rooms
from uas_coverage_env.vehicle.layout import DOD


def marks(flight, kind):
    """The page's marks of a kind."""
    return [mark for mark in flight_data(flight, "here")["marks"] if mark["kind"] == kind]


def test_the_page_says_what_range_says(plain):
    data = flight_data(plain, "here")
    samples, uas = plain.mode.shape
    soc, needed = (
        np.array(data[name]["values"]).reshape(samples, uas) * data[name]["unit"]
        for name in ("soc", "needed")
    )
    range_ = Range(MissionBrief.of(plain.scenario))
    for k in (0, 17, samples - 1):
        for i in range(uas):
            spare = range_.spare_dod(i, plain.x[k, i])
            assert soc[k, i] - needed[k, i] == pytest.approx(spare, abs=1.1e-4)


def test_the_page_has_the_figures_that_show_prints(plain):
    data = flight_data(plain, "here")
    told = {name: text for name, text in printed(plain).items() if text != NOTHING}
    assert dict(data["figures"]) == told
    assert told["steps"] == str(data["summary"]["steps"])


def test_the_point_of_no_return_is_where_nothing_is_left_beyond_the_way_home(discharged):
    range_ = Range(MissionBrief.of(discharged.scenario))
    spare = [range_.spare_dod(1, x) for x in discharged.x[:, 1]]
    first = next(k for k, left in enumerate(spare) if left <= 0.0)
    assert 5 < first < discharged.steps, "of a flight that shows something"
    home = way_home(discharged, SceneHistory.of(discharged))
    assert home.no_return == (None, first)
    sample, least = home.least_spare[1]
    assert least == pytest.approx(min(spare[:-1]))
    assert spare[sample] == least
    (mark,) = marks(discharged, "no return")
    assert (mark["t_s"], mark["uas"]) == (first * discharged.scenario.dt_s, "uas_2")
    assert "point of no return" in mark["text"]


def test_a_flight_that_keeps_its_reserve_has_no_point_of_no_return(plain):
    assert way_home(plain, SceneHistory.of(plain)).no_return == (None, None)
    assert marks(plain, "no return") == []


def test_room_and_the_recorded_clearance_are_of_the_same_obstacles(plain):
    scenario = plain.scenario
    found = rooms(plain, SceneHistory.of(plain))
    nearest = min(
        found[kind][0][:, i].min() + scenario.uas[i].radius_m + obstacle.safe_distance_m
        for kind, obstacle in (
            ("obstacles", scenario.obstacles[0]),
            ("moving", scenario.moving_obstacles[0]),
        )
        for i in range(2)
    )
    # recorded between samples, too
    assert plain.min_obstacle_clearance_m <= nearest < plain.min_obstacle_clearance_m + 3.0


def moved(flight, place_m, samples, uas=1):
    """The flight with a UAS elsewhere at some samples."""
    x = flight.x.copy()
    x[samples, uas, :3] = place_m
    return dataclasses.replace(flight, x=x)


def test_a_breach_is_a_mark_with_what_was_too_near(plain):
    tower = next(o for o in plain.scenario.obstacles if o.name == "high_rise_1")
    corners = np.array(tower.vertices_m)
    beside = corners.mean(axis=0)
    short_m = 0.4
    radius_m = plain.scenario.uas[1].radius_m
    beside[0] = corners[:, 0].min() - radius_m - tower.safe_distance_m + short_m
    near = moved(plain, beside, slice(20, 24))
    room_m, _ = rooms(near, SceneHistory.of(near))["obstacles"]
    assert room_m[20:24, 1] == pytest.approx(-short_m)
    (mark,) = marks(near, "breach")
    assert (mark["t_s"], mark["until_s"]) == (20.0, 23.0)
    assert mark["text"] == "uas_2: 0.40 m within the safe distance of high_rise_1"
    assert marks(plain, "breach") == []


def test_two_uas_that_meet_and_one_at_the_fence_are_marked(plain):
    x = plain.x.copy()
    x[30, 1, :3] = x[30, 0, :3] + (0.0, 0.0, 0.5)
    texts = [mark["text"] for mark in marks(dataclasses.replace(plain, x=x), "breach")]
    assert any("uas_1" in text and text.endswith("uas_2") for text in texts)
    fence_m = np.array(plain.scenario.geofence.vertices_m)
    edge = np.array([fence_m[:, 0].min() + 0.1, 250.0, -20.0])
    (mark,) = marks(moved(plain, edge, [30]), "breach")
    assert mark["text"].endswith("of the fence")


def test_what_is_far_or_ended_is_shown_as_far(plain):
    for room_m, which in rooms(plain, SceneHistory.of(plain)).values():
        assert room_m.max() <= FAR_M
        assert (room_m[which < 0] == FAR_M).all()


@pytest.fixture(scope="module")
def over_a_house():
    """A meadow with a house, 8 m high, and a least height of 3 m; two UAS wait."""
    scenario = meadow(
        [(150.0, 150.0, -1.0), (160.0, 20.0, -1.0)],
        obstacles=[box("house", (60.0, 60.0, -8.0), (80.0, 80.0, 0.0))],
        min_height_m=3.0,
    )
    return rollout(scenario, load_planner("hover"), max_steps=4)


def test_a_roof_is_told_from_the_ground(over_a_house):
    over, beside = (70.0, 70.0, -12.0), (90.0, 70.0, -12.0)
    flight = moved(moved(over_a_house, over, [2], uas=0), beside, [2], uas=1)
    assert floors_m(flight, SceneHistory.of(flight))[2].tolist() == [8.0, 0.0]


def test_too_low_over_a_roof_is_a_breach_of_the_least_height(over_a_house):
    low = moved(over_a_house, (70.0, 70.0, -10.0), [2, 3], uas=0)
    texts = [mark["text"] for mark in marks(low, "breach") if "uas_1" in mark["text"]]
    assert "uas_1: 1.00 m below the least height" in texts
    # near its start a UAS may fly low
    start_m = np.array(low.scenario.uas[0].start_m) * (1.0, 1.0, 0.5)
    low = moved(over_a_house, start_m, [2, 3], uas=0)
    assert not any("least height" in mark["text"] for mark in marks(low, "breach"))


def test_fallbacks_and_gaps_in_a_row_are_one_mark_with_their_reason(plain):
    decisions = list(plain.decisions)
    for k in (10, 11, 12):
        decisions[k] = DecisionRecord(0.1, fallback=True, reason="no time left")
    decisions[13] = DecisionRecord(0.1, fallback=True, reason="no plan holds")
    for k, gap in ((20, 0.08), (21, 0.3), (22, 0.01)):
        decisions[k] = DecisionRecord(0.1, mip_gap=gap)
    flight = dataclasses.replace(plain, decisions=tuple(decisions))
    assert [(m["t_s"], m["until_s"], m["text"]) for m in marks(flight, "fallback")] == [
        (10.0, 12.0, "fallback (3 decisions): no time left"),
        (13.0, 13.0, "fallback: no plan holds"),
    ]
    (gap,) = marks(flight, "gap")
    assert (gap["t_s"], gap["until_s"]) == (20.0, 21.0)
    assert gap["text"] == "2 decisions solved to a gap of 30% at most"


def test_events_are_marks_in_order_of_time(plain):
    tables: Any = (
        {"kind": "uas_lost", "at_s": 7.0, "uas": "uas_2"},
        {"kind": "obstacle_added", "at_s": 9.0, **box("shed", (0, 0, -5), (9, 9, 0))},
    )
    events = (EventRecord(7.0, "uas_lost", "uas_2", 0), EventRecord(9.0, "obstacle_added", None, 1))
    scenario = plain.scenario.model_copy(update={"events": tables})
    found = marks(dataclasses.replace(plain, scenario=scenario, events=events), "event")
    assert [(m["t_s"], m["text"]) for m in found] == [
        (7.0, "uas_2: uas lost"),
        (9.0, "obstacle added"),
    ]


def test_the_state_of_a_known_flight_is_not_changed(discharged, plain):
    before = plain.x.copy()
    flight_data(plain, "here")
    np.testing.assert_array_equal(plain.x, before)
    assert (discharged.x[..., DOD] >= plain.x[..., DOD]).all()

"""The tables `[[events]]` and `[sensing]` of scenario files, and what planners know of them."""

from typing import Any

import pytest
from small_worlds import box, meadow, mover

from uas_coverage_env import MissionBrief, load_scenario
from uas_coverage_env.files.strict_toml import InputError, parse
from uas_coverage_env.scenario import Scenario, Sensing
from uas_coverage_env.scenario.events import EVENT_KINDS

PLAIN = meadow(moving_obstacles=(mover((150.0, 150.0, -20.0), (0.0, (1.0, 0.0, 0.0))),))
WALL_M = [
    list(corner) for corner in box("wall", (40.0, 40.0, -30.0), (50.0, 60.0, 0.0))["vertices_m"]
]
BODY = {"name": "new", "safe_distance_m": 2.0, "vertices_m": WALL_M}
ONE_OF_EACH = (
    {"kind": "uas_lost", "at_s": 5.0, "uas": "uas_1"},
    {"kind": "radio_lost", "rate_per_h": 2.0, "for_s": 9.0, "then": "go_on"},
    {"kind": "planner_lost", "at_s": 7.0},
    {"kind": "gnss_lost", "at_s": 7.0, "for_s": 4.0},
    {"kind": "late_start", "at_s": 7.0},
    {"kind": "motor_degraded", "at_s": 7.0, "power_factor": 1.2},
    {"kind": "charge_lost", "at_s": 7.0, "share": 0.2},
    {"kind": "waypoint_dropped", "at_s": 7.0, "waypoint": 0},
    {"kind": "waypoint_added", "at_s": 7.0, "position_m": [9.0, 9.0, -9.0], "radius_m": 4.0},
    {"kind": "obstacle_added", "at_s": 7.0, **BODY},
    {"kind": "no_fly_zone", "at_s": 7.0, **BODY, "name": "zone"},
    {
        **{"kind": "moving_obstacle_added", "at_s": 7.0, "name": "other", "radius_m": 2.0},
        **{"height_m": 2.0, "safe_distance_m": 1.0, "position_m": [9.0, 9.0, -9.0]},
        "velocity_mps": [1.0, 0.0, 0.0],
    },
    {
        **{"kind": "moving_obstacle_turns", "at_s": 7.0, "moving_obstacle": "mover"},
        "velocity_mps": [0.0, 1.0, 0.0],
    },
    {"kind": "home_closed", "at_s": 7.0, "alternative_m": [120.0, 100.0, -1.0]},
)  # fmt: skip


def read(*events: dict[str, Any]) -> Scenario:
    data = {**PLAIN.model_dump(mode="json", by_alias=True), "events": list(events)}
    return parse(data, Scenario, "file.toml")


def test_every_kind_is_read_and_written_as_it_was(tmp_path):
    scenario = read(*ONE_OF_EACH)
    assert {type(event) for event in scenario.events} == set(EVENT_KINDS)
    scenario.to_file(tmp_path / "eventful.toml")
    assert load_scenario(tmp_path / "eventful.toml") == scenario


def test_every_kind_does_something():
    scenario = read(*ONE_OF_EACH)
    for event in scenario.events:
        changed = scenario.after(event, 7.0) != scenario
        assert changed == event.changes_scene
        assert (event.feature is not None) != event.changes_scene


def test_without_tables_a_file_is_as_before_there_were_any():
    assert not {"events", "sensing"} & set(PLAIN.content())


def test_no_planner_is_told_of_what_will_happen():
    scenario = read(*ONE_OF_EACH).model_copy(update={"sensing": Sensing(delay_steps=2)})
    assert MissionBrief.of(scenario) == MissionBrief.of(PLAIN)
    assert MissionBrief.of(scenario).as_scenario().events == ()


@pytest.mark.parametrize(
    ("event", "message"),
    [
        ({"kind": "uas_lost"}, "events[0]: happens at_s or at a rate_per_h; give one of the two"),
        ({"kind": "uas_lost", "at_s": 1, "rate_per_h": 1}, "events[0]: happens at_s or at a rate"),
        ({"kind": "fire", "at_s": 1}, "events[0].kind: there is no 'fire'; take one of "),
        ({"at_s": 1}, "events[0].kind: is missing; take one of "),
        (
            {"kind": "uas_lost", "at_s": 1, "usa": "x"},
            "events[0].usa: unknown key; did you mean uas",
        ),
        ({"kind": "uas_lost", "at_s": 1, "uas": "x"}, "events[0].uas: there is no UAS 'x'; there"),
        ({"kind": "uas_lost", "at_s": -1}, "events[0].at_s: should be greater than 0"),
        (
            {"kind": "late_start", "rate_per_h": 1},
            "a late_start happens at no rate_per_h; give at_s",
        ),
        ({"kind": "radio_lost", "at_s": 1}, "events[0].for_s: is missing; add it"),
        ({"kind": "waypoint_dropped", "at_s": 1, "waypoint": 4}, "4 is none of the 1 waypoints"),
        (
            {**ONE_OF_EACH[8], "position_m": [900.0, 0.0, -9.0]},
            "events[0] (waypoint_added): then waypoints[1].position_m: (900, 0, -9) lies 700 m",
        ),
        (
            {**ONE_OF_EACH[12], "moving_obstacle": "balloon"},
            "events[0].moving_obstacle: there is no 'balloon'; there are: mover",
        ),
        (
            {**ONE_OF_EACH[13], "alternative_m": [900.0, 0.0, -1.0]},
            "events[0] (home_closed): then uas[0].land_m: (900, 0, -1) lies 700 m outside",
        ),
    ],
)
def test_a_mistake_in_an_event_is_one_line(event, message):
    with pytest.raises(InputError) as caught:
        read(event)
    assert message in str(caught.value)
    assert str(caught.value).startswith("file.toml: ")
    assert "\n" not in str(caught.value)

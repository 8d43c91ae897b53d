"""Doors in missions that are not planar: routes lead below a lintel, or round its wall."""

import numpy as np
import pytest

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.scenario import Scenario, load_scenario
from uas_coverage_env.world.arena import build_arena

ROOM = """
schema = 1
name = "two_rooms"
min_height_m = %(least_m)s
dt_s = 0.2
max_steps = 400
landing_distance_m = 0.3
landing_speed_mps = 0.2
uas_safe_distance_m = 0.3

[geofence]
margin_m = 0.1
vertices_m = [
  [0.0, 0.0, 0.0], [6.0, 0.0, 0.0], [6.0, 8.0, 0.0], [0.0, 8.0, 0.0],
  [0.0, 0.0, -2.5], [6.0, 0.0, -2.5], [6.0, 8.0, -2.5], [0.0, 8.0, -2.5],
]

[[walls]]
from_m = [0.0, 4.0]
to_m = [6.0, 4.0]
thickness_m = 0.15
height_m = 2.5
safe_distance_m = 0.1
doors = [{ at_m = 3.0, width_m = 0.9, height_m = %(door_m)s }]

[[uas]]
name = "uas_1"
vehicle = "crazyflie"
start_m = [1.0, 1.0, -1.2]
soc_0 = 1.0
radius_m = 0.07
dod_max = 0.75

[[waypoints]]
position_m = [5.0, 7.0, %(waypoint_m)s]
radius_m = 0.3
weight = 1.0
"""


def two_rooms(
    tmp_path, *, door_m: float = 2.0, waypoint_m: float = -1.2, least_m: float = 0.0
) -> Scenario:
    path = tmp_path / "two_rooms.toml"
    path.write_text(
        ROOM % {"door_m": door_m, "waypoint_m": waypoint_m, "least_m": least_m}, encoding="utf-8"
    )
    return load_scenario(path)


def test_routes_lead_below_the_lintel_and_through_nothing_else(tmp_path):
    scenario = two_rooms(tmp_path)
    obstacles = build_arena(scenario).obstacles
    named = {one.name: record for one, record in zip(scenario.obstacles, obstacles, strict=True)}
    assert named["wall_1_above_door_1"]["lintel"]
    assert not named["wall_1_above_door_1"]["tall"]
    assert all(record["tall"] for name, record in named.items() if "above" not in name)


@pytest.mark.parametrize("least_m", [0.0, 0.5])
def test_a_door_below_a_lintel_is_flown_through(tmp_path, least_m):
    flight = rollout(
        two_rooms(tmp_path, least_m=least_m), load_planner("nearest-waypoint"), safety_filter=True
    )
    assert flight.figures["coverage"] == 1.0
    assert flight.figures["all_home"]
    assert not flight.figures["violations"]
    assert flight.figures["breaches"] == 0


@pytest.mark.parametrize("given", [{"door_m": 1.3}, {"waypoint_m": -2.0}])
def test_a_lintel_that_is_too_low_for_what_is_flown_closes_its_door(tmp_path, given):
    scenario = two_rooms(tmp_path, **given)
    assert not build_arena(scenario).obstacles["lintel"].any()
    assert build_arena(scenario).obstacles["tall"].all()


def test_contacts_and_the_filter_know_the_lintel_as_it_stands(tmp_path):
    scenario = two_rooms(tmp_path)
    arena = build_arena(scenario)
    (o,) = np.flatnonzero(arena.obstacles["lintel"])
    record = arena.obstacles[o]
    faces = slice(record["first_kept"], record["last_kept"])
    inside = np.array([3.0, 4.0, -2.2])
    assert (arena.normals[faces] @ inside + arena.offsets_m[faces]).max() < 0.0
    assert record["first_kept"] == record["first_face"]

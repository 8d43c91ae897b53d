"""Leg times: free, round and over obstacles, for every kind of vehicle."""

import math

import numpy as np
import pytest

from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.scenario import Scenario


def box(low, high):
    north, east, down = zip(low, high, strict=True)
    return [(n, e, d) for n in north for e in east for d in down]


def scenario(waypoints, vehicles=("s500_v2",), obstacles=(), radius_m=10.0):
    """A field of 400 m with a ceiling at 60 m."""
    data = {
        "schema": 1,
        "name": "legs",
        "dt_s": 1.0,
        "max_steps": 300,
        "landing_distance_m": 2.0,
        "landing_speed_mps": 0.5,
        "uas_safe_distance_m": 5.0,
        "geofence": {"margin_m": 0.5, "vertices_m": box((0.0, 0.0, -60.0), (400.0, 400.0, 0.0))},
        "waypoints": [
            {"position_m": position, "radius_m": radius_m, "weight": 1.0} for position in waypoints
        ],
        "uas": [
            {
                "name": f"uas_{row}",
                "vehicle": vehicle,
                "start_m": (10.0, 10.0 + 20.0 * row, -1.0),
                "soc_0": 1.0,
                "radius_m": 0.36,
                "dod_max": 0.75,
            }
            for row, vehicle in enumerate(vehicles)
        ],
        "obstacles": [
            {"name": f"shed_{row}", "safe_distance_m": 2.0, "vertices_m": box(low, high)}
            for row, (low, high) in enumerate(obstacles)
        ],
    }
    return parse(data, Scenario, "legs")


def octagon_m(a, b):
    """The horizontal distance in the norm of the speed limit's octagon."""
    north, east = b[0] - a[0], b[1] - a[1]
    turns = [k * math.pi / 4 for k in range(8)]
    return max(north * math.cos(t) + east * math.sin(t) for t in turns)


FIELD = [(50.0, 60.0, -20.0), (300.0, 90.0, -20.0), (180.0, 350.0, -20.0)]
WEST, EAST = (200.0, 100.0, -20.0), (200.0, 300.0, -20.0)
TALL = ((150.0, 190.0, -60.0), (250.0, 210.0, 0.0))
LOW = ((50.0, 190.0, -30.0), (350.0, 210.0, 0.0))


def test_free_legs_take_the_distance_over_the_speed():
    made = scenario(FIELD)
    legs, speed = Legs(MissionBrief.of(made)), made.vehicles[0].limits.v_xy_max_mps
    exact = [[octagon_m(a, b) / speed for b in FIELD] for a in FIELD]
    assert legs.between_s[0] == pytest.approx(np.array(exact))
    here = np.array([100.0, 100.0, -20.0])
    assert legs.from_here_s(0, here) == pytest.approx([octagon_m(here, b) / speed for b in FIELD])


def test_level_legs_are_symmetric():
    between = Legs(MissionBrief.of(scenario([*FIELD, WEST, EAST], obstacles=[TALL]))).between_s[0]
    assert between == pytest.approx(between.T, rel=0.05)
    assert (np.diag(between) == 0.0).all()


@pytest.mark.parametrize("obstacle", [TALL, LOW], ids=["round", "over"])
def test_a_leg_past_an_obstacle_takes_longer(obstacle):
    free = Legs(MissionBrief.of(scenario([WEST, EAST]))).between_s[0]
    past = Legs(MissionBrief.of(scenario([WEST, EAST], obstacles=[obstacle]))).between_s[0]
    if obstacle is TALL:
        assert past[0, 1] > free[0, 1] + 1.0
    else:
        near = [(200.0, 180.0, -5.0), (200.0, 220.0, -5.0)]
        low = Legs(MissionBrief.of(scenario(near, obstacles=[LOW]))).between_s[0]
        assert low[0, 1] > Legs(MissionBrief.of(scenario(near))).between_s[0][0, 1] + 1.0


def test_a_leg_that_climbs_takes_as_long_as_the_climb():
    made = scenario([(100.0, 100.0, -5.0), (101.0, 100.0, -55.0)], radius_m=4.0)
    limits, between = made.vehicles[0].limits, Legs(MissionBrief.of(made)).between_s[0]
    # half the radius is near enough
    assert between[0, 1] == pytest.approx(48.0 / limits.v_up_max_mps)
    assert between[1, 0] == pytest.approx(48.0 / limits.v_down_max_mps)


def test_the_way_home_ends_at_ones_own_start():
    legs = Legs(MissionBrief.of(scenario(FIELD, ("s500_v2", "s500_v2"))))
    for uas in range(2):
        assert legs.way_home_s(uas, legs.homes_m[uas]) == 0.0
        alone = [legs.way_home_s(uas, np.array(place)) for place in FIELD]
        assert legs.home_s[uas] == pytest.approx(alone)
    assert (legs.home_s[0] != legs.home_s[1]).any()


def test_waypoints_at_the_same_place_are_each_others_neighbours():
    twice = [FIELD[0], FIELD[0], FIELD[0], FIELD[1]]
    legs = Legs(MissionBrief.of(scenario(twice)))
    assert legs.neighbours.shape == (4, 3)
    for row, near in enumerate(legs.neighbours):
        assert sorted(near) == [w for w in range(4) if w != row]
    assert legs.between_s[0, 0, 1] == 0.0


def test_a_single_waypoint_has_no_neighbours():
    legs = Legs(MissionBrief.of(scenario(FIELD[:1])))
    assert legs.neighbours.shape == (1, 0)
    assert legs.between_s.tolist() == [[[0.0]]]


def test_every_kind_of_vehicle_has_its_own_times():
    heights = [(100.0, 100.0, -5.0), (101.0, 100.0, -55.0)]
    made = scenario(heights, ("s500_v2", "hexacopter", "s500_v2"), radius_m=4.0)
    legs = Legs(MissionBrief.of(made))
    assert legs.kind.tolist() == [0, 1, 0]
    for row, vehicle in enumerate(made.vehicles[:2]):
        climb_s = 48.0 / vehicle.limits.v_up_max_mps
        assert legs.between_s[row, 0, 1] == pytest.approx(climb_s)
    assert legs.home_s[0].tolist() != legs.home_s[1].tolist()


def legs_in_wind(waypoints_m, wind_mps):
    """Leg times (W, W) in still air and in a wind at the height of the first waypoint; its legs."""
    legs = Legs(MissionBrief.of(scenario(waypoints_m)))
    still_s = legs.between_s.copy()
    blown = legs.in_wind(np.array(wind_mps), -waypoints_m[0][2])
    np.testing.assert_array_equal(legs.between_s, still_s)
    return still_s[0], blown.between_s[0], blown


def test_a_leg_in_wind_takes_as_long_as_airspeed_and_wind_allow():
    places_m = ((50.0, 100.0, -30.0), (150.0, 100.0, -30.0), (50.0, 180.0, -30.0))
    still_s, blown_s, blown = legs_in_wind(places_m, (-6.0, 0.0))
    most_mps = 100.0 / still_s[0, 1]
    across_mps = math.sqrt(most_mps**2 - 36.0)
    assert blown_s[0, 1] == pytest.approx(100.0 / (most_mps - 6.0))
    # over ground a UAS stays a tenth of the wind below its highest speed
    assert blown_s[1, 0] == pytest.approx(100.0 / (most_mps - 0.6))
    assert blown_s[0, 2] == pytest.approx(80.0 / across_mps)
    ground_mps = blown.ground_mps(0, np.array(places_m[0]), np.array(places_m[2]))
    assert ground_mps == pytest.approx(across_mps)


def test_the_wind_of_a_leg_is_that_at_the_higher_one_of_its_ends():
    places_m = ((50.0, 100.0, -10.0), (250.0, 100.0, -10.0), (250.0, 100.0, -30.0))
    still_s, blown_s, _ = legs_in_wind(places_m, (-6.0, 0.0))
    slower = blown_s[0, 1:] / still_s[0, 1:]
    assert slower[0] == pytest.approx(12.0 / (12.0 - 6.0))
    assert slower[1] == pytest.approx(12.0 / (12.0 - 6.0 * (1.0 + 0.2 * math.log(3.0))))

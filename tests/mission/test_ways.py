"""Where to aim: straight where nothing is in the way, else round corners and over roofs."""

import numpy as np
import pytest
from hard_missions import mission

from uas_coverage_env.entities.commands import HOME
from uas_coverage_env.mission import Ways
from uas_coverage_env.mission.ways import SHADED_S

BEHIND = ((20.0, 80.0, -10.0), 5.0)
WALL = ((0.0, 40.0, -50.0), (150.0, 44.0, 0.0))
LOW_WALL = ((0.0, 40.0, -20.0), (200.0, 44.0, 0.0))
SHED = ((16.0, 40.0, -50.0), (24.0, 44.0, 0.0))
HERE = np.array([20.0, 20.0, -1.0])


def ways(*obstacles, waypoint=BEHIND):
    return Ways(mission(waypoint, obstacles=obstacles))


def test_the_straight_way_is_aimed_at_its_end():
    way = ways().to(0, 0, HERE)
    assert not way.shaded
    assert way.aim_m.tolist() == list(BEHIND[0])
    assert way.onward_s == way.onward_m == 0.0


def test_what_costs_little_to_get_past_shades_nothing():
    shed = ways(SHED)
    assert shed.seconds(0, 0, HERE) < ways().seconds(0, 0, HERE) + SHADED_S
    assert not shed.to(0, 0, HERE).shaded


@pytest.mark.parametrize("target", [0, HOME])
def test_behind_a_wall_the_next_corner_is_aimed_at_and_the_rest_is_known(target):
    made = ways(WALL)
    here = HERE if target == 0 else np.array(BEHIND[0])
    way = made.to(0, target, here)
    assert way.shaded
    assert 150.0 < way.aim_m[0] < 160.0
    assert abs(way.aim_m[1] - here[1]) < 35.0
    to_corner_m = np.linalg.norm((way.aim_m - here)[:2])
    assert way.seconds == pytest.approx((to_corner_m + way.onward_m) / 12.0, abs=0.01)
    assert 0.0 < way.onward_s < way.seconds


def test_the_faster_a_uas_is_the_earlier_it_looks_past_a_corner():
    before_corner = np.array([140.0, 30.0, -8.0])
    slowly = ways(WALL).to(0, 0, before_corner, speed_mps=2.0)
    fast = ways(WALL).to(0, 0, before_corner, speed_mps=10.0)
    assert slowly.shaded
    assert slowly.aim_m[0] > 150.0
    assert not fast.shaded or fast.aim_m[1] > slowly.aim_m[1]


def test_aim_after_aim_leads_round_the_wall_and_to_the_target():
    made, place, path = ways(WALL), HERE, []
    for _ in range(130):
        away = made.to(0, 0, place).aim_m - place
        place = place + away * min(3.0 / np.linalg.norm(away), 1.0)
        path.append(place)
        if np.linalg.norm(place - BEHIND[0]) < 1.0:
            break
    else:
        pytest.fail(f"still at {place}")
    assert max(place[0] for place in path) > 150.0


def test_a_wall_that_is_not_tall_is_aimed_over():
    here = np.array([20.0, 33.0, -1.0])
    way = ways(LOW_WALL).to(0, 0, here)
    assert way.shaded
    assert way.aim_m[2] < -20.0 - 3.36
    assert here[1] < way.aim_m[1] < 40.0
    above = np.array([*way.aim_m[:2], way.aim_m[2]])
    assert not ways(LOW_WALL).to(0, 0, above).shaded


def test_a_gap_between_two_obstacles_is_tight_and_the_end_of_a_wall_is_not():
    other = ((161.0, 40.0, -50.0), (200.0, 44.0, 0.0))
    assert not ways(WALL).to(0, 0, HERE).tight
    assert ways(WALL, other).to(0, 0, HERE).tight

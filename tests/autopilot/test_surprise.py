"""How far the filter keeps from what moves and may turn: less for a UAS that is quick to react."""

import numpy as np
import pytest

from uas_coverage_env import load_planner, load_scenario, rollout
from uas_coverage_env.autopilot.lookahead import SURPRISE_S, required_from
from uas_coverage_env.world.arena import build_arena


def beyond_the_rules_s(scenario):
    """What is kept beyond radius and safe distance, over the speed of what moves [s]."""
    arena = build_arena(scenario)
    mover, uas = scenario.moving_obstacles[0], scenario.uas[0]
    speed_mps = np.linalg.norm(arena.moving_velocity_mps[:, 0], axis=1)
    step = int(speed_mps.argmax())
    kept_m = required_from(arena, step, 0, 0) - uas.radius_m - mover.safe_distance_m
    return kept_m / speed_mps[step]


def test_the_shipped_multirotor_keeps_a_second_of_what_moves():
    assert beyond_the_rules_s(load_scenario("village")) == pytest.approx(SURPRISE_S)


def test_a_crazyflie_keeps_as_much_less_as_it_is_quicker():
    indoor = load_scenario("indoor")
    scale = float(build_arena(indoor).uas["time_scale"][0])
    assert 0.3 < scale < 0.5
    assert beyond_the_rules_s(indoor) == pytest.approx(scale * SURPRISE_S)


@pytest.mark.parametrize(
    ("mission", "planner"), [("indoor:28", "lawnmower"), ("indoor:51", "nearest-waypoint")]
)
def test_nobody_is_behind_a_person_who_turns_round(mission, planner):
    flight = rollout(load_scenario(mission), load_planner(planner), 0, safety_filter=True)
    assert flight.figures["violations"] == []
    assert flight.figures["accomplished"]

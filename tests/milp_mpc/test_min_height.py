"""The least height in the programs, in plan verification, and in whole flights."""

import dataclasses

import numpy as np
import pytest
from toy_problems import S500, box, feasible, flight, flown, state, toy, written
from uas_coverage_baselines.milp_mpc import MilpMpc
from uas_coverage_baselines.milp_mpc.model.blocks import MinHeight
from uas_coverage_baselines.milp_mpc.model.height import least_heights_m, too_low_m
from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_baselines.milp_mpc.model.problem_file import read_problems, write_problems
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble
from uas_coverage_baselines.milp_mpc.search.heuristic import construct

from uas_coverage_env import generate_scenario, rollout

HOME = (100.0, 100.0, -1.0)
RULE = {"min_height_m": 3.0, "landing_zone_m": 8.0, "home_m": [HOME]}


def near_home(position_m=(109.0, 100.0, -3.5), **fields):
    return toy(state(position_m, (0.0, 0.0, 0.0)), horizon=6, **{**RULE, **fields})


def allows(problem, position_m, step=6):
    milp, v = written(problem, MinHeight())
    return feasible(milp, [(v.position[0, step], position_m)])


def test_without_a_least_height_there_are_no_rows():
    milp, _ = written(near_home(min_height_m=0.0), MinHeight())
    assert not milp.row_names()


def test_low_is_allowed_in_the_landing_zone_only():
    problem = near_home()
    assert allows(problem, (104.0, 100.0, -1.0))
    assert allows(problem, (109.0, 100.0, -3.0))
    assert not allows(problem, (109.0, 100.0, -2.9))
    rng = np.random.default_rng(3)
    for place in rng.uniform((92.0, 92.0, -4.0), (110.0, 108.0, -0.5), (60, 3)):
        away_m = float(np.hypot(*(place[:2] - HOME[:2])))
        if place[2] > -3.0 and away_m > 8.0:
            assert not allows(problem, place), place
        elif place[2] <= -3.0 or away_m < 8.0 * np.cos(np.pi / 8):
            assert allows(problem, place), place


def test_far_from_home_and_high_above_ground_no_binary_is_needed():
    milp, _ = written(near_home((170.0, 100.0, -6.0)), MinHeight())
    built = milp.build()
    assert len(built.row_lower)
    assert not built.integer[len(built.integer) - 1]
    assert not any(name.startswith("min_height.landing") for name in milp.column_names())
    high, _ = written(near_home((170.0, 100.0, -40.0)), MinHeight())
    assert not high.row_names()


def test_a_uas_that_is_too_low_has_to_climb_as_it_can():
    x0 = state((150.0, 100.0, -1.0), (0.0, 0.0, 1.0))
    problem = toy(x0, horizon=6, **RULE)
    least = least_heights_m(problem, 0, 6)
    climbing = flight(S500, x0, [(0.0, 0.0, -S500.limits.v_up_max_mps)] * 6)
    np.testing.assert_allclose(least, np.minimum(3.0, -climbing[:, 2] - 1e-3), atol=1e-9)
    assert least[1] < 2.0 < 3.0 == least[-1]
    assert not too_low_m(problem, 0, climbing[:, :3]).any()
    level = flight(S500, x0, [(0.0, 0.0, 0.0)] * 6)
    assert too_low_m(problem, 0, level[:, :3])[-1] == pytest.approx(3.0 + level[-1, 2])


def plan_of(x, u):
    return Plan(("a",), x[None], u[None], np.zeros((1, len(u), 0), bool), 0.0, -np.inf)


def test_verification_refuses_a_plan_that_leaves_the_zone_low():
    start = state(HOME)
    slow = plan_of(*flown(S500, start, [(2.0, 0.0, 0.0)] * 4))
    far = plan_of(*flown(S500, start, [(8.0, 0.0, 0.0)] * 8))
    climbing = plan_of(*flown(S500, start, [(6.0, 0.0, -2.0)] * 8))
    assert slow.x[0, -1, 0] < 108.0 < far.x[0, -1, 0]
    for plan, refused in ((slow, False), (far, True), (climbing, False)):
        problem = toy(start, horizon=plan.u.shape[1], **RULE)
        trouble = first_trouble(problem, plan)
        assert (trouble is not None and "below the least height" in trouble) == refused


def test_constructed_flights_keep_the_least_height():
    waypoints = [((150.0, 100.0, -3.0), 15.0), ((130.0, 140.0, -2.0), 15.0)]
    problem = toy(state(HOME), horizon=12, waypoints=waypoints, **RULE)
    best = construct(problem, 0, 1.0)[0]
    assert best.too_close_m == 0.0
    assert best.positions_m[-1, 2] < -2.9
    free = construct(dataclasses.replace(problem, min_height_m=0.0), 0, 1.0)[0]
    assert free.positions_m[:, 2].max() > -2.5


def test_a_file_of_decisions_holds_the_least_height(tmp_path):
    problem = near_home(obstacles=[box((20.0, 20.0, -5.0), (30.0, 30.0, 0.0))])
    write_problems(tmp_path / "decisions.json", "test", [problem], [0])
    read = read_problems(tmp_path / "decisions.json")[0]
    assert (read.min_height_m, read.landing_zone_m) == (3.0, 8.0)


@pytest.mark.parametrize("order", ["none", "search"])
def test_a_whole_mission_is_flown_above_the_least_height(order):
    town = generate_scenario(11, n_uas=1, n_waypoints=3, n_obstacles=1, min_height_m=4.0)
    flight = rollout(town, MilpMpc(MilpMpc.Options(horizon=8, order=order)))
    assert flight.breaches == 0
    assert flight.covered[-1] == 3
    assert flight.mode[-1, 0] == 3
    assert -flight.x[:, 0, 2].min() > 4.0 > -flight.x[-1, 0, 2]

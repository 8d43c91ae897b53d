"""The numbers that the paper prints, compared with ours where the map says `faithful`."""

import numpy as np
import pytest
from toy_problems import TO_OPTIMALITY, state, toy
from uas_coverage_baselines.milp_mpc import PAPER_OCP, MilpMpcPaper, formulate
from uas_coverage_baselines.milp_mpc.model.problem import Target, Weights
from uas_coverage_baselines.milp_mpc.solvers.highs import solve

from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.params import return_threshold


def test_the_village_and_the_options_have_the_numbers_of_the_papers_table():
    village, options = load_scenario("village"), MilpMpcPaper.Options()
    assert (options.horizon, options.taylor_order) == (18, 4)
    assert (options.physical_sides, options.obstacle_sides, options.waypoint_sides) == (8, 8, 4)
    assert (village.dt_s, village.max_steps) == (1.0, 500)
    assert (len(village.uas), len(village.waypoints)) == (2, 49)
    assert (len(village.obstacles) + len(village.moving_obstacles)) == 11
    assert len(village.moving_obstacles) == 1
    assert [uas.start_m for uas in village.uas] == [(250.0, 10.0, -1.0), (230.0, 10.0, -1.0)]
    assert [uas.dod_max for uas in village.uas] == [0.75, 0.75]
    assert village.uas[0].soc_0 == 1.0
    # the table's 0.56 against the figure's 1 - 0.433: docs/deviations.md
    assert 1.0 - village.uas[1].soc_0 == pytest.approx(0.567)


def test_the_return_threshold_is_passed_at_step_70_by_the_vehicles_own_rule():
    vehicle = load_vehicle("s500_v2")
    taken = 193.816 * 180.0 / (3600.0 * 5.0 * 14.8)
    assert return_threshold(vehicle, 0.75) == pytest.approx(0.75 - taken)
    # UAS 2 at step 70: 0.567 and 70 s of its mean power of 204.6 W
    spent = 0.567 + 204.6 * 70.0 / (3600.0 * 5.0 * 14.8)
    assert return_threshold(vehicle, 0.75) == pytest.approx(spent, abs=0.003)


def test_the_fence_is_kept_by_its_margin_and_not_by_more():
    inside = toy(state((100.0, 180.0, -20.0), (0.0, 3.0, 0.0)), horizon=12, fence_margin_m=0.5)
    milp, v = formulate(inside, PAPER_OCP)
    built = milp.build()
    built.cost[:] = 0.0
    built.cost[v.position[0, 12, 1]] = -1.0  # as far east as it gets; the fence is at 200 m
    assert solve(built, TO_OPTIMALITY).values[v.position[0, 12, 1]] == pytest.approx(199.5)


def objective(problem):
    return solve(formulate(problem, PAPER_OCP)[0].build(), TO_OPTIMALITY).objective


def test_the_weights_are_ours_and_no_term_is_divided_by_the_number_of_uas():
    assert MilpMpcPaper.Options().weights == Weights()
    places = [(60.0, 40.0, -10.0), (60.0, 140.0, -10.0)]
    targets = [Target(np.array([120.0, y, -10.0]), 0.02) for _, y, _ in places]
    apart = [
        toy(state(place), horizon=3, targets=[target])
        for place, target in zip(places, targets, strict=True)
    ]
    both = toy(*(state(place) for place in places), horizon=3, targets=targets)
    assert objective(both) == pytest.approx(sum(map(objective, apart)), abs=1e-6)
    assert objective(both) > 1.0

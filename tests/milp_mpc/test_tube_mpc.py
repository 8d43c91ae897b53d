"""Tube MPC: clearances that grow along the horizon, and what is commanded in wind."""

from dataclasses import replace

import numpy as np
import pytest
from toy_problems import box, state, toy
from uas_coverage_baselines.milp_mpc.model.blocks.separation import (
    from_each_other,
    from_obstacles,
)
from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble
from uas_coverage_baselines.milp_mpc.paper_planner import PaperOptions
from uas_coverage_baselines.milp_mpc.planner import MilpMpc, MilpMpcOptions

from uas_coverage_env import generate_scenario
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.scenario import with_disturbances
from uas_coverage_env.vehicle.layout import VX, VZ
from uas_coverage_env.world import GoTo, Velocity, Wrench

WALL = box((60.0, 0.0, -50.0), (70.0, 200.0, 0.0))
TUBE_M = np.array([[0.0, 1.0, 2.0]])
STRAIGHT_ON = np.zeros((1, 2, 0), bool)
TOWN = generate_scenario(5, n_uas=1, n_waypoints=3, n_obstacles=2)


def coasting(problem):
    """Straight on at the present speed, two steps; where it is, is what is looked at."""
    (start,) = problem.x0
    x = np.array([[start, start, start]])
    for k in range(3):
        x[0, k, :3] += k * start[VX : VZ + 1]
    return Plan(problem.names, x, np.zeros((1, 2, 5)), STRAIGHT_ON, 0.0, -np.inf)


def test_a_face_asks_for_more_at_every_sample_by_the_tube_across_it():
    x = state((40.0, 100.0, -20.0), (5.0, 0.0, 0.0))
    problem = toy(x, horizon=2, obstacles=(WALL,))
    (plain,) = from_obstacles(replace(problem, prune=False))
    (tight,) = from_obstacles(replace(problem, prune=False, tube_m=TUBE_M))
    level = np.hypot(WALL.normals[:, 0], WALL.normals[:, 1])
    np.testing.assert_allclose(plain.offset_m - tight.offset_m, TUBE_M[:, :, None] * level)
    np.testing.assert_allclose(plain.lowest_m - tight.lowest_m, TUBE_M[:, :, None] * level)
    assert 0.0 in level.round(9)  # a roof is as far away in wind as in still air


def test_two_uas_keep_the_tubes_of_both_between_them():
    states = state((50.0, 50.0, -20.0)), state((90.0, 50.0, -20.0))
    problem = replace(toy(*states, horizon=2), tube_m=np.repeat(TUBE_M, 2, axis=0))
    (plain,) = from_each_other(replace(problem, tube_m=None))
    (tight,) = from_each_other(problem)
    assert (plain.offset_m - tight.offset_m)[0, 2].max() == pytest.approx(4.0)


def test_a_uas_that_is_nearer_already_need_not_be_where_it_cannot_get():
    near = state((57.5, 100.0, -20.0))  # 1.5 m of room, and the wall's clearance is 1 m
    problem = toy(near, horizon=2, obstacles=(WALL,), clearance_m=1.0)
    (plain,) = from_obstacles(replace(problem, prune=False))
    (tight,) = from_obstacles(replace(problem, prune=False, tube_m=5.0 * TUBE_M))
    assert (plain.offset_m - tight.offset_m).max() == pytest.approx(1.5)


def test_a_tube_beyond_its_last_sample_is_as_wide_as_there():
    problem = replace(toy(state((50.0, 50.0, -20.0))), tube_m=TUBE_M)
    assert problem.tubes(4).tolist() == [[0.0, 1.0, 2.0, 2.0, 2.0]]
    assert problem.only(0).tubes(1).tolist() == [[0.0, 1.0]]
    assert toy(state((50.0, 50.0, -20.0))).tubes(4) is None


def test_a_plan_along_a_wall_or_the_fence_is_refused_where_the_tube_does_not_fit():
    for obstacles, north_m in (((WALL,), 57.0), ((), 197.0)):
        x = state((north_m - 1.5, 100.0, -20.0), (1.5, 0.0, 0.0))
        problem = toy(x, horizon=2, obstacles=obstacles, clearance_m=1.0)
        plan = coasting(problem)
        assert first_trouble(problem, plan) is None
        trouble = first_trouble(replace(problem, tube_m=2.0 * TUBE_M), plan)
        assert trouble is not None
        assert "tower_0" in trouble or "fence" in trouble


def test_without_stated_bounds_the_program_is_the_same():
    problems = []
    for in_wind in ("guidance", "tube", "wrenches"):
        planner = MilpMpc(MilpMpcOptions(horizon=8, in_wind=in_wind))
        brief = MissionBrief.of(TOWN)
        planner.reset(brief, 0)
        problems.append(planner.problem(first_sight(brief)))
    assert all(problem.tube_m is None for problem in problems)
    assert all((problem.dod_max == problems[0].dod_max).all() for problem in problems)


@pytest.mark.parametrize(
    ("in_wind", "kind"), [("guidance", GoTo), ("tube", Velocity), ("wrenches", Wrench)]
)
def test_in_wind_the_planner_commands_what_it_is_asked_to(in_wind, kind):
    brief = MissionBrief.of(with_disturbances(TOWN, "moderate", 0))
    options = MilpMpcOptions(horizon=8, in_wind=in_wind, at_once=1, threads=1, time_limit_s=0.25)
    planner = MilpMpc(options)
    planner.reset(brief, 0)
    swarm = first_sight(brief)
    problem = planner.problem(swarm)
    assert (problem.tube_m is not None) == (in_wind == "tube")
    assert (problem.dod_max < brief.uas[0].dod_max).all() == (in_wind == "tube")
    assert {type(command) for command in planner.act(swarm).values()} == {kind}


def test_the_papers_planner_flies_as_in_still_air():
    assert PaperOptions().in_wind == "wrenches"
    assert MilpMpcOptions().in_wind == "guidance"

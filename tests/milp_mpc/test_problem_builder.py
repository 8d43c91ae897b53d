"""What the planner makes of a scenario and of what it sees."""

import dataclasses

import numpy as np
import pytest
from practice_missions import mission, obstacle, with_uas
from uas_coverage_baselines.margins import margins_in
from uas_coverage_baselines.milp_mpc.mode_problems import ModeProblems
from uas_coverage_baselines.milp_mpc.model.ocp import formulate
from uas_coverage_baselines.milp_mpc.model.problem import Plan, Target, Weights
from uas_coverage_baselines.milp_mpc.planner import MilpMpc, MilpMpcOptions
from uas_coverage_baselines.milp_mpc.problem_builder import ProblemBuilder

from uas_coverage_env import load_scenario
from uas_coverage_env.entities.state import LANDED
from uas_coverage_env.mission import MissionBrief, Ways
from uas_coverage_env.simulation import World
from uas_coverage_env.world import Velocity

PLACES = [((60.0, 50.0, -6.0), 8.0), ((50.0, 75.0, -6.0), 8.0), ((190.0, 190.0, -20.0), 8.0)]
STARTS = [(50.0, 50.0, -1.0), (50.0, 90.0, -1.0)]
BALLOON = {
    "name": "balloon",
    "radius_m": 10.0,
    "height_m": 20.0,
    "safe_distance_m": 3.0,
    "start_m": (60.0, 20.0, -6.0),
    "schedule": [{"from_s": 0.0, "velocity_mps": (0.0, 2.0, -0.5)}],
}


@pytest.fixture
def scenario():
    shed = obstacle((80.0, 40.0, -12.0), (90.0, 50.0, 0.0))
    made = mission(PLACES, STARTS, obstacles=[shed], moving_obstacles=[BALLOON])
    return with_uas(made, 1, vehicle="hexacopter", radius_m=0.5, soc_0=0.6)


@pytest.fixture
def around(scenario):
    return ProblemBuilder(MissionBrief.of(scenario), MilpMpcOptions(horizon=9))


def seen(scenario, **changes):
    world = World(scenario)
    world.step({name: Velocity(0.0, 0.0, 3.0) for name in world.names})
    return dataclasses.replace(world.swarm_state(), **changes)


def without_targets(scenario):
    return dict.fromkeys(uas.name for uas in scenario.uas)


def test_clearances_are_the_sums_that_the_paper_writes_and_the_margins(scenario, around):
    problem = around.problem(seen(scenario), without_targets(scenario), Weights(), 0.15)
    margins = margins_in(MissionBrief.of(scenario), None, None)
    assert margins == (0.3, 3.0)
    assert problem.obstacle_clearance_m == pytest.approx(
        np.array([[0.36 + 2.0], [0.5 + 2.0]]) + margins.fixed_m
    )
    assert problem.moving_clearance_m == pytest.approx(
        np.array([[0.36 + 3.0], [0.5 + 3.0]]) + margins.moving_m
    )
    assert problem.separation_m[0, 1] == pytest.approx(0.36 + 0.5 + 5.0 + margins.fixed_m)
    assert 0.5 <= problem.fence_margin_m <= 0.5 + margins.fixed_m


@pytest.mark.parametrize(("dt_s", "kept_m"), [(0.2, 0.6), (0.02, 0.12)])
def test_what_moves_is_kept_from_by_a_change_of_3_mps_until_the_next_sample(dt_s, kept_m):
    brief = MissionBrief.of(load_scenario("indoor").model_copy(update={"dt_s": dt_s}))
    margins = MilpMpcOptions().margins(brief)
    assert margins.moving_m == pytest.approx(kept_m, rel=0.05)
    assert margins.fixed_m == pytest.approx(0.012, rel=0.05)
    assert MilpMpcOptions(moving_margin_m=0.1).margins(brief).moving_m == 0.1


def test_each_uas_is_planned_with_its_own_vehicle_and_its_own_battery(scenario, around):
    problem = around.problem(seen(scenario), without_targets(scenario), Weights(), 0.15)
    assert [vehicle.airframe.n_motors for vehicle in problem.vehicles] == [4, 6]
    assert not np.array_equal(problem.models[0].B, problem.models[1].B)
    assert problem.horizon == 9


def test_moving_obstacles_are_predicted_at_the_velocity_that_is_seen(scenario, around):
    swarm = seen(scenario)
    (balloon,) = around.problem(swarm, without_targets(scenario), Weights(), 0.15).moving
    assert balloon.position_m.shape == (10, 3)
    assert balloon.position_m[0] == pytest.approx([60.0, 22.0, -6.5])
    assert np.diff(balloon.position_m, axis=0) == pytest.approx(np.tile([0.0, 2.0, -0.5], (9, 1)))
    assert (balloon.radius_m, balloon.half_height_m) == (10.0, 10.0)


def test_waypoints_that_no_uas_reaches_within_the_horizon_are_left_out(scenario, around):
    problem = around.problem(seen(scenario), without_targets(scenario), Weights(), 0.15)
    assert problem.waypoint_index.tolist() == [0, 1]
    assert problem.n_scenario_waypoints == 3
    assert problem.waypoint_reach_m == pytest.approx([4.0, 4.0])


def test_covered_waypoints_are_left_out_and_targets_follow_the_new_rows(scenario, around):
    swarm = seen(scenario, uncovered=np.array([False, True, True]))
    targets = {
        "uas_1": Target(np.array(PLACES[1][0]), 0.1, waypoint=1),
        "uas_2": Target(np.array(PLACES[2][0]), 0.2, waypoint=2),
    }
    problem = around.problem(swarm, targets, Weights(), 0.15)
    assert problem.waypoint_index.tolist() == [1]
    near, far = problem.targets
    assert near == dataclasses.replace(targets["uas_1"], waypoint=0)
    # out of reach it cannot be covered within the horizon: nothing relaxes the distance
    assert far == dataclasses.replace(targets["uas_2"], waypoint=None)


def test_landed_uas_are_no_part_of_the_problem(scenario, around):
    swarm = seen(scenario, status=np.array([LANDED, 0]))
    problem = around.problem(swarm, without_targets(scenario), Weights(), 0.15)
    assert problem.names == ("uas_2",)
    assert problem.x0 == pytest.approx(swarm.x[1:])
    assert problem.separation_m.shape == (1, 1)


def test_a_waypoint_wholly_inside_a_moving_obstacles_keep_out_is_blocked(scenario, around):
    inside = seen(scenario, moving_position_m=np.array([[60.0, 50.0, -6.0]]))
    beside = seen(scenario, moving_position_m=np.array([[60.0, 62.0, -6.0]]))
    above = seen(scenario, moving_position_m=np.array([[60.0, 50.0, -25.0]]))
    assert around.blocked_waypoints(inside) == {0}
    assert around.blocked_waypoints(beside) == set()
    assert around.blocked_waypoints(above) == set()


def test_the_battery_gives_less_time_and_the_way_home_takes_more_the_farther_out(around):
    left = [around.seconds_left("uas_1", dod) for dod in (0.0, 0.3, 0.6, 0.75)]
    assert (np.diff(left) < 0.0).all()
    assert left[-1] == pytest.approx(0.0)
    away = [around.seconds_home("uas_1", np.array([50.0 + d, 50.0, -1.0])) for d in (0, 50, 100)]
    assert (np.diff(away) > 0.0).all()


BEHIND = [((40.0, 120.0, -6.0), 8.0)]
WALL = obstacle((0.0, 80.0, -50.0), (150.0, 84.0, 0.0), "wall")


def decision(scenario, ways=True):
    """The first decision of `milp-mpc`, in transit to what it does not reach within the horizon."""
    brief, options = MissionBrief.of(scenario), MilpMpcOptions(horizon=8)
    by_modes = ModeProblems(brief, options, Ways(brief) if ways else None)
    swarm = World(scenario).swarm_state()
    hovering = by_modes.problem(swarm, None)
    covers = np.zeros((1, 8, len(scenario.waypoints)), bool)
    x = np.repeat(hovering.x0[:, None], 9, axis=1)
    plan = Plan(hovering.names, x, np.zeros((1, 8, 5)), covers, 0.0, -np.inf)
    return by_modes.problem(swarm, plan)


def test_behind_a_wall_the_target_is_beyond_the_next_corner():
    problem = decision(mission(BEHIND, [(40.0, 40.0, -1.0)], obstacles=[WALL]))
    (target,) = problem.targets
    start_m = problem.x0[0, :3]
    assert target.position_m[0] - start_m[0] > 8 * 12.0 * 0.9
    assert problem.ways_home == ()
    back = mission([((40.0, 40.0, -6.0), 8.0)], [(40.0, 120.0, -1.0)], obstacles=[WALL])
    brief = MissionBrief.of(back)
    builder = ProblemBuilder(brief, MilpMpcOptions(horizon=8), Ways(brief))
    there = World(back).swarm_state()
    there.x[0, 1] = 40.0
    seen_now = builder.problem(there, {"uas_1": None}, Weights(), 0.0)
    (way,) = seen_now.ways_home
    assert 150.0 < way.corner_m[0] < 160.0
    assert way.onward_s > 110.0 / 12.0
    straight = ProblemBuilder(brief, MilpMpcOptions(horizon=8))
    assert builder.seconds_home("uas_1", there.x[0, :3]) > 1.5 * straight.seconds_home(
        "uas_1", there.x[0, :3]
    )


def test_the_paper_aims_straight_through_the_wall():
    scenario = mission(BEHIND, [(40.0, 40.0, -1.0)], obstacles=[WALL])
    problem = decision(scenario, ways=False)
    assert problem.targets[0].position_m.tolist() == list(BEHIND[0][0])
    assert problem.ways_home == ()


def test_where_nothing_shades_the_target_the_program_is_the_straight_one():
    shed = obstacle((70.0, 75.0, -12.0), (90.0, 84.0, 0.0))
    scenario = mission([((190.0, 190.0, -6.0), 8.0)], [(20.0, 20.0, -1.0)], obstacles=[shed])
    built, straight = (formulate(decision(scenario, ways))[0].build() for ways in (True, False))
    for name in ("cost", "lower", "upper", "row_lower", "row_upper"):
        assert getattr(built, name).tobytes() == getattr(straight, name).tobytes()


def test_an_order_that_begins_behind_a_wall_leads_round_it_first():
    scenario = mission(BEHIND, [(40.0, 40.0, -1.0)], obstacles=[WALL])
    made = MilpMpc(MilpMpcOptions(horizon=8, order="search"))
    made.reset(MissionBrief.of(scenario), 0)
    problem = made.problem(World(scenario).swarm_state())
    (tour,) = problem.tours
    turns_m = tour.led_by_m(problem.waypoints_m)
    assert turns_m is not None
    assert turns_m[0] - problem.x0[0, 0] > 8 * 12.0 * 0.9
    assert made.target("uas_1") == 0
    assert made.mode("uas_1") == "covering"

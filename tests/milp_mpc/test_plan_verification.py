"""What must not be flown is recognised, and every plan that is flown has a backup trajectory."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy_problems import S500, box, flown, moving, state, toy
from uas_coverage_baselines.milp_mpc.fallback.backup import backup_trajectory
from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble

from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.layout import DOD, PHI, THETA, VX, VZ, WX, WZ
from uas_coverage_env.vehicle.scale import braking_s

HEXACOPTER = load_vehicle("hexacopter")
START = state((60.0, 60.0, -10.0), (5.0, 0.0, 0.0))
AHEAD = [(6.0, 0.0, 0.0)] * 8


def planned(*flights, n_waypoints=0, names="abcdef"):
    """A plan of flights (x, u) of equal length."""
    x, u = (np.array([one[k] for one in flights]) for k in range(2))
    covers = np.zeros((*u.shape[:2], n_waypoints), bool)
    return Plan(tuple(names[: len(x)]), x, u, covers, 0.0, -np.inf)


def ahead(x0=START, commands=AHEAD, vehicle=S500):
    return flown(vehicle, x0, commands)


def between(plan, step, share=0.5, row=0):
    """A position on the way from a step to the next."""
    return (1.0 - share) * plan.x[row, step, :3] + share * plan.x[row, step + 1, :3]


def plate_at(place):
    """A wall across the way, so thin that samples lie on both sides of it."""
    return box(place - np.array([0.2, 9.0, 9.0]), place + np.array([0.2, 9.0, 9.0]))


def test_a_good_plan_is_accepted():
    plan = planned(ahead(), ahead(state((60.0, 80.0, -10.0), (5.0, 0.0, 0.0))))
    problem = toy(
        *plan.x[:, 0],
        horizon=8,
        obstacles=[box((60.0, 66.0, -20.0), (110.0, 74.0, 0.0))],
        moving_obstacles=[moving(np.tile((90.0, 95.0, -10.0), (9, 1)))],
    )
    assert first_trouble(problem, plan) is None


def test_a_plan_that_leaves_the_fence_is_refused():
    start = state((170.0, 60.0, -10.0), (8.0, 0.0, 0.0))
    plan = planned(ahead(start, [(9.0, 0.0, 0.0)] * 8))
    assert "leaves the fence" in first_trouble(toy(start, horizon=8), plan)


def test_a_plan_within_the_fences_margin_is_refused():
    plan = planned(ahead())
    reach_m = float(plan.x[0, :, 0].max())
    problem = toy(START, horizon=8, fence=box((0.0, 0.0, -50.0), (reach_m + 0.4, 200.0, 0.0)))
    assert "leaves the fence's margin by 0.1 m" in first_trouble(problem, plan)
    inside = dataclasses.replace(problem, fence_margin_m=0.39)
    assert first_trouble(inside, plan) is None


@pytest.mark.parametrize("step", range(1, 8))
def test_an_obstacle_between_two_samples_is_seen(step):
    plan = planned(ahead())
    problem = toy(START, horizon=8, obstacles=[plate_at(between(plan, step))], clearance_m=0.3)
    assert (problem.obstacles[0][1].signed_distance(plan.x[0, :, :3]) > 0.3).all()
    assert "a comes within" in first_trouble(problem, plan)
    assert "of tower_0" in first_trouble(problem, plan)


def test_an_obstacle_is_kept_away_from_by_its_clearance_and_not_more():
    plan = planned(ahead())
    wall = box((60.0, 63.0, -20.0), (120.0, 70.0, 0.0))
    for clearance_m, accepted in ((2.99, True), (3.01, False)):
        problem = toy(START, horizon=8, obstacles=[wall], clearance_m=clearance_m)
        assert (first_trouble(problem, plan) is None) == accepted


@pytest.mark.parametrize("step", range(1, 8))
def test_a_moving_obstacle_that_crosses_between_two_samples_is_seen(step):
    plan = planned(ahead())
    path = np.tile(between(plan, step) + np.array([0.0, 0.0, 30.0]), (9, 1))
    path[: step + 1, 2] -= 60.0  # a thin disk that drops through the way during this step
    disk = moving(path, radius_m=2.0, half_height_m=0.1)
    problem = toy(START, horizon=8, moving_obstacles=[disk], moving_clearance_m=0.5)
    assert first_trouble(problem, plan).endswith("of mover")


@pytest.mark.parametrize("step", range(1, 8))
def test_two_uas_that_meet_between_two_samples_are_seen(step):
    plan = planned(ahead(), ahead())
    # b crosses the way of a at full speed: 8 m before and behind it at the samples
    meeting = between(plan, step)
    side = np.where(np.arange(9) <= step, -8.0, 8.0)
    plan.x[1, :, :3] = meeting + side[:, None] * np.array([0.0, 1.0, 0.0])
    problem = toy(*plan.x[:, 0], horizon=8, separation_m=6.0)
    apart = plan.x[0, :, :3] - plan.x[1, :, :3]
    assert (np.hypot(apart[:, 0], apart[:, 1]) > 6.0).all()
    assert "a and b come within" in first_trouble(problem, plan)


def test_two_uas_that_meet_in_the_very_first_step_are_seen():
    plan = planned(ahead(), ahead())
    side = np.where(np.arange(9) <= 0, -8.0, 8.0)
    plan.x[1, :, :3] = between(plan, 0) + side[:, None] * np.array([0.0, 1.0, 0.0])
    problem = toy(*plan.x[:, 0], horizon=8, separation_m=6.0)
    assert first_trouble(problem, plan) is not None


def test_an_obstacle_in_the_very_first_step_is_seen():
    plan = planned(ahead())
    problem = toy(START, horizon=8, obstacles=[plate_at(between(plan, 0))], clearance_m=0.3)
    assert first_trouble(problem, plan) is not None


def test_a_uas_that_starts_too_close_may_leave():
    plan = planned(ahead())
    behind = box((50.0, 50.0, -20.0), (58.5, 70.0, 0.0))
    problem = toy(START, horizon=8, obstacles=[behind], clearance_m=3.0)
    assert behind.signed_distance(START[:3]) < 3.0
    assert first_trouble(problem, plan) is None


@pytest.mark.parametrize("axis", range(3))
def test_a_plan_that_begins_elsewhere_is_refused(axis):
    plan = planned(ahead())
    moved = START.copy()
    moved[axis] += 0.01
    assert first_trouble(toy(moved, horizon=8), plan) == "a is not where its plan begins"


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("where", ["x", "u"])
def test_a_plan_that_is_not_finite_is_refused(value, where):
    plan = planned(ahead())
    getattr(plan, where)[0, 3, 1] = value
    assert first_trouble(toy(START, horizon=8), plan) == "the plan is not finite"


def test_a_plan_without_one_of_the_uas_is_refused():
    plan = planned(ahead())
    other = state((60.0, 90.0, -10.0))
    assert first_trouble(toy(START, other, horizon=8), plan) == "no plan for b"


def test_a_plan_for_more_uas_than_fly_is_judged_for_those_that_fly():
    plan = planned(ahead(state((60.0, 61.0, -10.0))), ahead(), names="za")
    assert first_trouble(toy(START, horizon=8), plan) is None


def speeds_mps(x):
    return np.linalg.norm(x[..., VX : VZ + 1], axis=-1)


commands = st.lists(
    st.tuples(st.floats(-12.0, 12.0), st.floats(-12.0, 12.0), st.floats(-3.0, 1.5)),
    min_size=3,
    max_size=6,
)


@pytest.mark.parametrize(("vehicle", "dt_s"), [(S500, 1.0), (S500, 0.5), (HEXACOPTER, 1.0)])
@settings(max_examples=30, deadline=None, derandomize=True)
@given(commands=commands)
def test_a_backup_trajectory_ends_in_a_hover_whatever_was_flown(vehicle, dt_s, commands):
    sky = box((-500.0, -500.0, -500.0), (500.0, 500.0, 500.0))
    x, u = flown(vehicle, state((0.0, 0.0, 0.0)), np.array(commands), dt_s)
    problem = toy(x[0], horizon=len(u), vehicles=[vehicle], fence=sky, dt_s=dt_s)
    out = backup_trajectory(problem, planned((x, u)), dt_s)
    assert out.u.shape[1] == len(u) + np.ceil(braking_s([vehicle], dt_s) / dt_s)
    assert speeds_mps(out.x[:, -1]) < 0.1
    assert np.abs(out.x[:, -1, [PHI, THETA, WX, WX + 1, WZ]]).max() < 0.02


def test_a_backup_trajectory_follows_a_plan_to_its_end_where_it_can():
    plan = planned(ahead(), n_waypoints=2)
    plan.covers[0, 4, 1] = True
    problem = toy(START, horizon=8, waypoints=[(START[:3], 5.0)] * 2)
    out = backup_trajectory(problem, plan, 1.0)
    assert out.x[:, :9] == pytest.approx(plan.x)
    assert out.u[:, :8] == pytest.approx(plan.u)
    assert np.argwhere(out.covers).tolist() == [[0, 4, 1]]
    assert first_trouble(problem, out) is None


def test_a_backup_trajectory_leaves_the_plan_in_time_to_stop_before_the_wall():
    start = state((60.0, 60.0, -10.0), (8.0, 0.0, 0.0))
    plan = planned(ahead(start, [(8.0, 0.0, 0.0)] * 8), n_waypoints=1)
    plan.covers[0, 7, 0] = True
    wall = box((float(plan.x[0, 8, 0]) + 2.0, 0.0, -49.0), (150.0, 200.0, 0.0))
    problem = toy(start, horizon=8, obstacles=[wall], waypoints=[(start[:3], 5.0)])
    assert first_trouble(problem, plan) is None
    out = backup_trajectory(problem, plan, 1.0)
    followed = int((np.abs(out.x[0, :9] - plan.x[0]).max(axis=1) < 1e-9).sum()) - 1
    assert 1 <= followed < 8
    assert not out.covers.any()
    assert first_trouble(problem, out) is None
    # to follow one step more would be one too many
    shorter = dataclasses.replace(plan, x=plan.x[:, : followed + 2], u=plan.u[:, : followed + 1])
    longest = backup_trajectory(problem, shorter, 1.0)
    assert np.abs(longest.x[0, followed + 1, :3] - plan.x[0, followed + 1, :3]).max() > 1e-6


def test_there_is_no_backup_trajectory_where_even_braking_after_the_first_step_hits():
    start = state((60.0, 60.0, -10.0), (11.0, 0.0, 0.0))
    plan = planned(ahead(start, [(11.0, 0.0, 0.0)] * 2))
    wall = box((float(plan.x[0, 2, 0]) + 1.5, 0.0, -49.0), (150.0, 200.0, 0.0))
    problem = toy(start, horizon=2, obstacles=[wall])
    assert first_trouble(problem, plan) is None
    assert backup_trajectory(problem, plan, 1.0) is None


def test_moving_obstacles_fly_on_while_a_uas_brakes():
    plan = planned(ahead(commands=[(5.0, 0.0, 0.0)] * 4))
    problem = toy(START, horizon=4)
    hover_m = backup_trajectory(problem, plan, 1.0).x[0, -1, :3]
    # comes through the place of the hover 6 s after the plan's end
    approach = hover_m + (np.arange(5) - 10.0)[:, None] * np.array([0.0, 4.0, 0.0])
    problem = dataclasses.replace(
        problem,
        moving=(moving(approach, 2.0, 2.0),),
        moving_clearance_m=np.array([[1.0]]),
    )
    assert first_trouble(problem, plan) is None
    out = backup_trajectory(problem, plan, 1.0)
    assert hover_m[0] - out.x[0, -1, 0] > 2.0  # it stops earlier, out of the way


def test_a_backup_trajectory_is_made_for_those_that_fly():
    plan = planned(ahead(state((60.0, 61.0, -10.0))), ahead(), names="za")
    out = backup_trajectory(toy(START, horizon=8), plan, 1.0)
    assert out.names == ("a",)
    assert out.x[0, :9] == pytest.approx(plan.x[1])


def test_a_backup_trajectory_says_what_it_takes_from_the_battery():
    plan = planned(ahead())
    problem = toy(START, horizon=8)
    out = backup_trajectory(problem, plan, 1.0)
    taken = np.diff(out.x[0, 8:, DOD])
    hovering = problem.models[0].E[DOD]
    assert taken == pytest.approx(np.full(len(taken), hovering), rel=0.3)


def test_what_is_left_of_a_plan_is_the_plan_without_its_first_step():
    plan = planned(ahead(), n_waypoints=1)
    plan.covers[0, 2, 0] = True
    left = plan.advanced()
    assert left.x == pytest.approx(plan.x[:, 1:])
    assert left.u == pytest.approx(plan.u[:, 1:])
    assert np.argwhere(left.covers).tolist() == [[0, 1, 0]]
    for _ in range(6):
        left = left.advanced()
    assert left.u.shape[1] == 1
    assert left.advanced() is None


def test_the_gap_of_a_plan_is_relative_to_what_it_can_influence():
    plan = dataclasses.replace(planned(ahead()), objective=-8.0, bound=-10.0)
    assert plan.relative_gap() == pytest.approx(0.25)
    assert dataclasses.replace(plan, bound=-7.0).relative_gap() == 0.0
    assert dataclasses.replace(plan, bound=-np.inf).relative_gap() is None

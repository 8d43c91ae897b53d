"""Backup trajectories of a team: each comes home, all keep apart, each as long as it can."""

import dataclasses

import numpy as np
import pytest
from toy_problems import S500, box, flown, moving, state, toy
from uas_coverage_baselines.milp_mpc.fallback.backup import (
    backup_trajectory,
    course_of,
    prolonged,
    still_holds,
)
from uas_coverage_baselines.milp_mpc.fallback.plans import fallback_plans
from uas_coverage_baselines.milp_mpc.model.blocks.battery_reserve import short_s
from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble

from uas_coverage_env.planning.backup.course import braked
from uas_coverage_env.vehicle import compile_vehicle
from uas_coverage_env.vehicle.layout import DOD, PHI, THETA, VX, VZ, WX
from uas_coverage_env.vehicle.range import dod_per_s

HORIZON = 8
BRAKING = 14
NORTH = [(6.0, 0.0, 0.0)] * HORIZON


def plan_of(*flights, n_waypoints=0):
    x, u = (np.array([one[k] for one in flights]) for k in range(2))
    covers = np.zeros((*u.shape[:2], n_waypoints), bool)
    return Plan(tuple("abcdef"[: len(x)]), x, u, covers, 0.0, -np.inf)


def followed(plan, backup, row=0):
    """For how many steps a backup trajectory follows a plan."""
    n = min(plan.u.shape[1], backup.u.shape[1])
    same = np.abs(backup.u[row, :n] - plan.u[row, :n]).max(axis=1) < 1e-12
    return int(same.argmin()) if not same.all() else n


def crossing():
    """a flies north; b comes from the west and, braking late, would end in a's way."""
    a = flown(S500, state((60.0, 60.0, -10.0), (6.0, 0.0, 0.0)), NORTH)
    b = flown(S500, state((118.0, 5.0, -10.0), (0.0, 6.0, 0.0)), [(0.0, 6.0, 0.0)] * HORIZON)
    return plan_of(a, b)


def at_rest(plan):
    assert np.linalg.norm(plan.x[:, -1, VX : VZ + 1], axis=1).max() < 0.1


# all apart


def test_the_second_stops_in_time_for_the_first_to_follow_its_plan():
    plan = crossing()
    problem = toy(*plan.x[:, 0], horizon=HORIZON)
    alone = toy(plan.x[1, 0], horizon=HORIZON)
    assert first_trouble(problem, plan) is None
    of_b = dataclasses.replace(plan_of((plan.x[1], plan.u[1])), names=("a",))
    free = followed(of_b, backup_trajectory(alone, of_b, 1.0))
    out = backup_trajectory(problem, plan, 1.0)
    assert followed(plan, out, 0) == HORIZON
    assert 0 < followed(plan, out, 1) < free
    assert first_trouble(problem, out) is None
    at_rest(out)


def meeting(gap_m=6.0):
    """b waits beyond where a's plan ends, so near that a has to brake before its end."""
    a = flown(S500, state((60.0, 60.0, -10.0), (6.0, 0.0, 0.0)), NORTH)
    end_m = a[0][-1, 0]
    b = flown(S500, state((end_m + gap_m, 60.0, -10.0)), [(0.0, 0.0, 0.0)] * HORIZON)
    return plan_of(a, b)


def test_two_are_kept_apart_after_the_plans_end_too():
    plan = meeting()
    problem = toy(*plan.x[:, 0], horizon=HORIZON)
    assert first_trouble(problem, plan) is None
    out = backup_trajectory(problem, plan, 1.0)
    assert out is not None
    level_m = np.linalg.norm(out.x[0, :, :2] - out.x[1, :, :2], axis=1)
    assert level_m.min() >= 6.0 - 1e-4
    # without the second the first goes on to its end
    one = plan_of((plan.x[0], plan.u[0]))
    assert followed(one, backup_trajectory(toy(plan.x[0, 0], horizon=HORIZON), one, 1.0)) == HORIZON
    # and with the separation it has it could not
    longer = [out.x[0, k + 1, 0] - plan.x[0, k + 1, 0] for k in range(followed(plan, out))]
    assert np.abs(longer).max() < 1e-9
    assert followed(plan, out) < HORIZON


def test_where_the_last_has_no_way_all_stop_together():
    # a flies past in front of b, and its hover at the end would be where b has to brake
    a = flown(S500, state((60.0, 66.5, -10.0), (6.0, 0.0, 0.0)), NORTH)
    first = a[0]
    b = flown(S500, state((first[4, 0], 60.0, -10.0), (-0.2, 0.0, 0.0)), [(6.0, 0.0, 0.0)] * 8)
    plan = plan_of(a, b)
    problem = toy(*plan.x[:, 0], horizon=HORIZON, separation_m=6.0)
    out = backup_trajectory(problem, plan, 1.0)
    assert out is not None
    assert first_trouble(problem, out) is None
    at_rest(out)


def test_there_is_none_where_the_team_cannot_be_kept_apart():
    a = flown(S500, state((60.0, 60.0, -10.0), (11.0, 0.0, 0.0)), [(11.0, 0.0, 0.0)] * 2)
    b = flown(S500, state((95.0, 60.0, -10.0), (-11.0, 0.0, 0.0)), [(-11.0, 0.0, 0.0)] * 2)
    plan = plan_of(a, b)
    problem = toy(*plan.x[:, 0], horizon=2, separation_m=6.0)
    assert backup_trajectory(problem, plan, 1.0) is None


# comes home


def far_from_home(spare_s, row=1):
    """Two that fly away from home, of which one has so many seconds to spare now."""
    flights = [
        flown(S500, state((400.0, 20.0 + 60.0 * k, -20.0), (6.0, 0.0, 0.0)), NORTH)
        for k in range(2)
    ]
    sky = box((-2000.0, -2000.0, -100.0), (2000.0, 2000.0, 0.0))
    home_m = [(0.0, 60.0 * k, -1.0) for k in range(2)]
    known = {"horizon": HORIZON, "fence": sky, "home_m": home_m}
    problem = toy(*[x[0] for x, _ in flights], **known)
    shift = (-short_s(problem, row, problem.x0[row]) - spare_s) * dod_per_s(S500, 0.75)
    x0 = problem.x0.copy()
    x0[row, DOD] += shift
    flights[row] = flown(S500, x0[row], NORTH)
    return toy(*x0, **known), plan_of(*flights)


@pytest.mark.parametrize("row", [0, 1])
def test_each_of_a_team_stops_where_it_can_still_come_home(row):
    plenty, plan = far_from_home(60.0, row)
    out = backup_trajectory(plenty, plan, 1.0)
    assert [followed(plan, out, k) for k in range(2)] == [HORIZON] * 2
    scarce, plan = far_from_home(4.0, row)
    assert short_s(scarce, row, scarce.x0[row]) < 0.0
    out = backup_trajectory(scarce, plan, 1.0)
    n = followed(plan, out, row)
    assert 0 < n < HORIZON
    # at the end of all of it: what hovers while the other still flies takes charge
    assert short_s(scarce, row, out.x[row, -1], allowance=False) <= 0.0
    record = compile_vehicle(S500, 1.0)[()]
    farther = braked(record, course_of(plan, "ab"[row]), n + 1, BRAKING)
    assert short_s(scarce, row, farther.x[-1], allowance=False) > 0.0


def test_one_that_is_late_whatever_it_does_holds_up_no_other():
    late, plan = far_from_home(-80.0)
    out = backup_trajectory(late, plan, 1.0)
    assert out is not None
    assert [followed(plan, out, k) for k in range(2)] == [HORIZON] * 2


@pytest.mark.parametrize(("spare_s", "is_late"), [(0.5, False), (-0.5, True)])
def test_a_uas_is_late_from_the_moment_on_at_which_it_would_have_had_to_turn_back(spare_s, is_late):
    problem, plan = far_from_home(spare_s)
    out = backup_trajectory(problem, plan, 1.0)
    assert (out is not None and followed(plan, out, 1) == HORIZON) == is_late


def test_a_wall_before_one_uas_does_not_shorten_what_another_follows():
    starts = [state((60.0, 60.0 + 60.0 * k, -10.0), (6.0, 0.0, 0.0)) for k in range(2)]
    plan = plan_of(*[flown(S500, x0, NORTH) for x0 in starts])
    wall_m = float(plan.x[1, -1, 0]) + 3.0
    wall = box((wall_m, 90.0, -49.0), (wall_m + 20.0, 150.0, 0.0))
    problem = toy(*starts, horizon=HORIZON, obstacles=[wall])
    assert first_trouble(problem, plan) is None
    out = backup_trajectory(problem, plan, 1.0)
    assert followed(plan, out, 0) == HORIZON
    assert 0 < followed(plan, out, 1) < HORIZON


@pytest.mark.parametrize(("share", "followed_to"), [(0.9, HORIZON - 1), (0.2, HORIZON)])
def test_a_plan_is_left_before_a_manoeuvre_out_of_which_braking_would_lean_too_far(
    share, followed_to
):
    limits, plan = S500.limits, plan_of(flown(S500, state((60.0, 60.0, -10.0)), NORTH))
    plan.x[0, -1, PHI] = share * limits.tilt_max_rad  # and leaning farther
    plan.x[0, -1, WX] = share * limits.rate_max_radps
    problem = toy(plan.x[0, 0], horizon=HORIZON)
    braking = braked(compile_vehicle(S500, 1.0)[()], course_of(plan, "a"), HORIZON, BRAKING).x
    leans = np.hypot(braking[HORIZON + 1 :, PHI], braking[HORIZON + 1 :, THETA]).max()
    assert (leans > 1.02 * limits.tilt_max_rad) == (followed_to < HORIZON)
    assert followed(plan, backup_trajectory(problem, plan, 1.0)) == followed_to


def test_what_a_plan_itself_does_is_not_asked_of_braking():
    limits, plan = S500.limits, plan_of(flown(S500, state((60.0, 60.0, -10.0)), NORTH))
    plan.x[0, -1, PHI], plan.x[0, -1, WX] = 1.1 * limits.tilt_max_rad, -0.5 * limits.rate_max_radps
    problem = toy(plan.x[0, 0], horizon=HORIZON)
    braking = braked(compile_vehicle(S500, 1.0)[()], course_of(plan, "a"), HORIZON, BRAKING).x
    leans = np.hypot(braking[HORIZON + 1 :, PHI], braking[HORIZON + 1 :, THETA])
    assert leans.max() < limits.tilt_max_rad
    assert followed(plan, backup_trajectory(problem, plan, 1.0)) == HORIZON


def test_a_team_waits_for_the_end_of_the_longest_and_keeps_what_it_covers_until_it_brakes():
    plan = dataclasses.replace(crossing(), covers=np.zeros((2, HORIZON, 3), bool))
    plan.covers[1, 1, 0] = plan.covers[1, HORIZON - 1, 1] = plan.covers[0, HORIZON - 1, 2] = True
    waypoints = [((60.0, 60.0, -10.0), 5.0)] * 3
    out = backup_trajectory(toy(*plan.x[:, 0], horizon=HORIZON, waypoints=waypoints), plan, 1.0)
    n = [followed(plan, out, k) for k in range(2)]
    assert n[1] < n[0] == HORIZON
    assert out.u.shape[1] == HORIZON + BRAKING
    assert np.argwhere(out.covers).tolist() == [[0, HORIZON - 1, 2], [1, 1, 0]]


def test_what_moves_is_predicted_for_as_long_as_the_longest_backup_takes():
    plan = plan_of(flown(S500, state((60.0, 60.0, -10.0), (6.0, 0.0, 0.0)), NORTH))
    late_m = plan.x[0, -1, :3] + (9.0, 0.0, 0.0)  # where the first will hover
    path_m = late_m + np.outer(np.arange(HORIZON + 1) - 20, (0.0, 6.0, 0.0))
    problem = toy(
        *plan.x[:, 0],
        horizon=HORIZON,
        moving_obstacles=[moving(path_m, 2.0, 2.0)],
        moving_clearance_m=3.0,
    )
    assert first_trouble(problem, plan) is None
    out = backup_trajectory(problem, plan, 1.0)
    assert followed(plan, out, 0) < HORIZON
    level_m = out.x[0, 20:22, :2] - late_m[:2]
    assert np.hypot(*level_m.T).min() > 5.0


# what is left still holds


def hovering(steps=10):
    x0 = state((60.0, 60.0, -10.0))
    plan = plan_of(flown(S500, x0, [(0.0, 0.0, 0.0)] * steps))
    return plan, toy(x0, horizon=4)


def test_what_is_left_of_a_backup_holds_as_long_as_it_begins_here_and_is_clear():
    plan, problem = hovering()
    assert still_holds(problem, plan)
    elsewhere = dataclasses.replace(problem, x0=problem.x0 + 0.01)
    assert not still_holds(elsewhere, plan)
    other = toy(problem.x0[0], state((60.0, 90.0, -10.0)), horizon=4)
    assert not still_holds(other, plan)


@pytest.mark.parametrize(("arrives", "holds"), [(9, False), (12, True)])
def test_what_moves_is_seen_to_the_end_of_a_backup_and_not_beyond(arrives, holds):
    plan, problem = hovering(10)
    # at 4 m/s it is 5 m from the hover, with its radius, after so many steps
    path_m = np.array([60.0, 60.0, -10.0]) + np.outer(np.arange(5) - arrives, (0.0, 4.0, 0.0))
    coming = dataclasses.replace(
        problem,
        moving=(moving(path_m - (0.0, 3.9, 0.0), 2.0, 2.0),),
        moving_clearance_m=np.array([[1.0]]),
    )
    assert (
        first_trouble(coming, dataclasses.replace(plan, x=plan.x[:, :5], u=plan.u[:, :4])) is None
    )
    assert still_holds(coming, plan) == holds


@pytest.mark.parametrize("steps", [2, 3, 4, 9])
def test_what_moves_goes_on_as_it_goes_now(steps):
    path_m = np.outer(np.arange(4), (1.0, -2.0, 0.5)) + 7.0
    problem = dataclasses.replace(hovering()[1], moving=(moving(path_m),))
    (longer,) = prolonged(problem, steps)
    n = max(steps, 3) + 1
    np.testing.assert_allclose(longer.position_m, np.outer(np.arange(n), (1.0, -2.0, 0.5)) + 7.0)


# plans that need no solver


def test_a_fallback_plan_is_the_rest_of_a_backup_held_to_the_horizon_and_then_braking():
    x0 = state((60.0, 60.0, -10.0), (6.0, 0.0, 0.0))
    problem = toy(x0, horizon=HORIZON, waypoints=[((70.0, 60.0, -10.0), 8.0)])
    (braking,) = fallback_plans(problem, 0, None, 1.0)
    assert braking.u.shape == (1, HORIZON, 5)
    np.testing.assert_array_equal(braking.x[0, 0], x0)
    assert not braking.covers.any()
    assert braking.bound == -np.inf, "nothing is proved of it"
    for steps in (3, HORIZON, HORIZON + 4):
        backup = plan_of(flown(S500, x0, [(3.0, 0.0, 0.0)] * steps), n_waypoints=1)
        backup.covers[0, min(steps, HORIZON) - 1, 0] = True
        first, second = fallback_plans(problem, 0, backup, 1.0)
        n = min(steps, HORIZON)
        assert first.u.shape == (1, HORIZON, 5)
        np.testing.assert_array_equal(first.x[0, : n + 1], backup.x[0, : n + 1])
        np.testing.assert_array_equal(first.u[0, :n], backup.u[0, :n])
        assert np.argwhere(first.covers).tolist() == [[0, n - 1, 0]]
        np.testing.assert_array_equal(second.u, braking.u)
    short = plan_of(flown(S500, x0, [(3.0, 0.0, 0.0)] * 2))
    held = fallback_plans(toy(x0, horizon=20), 0, short, 1.0)[0]
    assert np.linalg.norm(held.x[0, -1, VX : VZ + 1]) < 0.1
    assert np.abs(held.x[0, -1, [PHI, THETA]]).max() < 0.02


def test_the_backup_of_others_is_no_plan_of_a_uas_that_has_none():
    x0 = state((60.0, 60.0, -10.0))
    problem = toy(x0, state((60.0, 90.0, -10.0)), horizon=4)
    of_a = plan_of(flown(S500, x0, [(0.0, 0.0, 0.0)] * 4))
    assert len(fallback_plans(problem, 0, of_a, 1.0)) == 2
    assert len(fallback_plans(problem, 1, of_a, 1.0)) == 1


def test_there_is_none_where_braking_would_lean_too_far_from_each_step():
    limits = S500.limits
    plan = plan_of(flown(S500, state((60.0, 60.0, -10.0)), [(6.0, 0.0, 0.0)] * 2))
    problem = toy(plan.x[0, 0], horizon=2)
    assert backup_trajectory(problem, plan, 1.0) is not None
    plan.x[0, 1:, PHI], plan.x[0, 1:, WX] = 0.9 * limits.tilt_max_rad, 0.9 * limits.rate_max_radps
    assert first_trouble(problem, plan) is None, "what the plan itself flies is clear"
    assert backup_trajectory(problem, plan, 1.0) is None

"""Out of the way of what comes, without a solver: the shortest clear flight, or the least harm."""

import dataclasses

import numpy as np
import pytest
from toy_problems import S500, box, moving, state, toy
from uas_coverage_baselines.margins import Margins
from uas_coverage_baselines.milp_mpc.fallback import evasion as evasive_flights
from uas_coverage_baselines.milp_mpc.fallback.evasion import Asked, evasion
from uas_coverage_baselines.milp_mpc.model.norm_bounds import exceeds_limits
from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble

from uas_coverage_env import load_vehicle
from uas_coverage_env.planning.backup.braking import brake
from uas_coverage_env.vehicle import compile_vehicle
from uas_coverage_env.vehicle.layout import THETA, VX, VZ, WY

HERE = (100.0, 100.0, -20.0)
STEPS = 24  # 10 s of a direction, and braking
CLEARANCE_M = 2.0


def coming(*paths, at=((HERE),), radius_m=4.0, half_height_m=30.0, **fields):
    """UAS that hover while something comes: paths are (place now, velocity)."""
    bodies = [
        moving(np.add(place, np.outer(np.arange(3), velocity)), radius_m, half_height_m, f"m{k}")
        for k, (place, velocity) in enumerate(paths)
    ]
    return toy(
        *(state(place) for place in at),
        moving_obstacles=bodies,
        moving_clearance_m=CLEARANCE_M,
        **fields,
    )


def prolonged_to(problem, plan):
    """The decision with what moves predicted as far as the plan reaches."""
    n = np.arange(plan.u.shape[1] + 1)[:, None]
    longer = [
        dataclasses.replace(m, position_m=m.position_m[0] + n * (m.position_m[1] - m.position_m[0]))
        for m in problem.moving
    ]
    return dataclasses.replace(problem, moving=tuple(longer))


def is_clear(problem, plan):
    return first_trouble(prolonged_to(problem, plan), plan) is None


FROM_THE_WEST = (100.0, 40.0, -20.0), (0.0, 6.0, 0.0)


def test_a_uas_gets_out_of_the_way_and_brakes():
    problem = coming(FROM_THE_WEST)
    plan = evasion(problem, 1.0)
    assert plan.u.shape == (1, STEPS, 5)
    assert is_clear(problem, plan)
    assert np.linalg.norm(plan.x[0, -1, VX : VZ + 1]) < 0.1
    assert np.linalg.norm(plan.x[0, -1, :3] - HERE) < 16.0, "no farther than it has to"
    assert not plan.covers.any()
    assert (plan.objective, plan.bound) == (0.0, -np.inf), "it is no answer of a program"


@pytest.mark.parametrize(("dt_s", "steps"), [(0.5, 48), (0.8, 30)])
def test_a_flight_out_of_the_way_takes_as_long_at_every_step(dt_s, steps):
    place, velocity = FROM_THE_WEST
    problem = coming((place, dt_s * np.array(velocity)), dt_s=dt_s)
    plan = evasion(problem, dt_s)
    assert plan.u.shape == (1, steps, 5)
    assert is_clear(problem, plan)
    assert np.linalg.norm(plan.x[0, -1, VX : VZ + 1]) < 0.1


def test_where_braking_is_clear_there_is_nothing_to_evade():
    beside = (100.0 + 4.0 + CLEARANCE_M, 40.0, -20.0), (0.0, 6.0, 0.0)
    just = [np.add(beside[0], (off_m, 0.0, 0.0)) for off_m in (0.01, -0.01)]
    assert evasion(coming((just[0], beside[1])), 1.0) is None
    assert evasion(coming((just[1], beside[1])), 1.0) is not None


def test_what_passes_above_or_below_is_no_harm():
    for up, clear in ((1, True), (-1, True)):
        height_m = 3.0 + CLEARANCE_M + 0.1
        passing = np.add(FROM_THE_WEST[0], (0.0, 0.0, up * height_m)), FROM_THE_WEST[1]
        assert (evasion(coming(passing, half_height_m=3.0), 1.0) is None) == clear
        touching = np.add(passing[0], (0.0, 0.0, -up * 0.2)), passing[1]
        assert evasion(coming(touching, half_height_m=3.0), 1.0) is not None


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_uas_beside_a_wall_goes_the_other_way(side):
    wall = box(
        (100.0 + side * 3.0 if side > 0 else 90.0, 60.0, -49.0),
        (110.0 if side > 0 else 97.0, 140.0, 0.0),
    )
    problem = coming(FROM_THE_WEST, obstacles=[wall], clearance_m=1.5)
    plan = evasion(problem, 1.0)
    assert is_clear(problem, plan)
    assert side * (plan.x[0, -1, 0] - 100.0) < -3.0


def test_a_uas_at_the_fence_stays_within_its_margin():
    north, at = box((0.0, 0.0, -50.0), (103.0, 200.0, 0.0)), HERE
    problem = coming(FROM_THE_WEST, at=(at,), fence=north, fence_margin_m=2.0)
    plan = evasion(problem, 1.0)
    assert is_clear(problem, plan)
    assert plan.x[0, -1, 0] < 97.0


@pytest.mark.parametrize(("margin_m", "moves"), [(1.49, False), (1.51, True)])
def test_a_uas_within_the_fence_s_margin_leaves_it(margin_m, moves):
    fence = box((0.0, 0.0, -50.0), (101.5, 200.0, 0.0))
    plan = evasion(toy(state(HERE), fence=fence, fence_margin_m=margin_m), 1.0)
    assert (plan is not None) == moves
    assert plan is None or plan.x[0, -1, 0] < 99.99


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_a_uas_gets_over_or_under_what_is_wide(up):
    place = np.add(HERE, (0.0, -150.0, 2.0 * up))  # z is down
    problem = coming((place, (0.0, 9.0, 0.0)), radius_m=70.0, half_height_m=3.0)
    plan = evasion(problem, 1.0)
    assert is_clear(problem, plan)
    assert up * (plan.x[0, -1, 2] - HERE[2]) < -2.5
    assert np.abs(plan.x[0, -1, :2] - HERE[:2]).max() < 0.1


def test_a_uas_does_not_go_down_below_the_least_height():
    low = (100.0, 100.0, -8.0)
    flat = np.add(low, (0.0, -60.0, -3.0)), (0.0, 6.0, 0.0)  # comes above its middle
    known = {"at": (low,), "half_height_m": 4.0, "radius_m": 40.0}
    free = coming(flat, **known)
    down = evasion(free, 1.0)
    assert is_clear(free, down)
    assert down.x[0, -1, 2] > -8.0, "down is the shorter way"
    bound = coming(flat, **known, min_height_m=8.0, home_m=[(10.0, 10.0, -1.0)])
    up = evasion(bound, 1.0)
    assert up.x[0, 1:, 2].max() <= -8.0 + 1e-3


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
def test_between_samples_nothing_passes_unseen(share):
    # 30 m in a step: it passes the UAS in the third, before and behind it at the samples
    fast = (100.0, 100.0 - 30.0 * (2.0 + share), -20.0), (0.0, 30.0, 0.0)
    plan = evasion(coming(fast, radius_m=1.0), 1.0)
    assert plan is not None
    away = plan.x[0, 2:4, :3] - HERE
    assert np.hypot(away[:, 0], away[:, 2]).min() > 2.0


def test_rounding_chooses_none_of_the_directions_that_are_as_good(monkeypatch):
    # all ways out at right angles to a thin obstacle's path are as short, but for the last digits
    problem = coming(FROM_THE_WEST, radius_m=1.0)
    flights, ends = evasive_flights._flights, set()
    for seed in range(4):
        noise = np.random.default_rng(seed)

        def rounded(*args, noise=noise):
            x, u = flights(*args)
            return x * (1.0 + 1e-14 * noise.standard_normal(x.shape)), u

        monkeypatch.setattr(evasive_flights, "_flights", rounded)
        ends.add(tuple(evasion(problem, 1.0).x[0, -1, :3].round(3)))
    assert len(ends) == 1


def test_where_no_flight_is_clear_the_one_that_comes_least_too_near_is_flown():
    wide = (100.0, 60.0, -20.0), (0.0, 9.0, 0.0)
    problem = coming(wide, radius_m=30.0)
    plan = evasion(problem, 1.0)
    assert not is_clear(problem, plan)

    def depth_m(path_m):
        k = np.arange(len(path_m))[:, None]
        level_m = np.hypot(*(path_m - (np.add(wide[0], k * wide[1])))[:, :2].T) - 30.0
        return np.maximum(CLEARANCE_M - level_m, 0.0)

    stays = np.tile(HERE, (STEPS + 1, 1))
    assert (depth_m(plan.x[0, :, :3]) ** 2).sum() < 0.6 * (depth_m(stays) ** 2).sum()


def test_of_two_uas_the_second_keeps_clear_of_the_way_of_the_first():
    apart_m = 7.0
    at = (HERE, (100.0 + apart_m, 100.0, -20.0))
    first = (np.add(HERE, (0.0, -60.0, 0.0)), (0.0, 6.0, 0.0))
    problem = coming(first, at=at, separation_m=6.0, radius_m=2.0)
    plan = evasion(problem, 1.0)
    assert is_clear(problem, plan)
    moved_m = np.linalg.norm(plan.x[:, -1, :3] - plan.x[:, 0, :3], axis=1)
    assert moved_m[0] > 2.0
    assert moved_m[1] < 0.1, "one that is not in the way stays"


def test_two_uas_in_the_way_of_one_thing_part_without_meeting():
    at = (HERE, (100.0, 108.0, -20.0))
    problem = coming(FROM_THE_WEST, at=at, separation_m=6.0)
    plan = evasion(problem, 1.0)
    assert is_clear(problem, plan)
    assert (np.linalg.norm(plan.x[:, -1, :2] - plan.x[:, 0, :2], axis=1) > 1.0).all()


def test_two_uas_that_are_too_near_part_though_nothing_moves():
    at = (HERE, (100.0, 104.0, -20.0))
    problem = coming(at=at, separation_m=6.0)
    plan = evasion(problem, 1.0)
    level_m = np.hypot(*(plan.x[0, :, :2] - plan.x[1, :, :2]).T)
    up_m = np.abs(plan.x[0, :, 2] - plan.x[1, :, 2])
    assert np.maximum(level_m, up_m)[-1] >= 6.0
    above = (HERE, (100.0, 100.0, -26.5))
    assert evasion(coming(at=above, separation_m=6.0), 1.0) is None


def test_a_uas_in_mid_manoeuvre_goes_on_with_its_backup_while_another_evades():
    problem = coming(FROM_THE_WEST, at=(HERE, np.add(HERE, (90.0, 0.0, 0.0))))
    # about to turn at full tilt: the inner loop cannot take over without going beyond its limits
    limits = problem.vehicles[1].limits
    x0 = problem.x0.copy()
    x0[1, [VX, THETA, WY]] = -0.9 * limits.v_xy_max_mps, limits.tilt_max_rad, limits.rate_max_radps
    problem = dataclasses.replace(problem, x0=x0)
    braking = evasion(problem, 1.0)
    assert exceeds_limits(problem.vehicles[1], problem.norm_bounds[1], braking.x[1, 1:])
    # what the decision before has planned for it levels out, and hovers then
    steps = 3
    x = np.repeat(x0[:, None], steps + 1, axis=1)
    x[:, 1:, [VX, THETA, WY]] = 0.0
    covers = np.zeros((2, steps, problem.n_scenario_waypoints), bool)
    backup = Plan(problem.names, x, np.zeros((2, steps, 5)), covers, 0.0, -np.inf)
    plan = evasion(problem, 1.0, backup)
    assert np.array_equal(plan.x[1, : steps + 1], x[1])
    assert np.linalg.norm(plan.x[0, -1, :3] - HERE) > CLEARANCE_M, "the other makes way"


def test_a_uas_in_mid_manoeuvre_levels_out_as_planned_before_it_gets_out_of_the_way():
    problem = coming(FROM_THE_WEST)
    limits = problem.vehicles[0].limits
    x0 = problem.x0.copy()
    x0[0, [THETA, WY]] = limits.tilt_max_rad, limits.rate_max_radps
    problem = dataclasses.replace(problem, x0=x0)
    steps = 3
    x = np.repeat(x0[:, None], steps + 1, axis=1)
    x[:, 1:, [THETA, WY]] = 0.0
    covers = np.zeros((1, steps, problem.n_scenario_waypoints), bool)
    backup = Plan(problem.names, x, np.zeros((1, steps, 5)), covers, 0.0, -np.inf)
    plan, vehicle, bounds = evasion(problem, 1.0, backup), S500, problem.norm_bounds[0]
    at_once = brake(compile_vehicle(vehicle, 1.0)[()], x0[0], STEPS)[0]
    assert exceeds_limits(vehicle, bounds, at_once)
    assert not exceeds_limits(vehicle, bounds, plan.x[0, 1:])
    assert np.array_equal(plan.x[0, :2], x[0, :2])
    assert is_clear(problem, plan)


def test_in_a_room_a_small_uas_moves_aside_no_longer_than_there_is_room():
    room = box((0.0, 3.7, -3.0), (4.0, 8.3, 0.0))  # two seconds at full speed lead into a wall
    person = moving(np.add((0.4, 6.0, -1.0), np.outer(np.arange(3), (0.2, 0.0, 0.0))), 0.25, 0.9)
    problem = toy(
        state((2.0, 6.0, -1.0)),
        vehicles=[load_vehicle("crazyflie")],
        moving_obstacles=[person],
        moving_clearance_m=0.4,
        fence=room,
        fence_margin_m=0.2,
        dt_s=0.2,
        planar=True,
    )
    plan = evasion(problem, 0.2)
    assert is_clear(problem, plan)
    assert not exceeds_limits(problem.vehicles[0], problem.norm_bounds[0], plan.x[0, 1:])
    assert np.linalg.norm(plan.x[0, -1, :2] - problem.x0[0, :2]) < 2.0


def in_a_corridor():
    """A small UAS between two thin walls, and a person who walks towards it."""
    walls = [box((x, -50.0, -3.0), (x + 0.15, 50.0, 0.0)) for x in (-1.1, 0.95)]
    person = moving(np.add((0.0, -2.0, -1.0), np.outer(np.arange(3), (0.0, 0.24, 0.0))), 0.25, 0.9)
    return toy(
        state((0.0, 0.0, -1.0)),
        vehicles=[load_vehicle("crazyflie")],
        obstacles=walls,
        clearance_m=0.18,
        moving_obstacles=[person],
        moving_clearance_m=0.97,
        fence=box((-50.0, -50.0, -5.0), (50.0, 50.0, 0.0)),
        dt_s=0.2,
        planar=True,
    )


def test_no_wall_is_flown_through_to_keep_more_than_what_is_asked_from_what_comes():
    problem = in_a_corridor()
    asked = Asked({"a": 0.07}, Margins(0.01, 0.6), 0.1)
    assert np.abs(evasion(problem, 0.2).x[0, :, 0]).max() > 0.95, "through it, for less to sum up"
    plan = evasion(problem, 0.2, asked=asked)
    assert np.abs(plan.x[0, :, 0]).max() < 0.95 - 0.07
    away_m = plan.x[0, :, :2] - np.outer(np.arange(len(plan.x[0])), (0.0, 0.24)) - (0.0, -2.0)
    assert np.hypot(*away_m.T).min() > 0.25 + 0.07

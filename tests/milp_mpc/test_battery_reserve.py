"""Plans end where the battery still suffices to come home."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from toy_problems import S500, box, feasible, flight, flown, state, toy, written
from uas_coverage_baselines.milp_mpc.fallback.backup import backup_trajectory
from uas_coverage_baselines.milp_mpc.model.blocks import BatteryReserve, Capabilities, Dynamics
from uas_coverage_baselines.milp_mpc.model.blocks.battery_reserve import (
    cost_per_s,
    short_s,
    straight_seconds_home,
)
from uas_coverage_baselines.milp_mpc.model.norm_bounds import NORMS
from uas_coverage_baselines.milp_mpc.model.ocp import formulate
from uas_coverage_baselines.milp_mpc.model.problem import Plan, WayHome
from uas_coverage_baselines.milp_mpc.model.problem_file import read_problems, write_problems
from uas_coverage_baselines.milp_mpc.solvers import SolverLimits
from uas_coverage_baselines.milp_mpc.solvers.highs import solve

from uas_coverage_env.geometry.round_shapes import inner_factor
from uas_coverage_env.planning.reserves import milp_braking_s
from uas_coverage_env.vehicle import compile_vehicle, load_vehicle
from uas_coverage_env.vehicle.layout import DOD
from uas_coverage_env.vehicle.range import dod_per_s, seconds_to_land

OPTIMAL = SolverLimits(relative_gap=1e-6, absolute_gap=1e-5)
SKY = box((-2000.0, -2000.0, -100.0), (2000.0, 2000.0, 0.0))
HOME = [(0.0, 0.0, -1.0)]


@cache
def away():
    """400 m from home and on the way on; not on import, for which nothing is compiled."""
    return flight(S500, state((400.0, 0.0, -20.0)), [(6.0, 0.0, 0.0)] * 4)[-1]


def with_seconds_to_spare(seconds, horizon=9, **fields):
    """A UAS 400 m from home that could fly on for so long, with its allowance, and be in time."""
    x0 = away().copy()
    x0[DOD] = 0.5
    problem = toy(x0, horizon=horizon, fence=SKY, home_m=HOME, dod_max=0.75, **fields)
    room = -short_s(problem, 0, x0)
    x0[DOD] += (room - seconds) * dod_per_s(S500, 0.75)
    return dataclasses.replace(problem, x0=x0[None])


def within_polygons(problem):
    """The S500 with limits of speed, tilt and tilt rate as the rows have them, all around."""
    inner = inner_factor(problem.limit_sides, 2)
    limits = {name: inner * getattr(S500.limits, name) for *_, name in NORMS}
    return S500.model_copy(update={"limits": S500.limits.model_copy(update=limits)})


def best(problem):
    milp, v = formulate(problem)
    return solve(milp.build(), OPTIMAL), milp, v


def test_the_rows_say_what_a_flight_comes_home_with():
    problem = with_seconds_to_spare(3.0)
    x, u = flown(S500, problem.x0[0], [(9.0, 2.0, -1.0)] * 9)
    milp, v = written(problem, Dynamics(), BatteryReserve())
    built, short = milp.build(), milp.columns("reserve.a.short")
    lower, upper = built.lower.copy(), built.upper.copy()
    lower[v.u[0]], upper[v.u[0]] = u - 1e-9, u + 1e-9
    least = solve(built, OPTIMAL, lower=lower, upper=upper)
    assert short_s(problem, 0, x[-1]) > 5.0
    assert least.values[short[0]] == pytest.approx(short_s(problem, 0, x[-1]), abs=1e-2)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(away=st.tuples(*[st.floats(-900.0, 900.0)] * 2, st.floats(-90.0, 30.0)))
def test_the_way_home_is_never_estimated_shorter_by_the_rows_than_by_the_modes(away):
    x = state(np.array(HOME[0]) + away, dod=0.3)
    problem = toy(x, fence=SKY, home_m=HOME)
    way_s = straight_seconds_home(S500, np.array(away))
    spent_s = (0.3 - 0.75) / dod_per_s(S500, 0.75)
    assert short_s(problem, 0, x, allowance=False) >= way_s + spent_s - 1e-6
    assert short_s(problem, 0, x, allowance=False) <= 1.1 * way_s + spent_s


@pytest.mark.parametrize("height_m", [0.0, 15.0, 40.0])
@pytest.mark.parametrize("vehicle", [S500, load_vehicle("hexacopter")])
def test_the_reserve_is_no_shorter_than_the_calibrated_way_home_from_a_hover(vehicle, height_m):
    record = compile_vehicle(vehicle, 1.0)[()]
    for way_m in np.arange(50.0, 800.0, 50.0):
        allowed_s = straight_seconds_home(vehicle, np.array([way_m, 0.0, -height_m]))
        allowed_s += milp_braking_s(vehicle, 1.0)
        assert allowed_s > seconds_to_land(record, way_m, 0.0, height_m, -np.inf, way_m, 0.0)


def test_behind_a_wall_the_reserve_is_that_of_the_way_round_it():
    corner_m, onward_s = np.array([400.0, 300.0, -20.0]), 40.0
    problem = with_seconds_to_spare(3.0)
    led = dataclasses.replace(problem, ways_home=(WayHome(corner_m, onward_s),))
    x, u = flown(S500, problem.x0[0], [(0.0, 9.0, 0.0)] * 9)
    moved = dataclasses.replace(problem, home_m=corner_m[None])
    assert short_s(led, 0, x[-1]) == pytest.approx(short_s(moved, 0, x[-1]) + onward_s)
    milp, v = written(led, Dynamics(), BatteryReserve())
    built, short = milp.build(), milp.columns("reserve.a.short")
    lower, upper = built.lower.copy(), built.upper.copy()
    lower[v.u[0]], upper[v.u[0]] = u - 1e-9, u + 1e-9
    least = solve(built, OPTIMAL, lower=lower, upper=upper)
    assert least.values[short[0]] == pytest.approx(max(short_s(led, 0, x[-1]), 0.0), abs=1e-2)


def test_a_way_home_is_written_to_a_file_and_read_back(tmp_path):
    led = dataclasses.replace(
        with_seconds_to_spare(3.0), ways_home=(WayHome(np.array([400.0, 300.0, -20.0]), 40.0),)
    )
    write_problems(tmp_path / "led.json", "a test", [led], [7])
    (way,) = read_problems(tmp_path / "led.json")[7].ways_home
    assert way.corner_m.tolist() == [400.0, 300.0, -20.0]
    assert way.onward_s == 40.0


def test_a_battery_that_suffices_whatever_is_flown_needs_no_rows():
    assert written(with_seconds_to_spare(60.0), BatteryReserve())[0].build().row_lower.size == 0
    assert written(with_seconds_to_spare(5.0), BatteryReserve())[0].build().row_lower.size > 0


def test_no_waypoint_is_worth_coming_home_late():
    beyond = [((480.0, 0.0, -20.0), 12.0, 5.0)]
    enough, scarce = (with_seconds_to_spare(s, waypoints=beyond) for s in (60.0, 8.0))
    for problem, covered in ((enough, True), (scarce, False)):
        solution, _, v = best(problem)
        x = solution.values[v.x[0]]
        covers = solution.values[v.covers[v.covers >= 0]]
        assert (covers > 0.5).any() == covered
        assert short_s(problem, 0, x[-1]) <= 1e-3


@pytest.mark.parametrize("spare_s", [10.0, 1.0, 0.0, -5.0, -200.0])
def test_the_reserve_makes_no_decision_impossible(spare_s):
    problem = with_seconds_to_spare(spare_s)
    assert best(problem)[0].values is not None


commands = st.lists(
    st.tuples(st.floats(-12.0, 12.0), st.floats(-12.0, 12.0), st.floats(-3.0, 1.5)),
    min_size=5,
    max_size=5,
)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(spare_s=st.floats(-300.0, 40.0), commands=commands)
def test_whatever_the_battery_gives_satisfies_the_rows_with_some_shortage(spare_s, commands):
    problem = with_seconds_to_spare(spare_s, horizon=5)
    x, u = flown(within_polygons(problem), problem.x0[0], commands)
    to_cutoff = S500.battery.dod_cutoff - x[-1, DOD]
    assume(abs(to_cutoff) > 1e-6)
    for blocks in ((Dynamics(), Capabilities()), (Dynamics(), Capabilities(), BatteryReserve())):
        milp, v = written(problem, *blocks)
        # an empty battery ends the flight with the reserve's rows and without them
        assert feasible(milp, [(v.u[0, :, :4], u[:, :4])]) == (to_cutoff > 0.0)


def test_a_uas_that_is_too_late_flies_home():
    problem = with_seconds_to_spare(-30.0)
    solution, _, v = best(problem)
    x = solution.values[v.x[0]]
    assert x[-1, 0] < problem.x0[0, 0] - 20.0
    assert short_s(problem, 0, x[-1]) < 30.0


def test_a_shortage_costs_more_than_everything_that_can_be_covered():
    waypoints = [((450.0 + 20.0 * k, 0.0, -20.0), 9.0, 3.0) for k in range(4)]
    problem = with_seconds_to_spare(5.0, waypoints=waypoints)
    assert cost_per_s(problem) > 4 * 3.0 * problem.horizon


def planned(problem, commands):
    x, u = flown(S500, problem.x0[0], commands)
    return Plan(("a",), x[None], u[None], np.zeros((1, len(u), 0), bool), 0.0, -np.inf)


def test_a_backup_trajectory_turns_back_while_there_is_charge_to_come_home():
    problem = with_seconds_to_spare(6.0)
    plan = planned(problem, [(12.0, 0.0, 0.0)] * 9)
    out = backup_trajectory(problem, plan, 1.0)
    assert short_s(problem, 0, out.x[0, -1], allowance=False) <= 0.0
    assert out.x[0, -1, DOD] <= 0.75
    assert np.abs(out.x[0, 9, :3] - plan.x[0, 9, :3]).max() > 1.0
    enough = with_seconds_to_spare(100.0)
    followed = backup_trajectory(enough, planned(enough, [(12.0, 0.0, 0.0)] * 9), 1.0)
    assert followed.x[0, 9, 0] == pytest.approx(plan.x[0, 9, 0], abs=0.5)


def test_a_uas_that_is_too_late_is_not_kept_from_flying():
    problem = with_seconds_to_spare(-60.0)
    assert backup_trajectory(problem, planned(problem, [(-10.0, 0.0, 0.0)] * 9), 1.0) is not None

"""A decision as a whole: restricted programs, teams of plans, the joint program."""

import dataclasses
import time

import numpy as np
import pytest
from toy_problems import (
    BY_NODES,
    S500,
    box,
    flight,
    flown,
    objective_of,
    planned,
    state,
    toy,
    two_around_a_tower,
)
from uas_coverage_baselines.milp_mpc.fallback.backup import backup_trajectory
from uas_coverage_baselines.milp_mpc.fallback.plans import fallback_plans
from uas_coverage_baselines.milp_mpc.fallback.reasons import Reason
from uas_coverage_baselines.milp_mpc.model.ocp import formulate
from uas_coverage_baselines.milp_mpc.model.problem import NEVER, Plan
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble
from uas_coverage_baselines.milp_mpc.search import team_search
from uas_coverage_baselines.milp_mpc.search.decision import Effort, decide
from uas_coverage_baselines.milp_mpc.search.heuristic import construct
from uas_coverage_baselines.milp_mpc.search.restricted import NARROW, WIDE, RestrictedMilp
from uas_coverage_baselines.milp_mpc.search.trajectories import PlannedTrajectory, teams
from uas_coverage_baselines.milp_mpc.solvers import SolverLimits
from uas_coverage_baselines.milp_mpc.solvers.highs import solve
from uas_coverage_baselines.milp_mpc.solvers.interface import SolveStatus

from uas_coverage_env.geometry import sphere_faces
from uas_coverage_env.vehicle.layout import PHI, THETA, VX, WY

BY_TEAM = dataclasses.replace(BY_NODES, joint=None)
THOROUGH = Effort(work=20.0, teams=4)
OPTIMAL = SolverLimits(relative_gap=1e-6, absolute_gap=1e-5)


@pytest.fixture(scope="module")
def best(problem):
    solution = solve(formulate(problem)[0].build(), OPTIMAL)
    assert solution.status is SolveStatus.OPTIMAL
    return solution


def test_a_team_of_plans_is_a_point_of_the_whole_program_with_the_objective_it_says(
    problem, by_nodes
):
    assert first_trouble(problem, by_nodes) is None
    assert by_nodes.covers.any()
    assert objective_of(problem, by_nodes) == pytest.approx(by_nodes.objective, abs=2e-3)


def test_a_waypoint_is_covered_once_by_a_team(by_nodes):
    assert (by_nodes.covers.sum(axis=(0, 1)) <= 1).all()


def test_no_decision_is_better_than_the_best_one_and_no_bound_above_it(problem, by_nodes, best):
    thorough = planned(decide(problem, None, 1.0, THOROUGH))
    assert by_nodes.objective >= best.objective - 1e-3
    assert best.objective - 1e-3 <= thorough.objective <= by_nodes.objective + 1e-3
    assert thorough.bound <= best.objective + 1e-3
    assert by_nodes.bound <= best.objective + 1e-3
    assert first_trouble(problem, thorough) is None


def test_a_deterministic_decision_has_the_bound_of_the_joint_program(problem, by_nodes, best):
    assert np.isfinite(by_nodes.bound)
    assert by_nodes.bound <= best.objective + 1e-3
    without = planned(decide(problem, None, 1.0, BY_TEAM))
    assert without.relative_gap() is None
    assert by_nodes.objective <= without.objective + 1e-6


def test_no_gap_is_told_where_the_joint_program_was_not_solved(problem):
    waiting = dataclasses.replace(BY_NODES, at_once=1)
    assert planned(decide(problem, None, 1.0, waiting)).relative_gap() is None
    little = dataclasses.replace(BY_NODES, work=0.05)
    assert planned(decide(problem, None, 1.0, little)).relative_gap() is None


def test_the_joint_program_is_written_in_the_tightest_form(problem, monkeypatch):
    first = []

    class Noted(RestrictedMilp):
        def __init__(self, problem, blocks, **form):
            super().__init__(problem, blocks, **form)
            first.append((problem.n_uas, form.get("first")))

    monkeypatch.setattr(team_search, "RestrictedMilp", Noted)
    decide(problem, None, 1.0, BY_NODES)
    assert first == [(1, None), (1, None), (2, "clique")]


def test_one_uas_with_work_enough_gets_its_best_plan():
    problem = two_around_a_tower(n_uas=1)
    plan = planned(decide(problem, None, 1.0, THOROUGH))
    best = solve(formulate(problem)[0].build(), OPTIMAL)
    assert plan.objective == pytest.approx(best.objective, abs=0.02)
    assert plan.relative_gap() < 0.01


def test_a_decision_that_cannot_be_made_says_that_there_is_no_plan():
    start = state((60.0, 60.0, -10.0), (11.5, 0.0, 0.0))
    wall = box((75.0, 0.0, -49.0), (120.0, 200.0, 0.0))
    problem = toy(start, horizon=6, obstacles=[wall])
    assert decide(problem, None, 1.0, BY_NODES) is Reason.NO_PLAN
    assert decide(problem, None, 1.0, THOROUGH) is Reason.NO_PLAN


def test_a_plan_is_found_by_nodes_even_where_every_flight_to_a_waypoint_is_blocked():
    wall = box((60.0, 40.0, -20.0), (80.0, 80.0, 0.0))
    problem = toy(
        state((30.0, 60.0, -1.0)),
        horizon=12,
        obstacles=[wall],
        clearance_m=2.6,
        waypoints=[((59.9, 60.0, -6.0), 5.0)],
    )
    assert solve(formulate(problem)[0].build(), SolverLimits()).values is not None
    assert isinstance(decide(problem, None, 1.0, BY_NODES), Plan)


def test_several_uas_get_plans_by_nodes_where_every_flight_is_blocked():
    wall = box((60.0, 40.0, -20.0), (80.0, 130.0, 0.0))
    problem = toy(
        state((30.0, 60.0, -1.0)),
        state((30.0, 110.0, -1.0)),
        horizon=12,
        obstacles=[wall],
        clearance_m=2.6,
        waypoints=[((59.9, 60.0, -6.0), 5.0), ((59.9, 110.0, -6.0), 5.0)],
    )
    for uas in range(2):
        assert all((one.visit == NEVER).all() for one in construct(problem, uas, 1.0))
    plan = planned(decide(problem, None, 1.0, BY_NODES))
    assert first_trouble(problem, plan) is None


def test_a_decision_whose_time_is_over_when_it_begins_says_so(problem):
    late = time.perf_counter() - 10.0
    assert decide(problem, None, 1.0, Effort(time_limit_s=1.0), began=late) is Reason.NO_TIME


@pytest.fixture
def nothing_for_b(monkeypatch):
    """No program gives the second UAS a plan."""
    refined = team_search.TeamSearch._refined

    def for_a_alone(search, uas, *rest):
        return refined(search, uas, *rest) if uas == 0 else None

    monkeypatch.setattr(team_search.TeamSearch, "_refined", for_a_alone)


def test_a_uas_that_gets_no_plan_brakes_and_the_others_fly_on(problem, nothing_for_b):
    plan = planned(decide(problem, None, 1.0, BY_TEAM))
    assert first_trouble(problem, plan) is None
    assert plan.covers[0].any()
    assert not plan.covers[1].any()
    braking = fallback_plans(problem, 1, None, 1.0)[-1]
    assert plan.x[1] == pytest.approx(braking.x[0])


def test_a_uas_that_gets_no_plan_flies_the_rest_of_its_backup(problem, by_nodes, nothing_for_b):
    out = backup_trajectory(problem, by_nodes, 1.0)
    # of b alone: with one of a, which plan is the cheaper one depends on the solver's
    of_b = {key: getattr(out, key)[1:] for key in ("names", "x", "u", "covers")}
    backup = dataclasses.replace(out, **of_b)
    plan = planned(decide(problem, None, 1.0, BY_TEAM, backup=backup))
    assert plan.x[1] == pytest.approx(out.x[1, :8])
    assert first_trouble(problem, plan) is None


def test_where_no_team_holds_a_uas_may_leave_its_fallback_plan(problem, by_nodes, monkeypatch):
    monkeypatch.setattr(team_search, "teams", lambda problem, pools, keep: [])
    search = team_search.TeamSearch(problem, BY_NODES, time.perf_counter())
    search.prepare(range(2))
    for uas in range(2):
        alone = dataclasses.replace(
            by_nodes,
            names=by_nodes.names[uas : uas + 1],
            **{key: getattr(by_nodes, key)[uas : uas + 1] for key in ("x", "u", "covers")},
        )
        search.collect(uas, [alone])
    search.combine([fallback_plans(problem, uas, None, 1.0) for uas in range(2)])
    assert planned(search.outcome).x == pytest.approx(by_nodes.x)


def test_a_plan_beyond_the_tilt_limit_is_left_out_where_there_is_something_else(problem):
    # in the middle of a planned change of attitude (town 3009 at 7 s, planned for by guided)
    x0 = problem.x0.copy()
    x0[0, VX : WY + 1] = 5.295, 6.958, 0.0, 0.317, -0.297, 0.0, 0.209, -0.259
    turning = dataclasses.replace(problem, x0=x0, limit_sides=64)
    (braking,) = fallback_plans(turning, 0, None, 1.0)
    limit_rad = problem.vehicles[0].limits.tilt_max_rad
    tilt = np.hypot(braking.x[..., PHI], braking.x[..., THETA])
    assert 0.95 * limit_rad < tilt.max() <= 1.01 * limit_rad
    x = braking.x.copy()
    x[..., PHI : THETA + 1] *= 1.2
    beyond = dataclasses.replace(braking, x=x)
    search = team_search.TeamSearch(turning, BY_NODES, time.perf_counter())
    assert search.safe(0, [braking, beyond]) == [braking]
    assert search.safe(0, [beyond]) == [beyond]


@pytest.mark.parametrize("uas", [0, 1])
def test_a_fallback_plan_has_the_objective_it_says(problem, uas):
    alone = problem.only(uas)
    (plan,) = fallback_plans(problem, uas, None, 1.0)
    assert first_trouble(alone, plan) is None
    assert objective_of(alone, plan) == pytest.approx(plan.objective, abs=2e-3)


def test_the_rest_of_a_backup_is_a_plan_with_the_objective_it_says(problem, by_nodes):
    out = backup_trajectory(problem, by_nodes, 1.0)
    plan, _ = fallback_plans(problem, 0, out, 1.0)
    assert plan.covers.tolist() == by_nodes.covers[:1].tolist()
    assert objective_of(problem.only(0), plan) == pytest.approx(plan.objective, abs=2e-3)


def test_what_is_left_of_the_last_plan_can_be_flown_on(problem, by_nodes):
    moved = toy(
        *by_nodes.x[:, 1],
        horizon=7,
        obstacles=[hull for _, hull in problem.obstacles],
        waypoints=[
            (place, 2.0 * reach, weight)
            for place, reach, weight in zip(
                problem.waypoints_m,
                problem.waypoint_reach_m,
                problem.waypoint_weight,
                strict=True,
            )
        ],
        targets=problem.targets,
    )
    plan = planned(decide(moved, by_nodes.advanced(), 1.0, Effort(teams=1)))
    assert first_trouble(moved, plan) is None
    # what was planned is planned still, and one step more of the horizon is gained
    assert plan.covers.any(axis=(0, 1)).sum() >= by_nodes.advanced().covers.any(axis=(0, 1)).sum()


def test_a_previous_plan_of_other_uas_does_no_harm(problem, by_nodes):
    alone = problem.only(1)
    plan = planned(decide(alone, by_nodes, 1.0, BY_NODES))
    assert plan.names == ("b",)
    assert first_trouble(alone, plan) is None


def visits(problem, plan):
    covers = plan.covers[:, :, problem.waypoint_index]
    return np.where(covers.any(axis=1), covers.argmax(axis=1), NEVER)


def test_the_bounds_near_a_plan_leave_that_plan_possible(problem, by_nodes):
    program = RestrictedMilp(problem)
    lower, upper = program.bounds_near(by_nodes.x[:, :, :3], visits(problem, by_nodes))
    assert (lower >= program.built.lower).all()
    assert (upper <= program.built.upper).all()
    assert (lower <= upper).all()
    solution = solve(program.built, OPTIMAL, lower=lower, upper=upper)
    assert solution.objective <= by_nodes.objective + 1e-3
    free = program.built.integer & (lower < upper)
    assert free.sum() < program.built.integer.sum()


def test_the_bounds_near_a_flight_through_a_tower_widen_until_there_is_a_way_around():
    start = flight(S500, state((80.0, 86.0, -12.0)), [(6.0, 0.0, 0.0)] * 3)[-1]
    problem = toy(start, horizon=9, obstacles=[box((112.0, 80.0, -25.0), (122.0, 92.0, 0.0))])
    through = flight(S500, start, [(9.0, 0.0, 0.0)] * 9)[None, :, :3]
    program, never = RestrictedMilp(problem), np.zeros((1, 0), np.int64)
    found = []
    for neighbourhood in (NARROW, WIDE):
        lower, upper = program.bounds_near(through, never, neighbourhood)
        found.append(solve(program.built, OPTIMAL, lower=lower, upper=upper).values is not None)
    assert found == [False, True]


def test_a_start_made_of_a_plan_can_be_completed_to_it(problem, by_nodes):
    program = RestrictedMilp(problem)
    columns, values = program.start(by_nodes.x[:, :, :3], visits(problem, by_nodes))
    assert set(values) <= {0.0, 1.0}
    lower, upper = program.built.lower.copy(), program.built.upper.copy()
    lower[columns] = upper[columns] = values
    assert program.built.integer[columns].all()
    solution = solve(program.built, OPTIMAL, lower=lower, upper=upper)
    assert solution.objective <= by_nodes.objective + 1e-3


def test_constructed_flights_start_here_cover_what_they_say_and_differ(problem):
    for uas in range(2):
        found = construct(problem, uas, 1.0)
        assert len({(f.visit < NEVER).tobytes() for f in found}) == len(found)
        for one in found:
            assert one.positions_m.shape == (8, 3)
            assert one.positions_m[0] == pytest.approx(problem.x0[uas, :3])
            away = np.abs(one.positions_m[:-1, None] - problem.waypoints_m).max(axis=2)
            inside = away <= problem.waypoint_reach_m
            first = np.where(inside.any(axis=0), inside.argmax(axis=0), NEVER)
            assert one.visit.tolist() == first.tolist()


def test_a_flight_with_nothing_to_do_at_rest_stays_where_it_is():
    (one,) = construct(toy(state((60.0, 60.0, -10.0)), horizon=8), 0, 1.0)
    assert np.abs(one.positions_m - one.positions_m[0]).max() < 1e-6


def test_a_flight_with_nothing_to_do_goes_straight_on():
    (one,) = construct(toy(state((60.0, 60.0, -10.0), (5.0, 0.0, 0.0)), horizon=8), 0, 1.0)
    assert one.positions_m[-1, 0] > 100.0
    assert np.abs(one.positions_m[:, 1:] - (60.0, -10.0)).max() < 0.5


@pytest.mark.parametrize("sides", [4, 8])
def test_flights_cover_within_the_waypoints_polyhedron_whatever_its_sides(sides):
    corner = ((85.0, 66.0, -10.0), 10.0)
    start = state((60.0, 60.0, -10.0), (8.0, 0.0, 0.0))
    problem = toy(start, horizon=8, waypoints=[corner], waypoint_sides=sides)
    covering = [one for one in construct(problem, 0, 1.0) if one.visit[0] < NEVER]
    assert covering
    for one in covering:
        out = ((one.positions_m - problem.waypoints_m[0]) @ sphere_faces(sides).T).max(axis=1)
        assert int((out <= problem.waypoint_reach_m[0]).argmax()) == one.visit[0]


def test_constructed_flights_can_be_flown(problem):
    reach = problem.reach.support(np.vstack([np.eye(3), -np.eye(3)]))
    for uas in range(2):
        for one in construct(problem, uas, 1.0):
            sides = np.hstack([one.positions_m, -one.positions_m])
            assert (sides <= reach[uas] + 1e-9).all()


def test_how_deep_a_flight_enters_a_keep_out_zone_is_said():
    start = state((60.0, 60.0, -10.0), (9.0, 0.0, 0.0))
    behind = [((95.0, 60.0, -10.0), 8.0)]
    wall = box((76.0, 40.0, -49.0), (80.0, 80.0, 0.0))
    free, walled = (
        construct(toy(start, horizon=6, waypoints=behind, obstacles=hulls), 0, 1.0)
        for hulls in ([], [wall])
    )
    assert max(one.too_close_m for one in free) == 0.0
    assert max(one.too_close_m for one in walled) > 0.5


def test_a_team_has_one_flight_of_each_uas(problem):
    pools = [construct(problem, uas, 1.0) for uas in range(2)]
    chosen = teams(problem, pools, keep=3)
    assert 1 <= len(chosen) <= 3
    for team in chosen:
        assert all(
            any(one is flight for flight in pool) for one, pool in zip(team, pools, strict=True)
        )


def test_a_uas_that_has_nothing_to_gain_flies_no_way_to_what_another_one_takes():
    starts = [state((60.0, 60.0, -10.0)), state((60.0, 35.0, -10.0))]
    problem = toy(*starts, horizon=9, waypoints=[((60.0, 72.0, -10.0), 8.0)])
    pools = [construct(problem, uas, 1.0) for uas in range(2)]
    assert any((one.visit < NEVER).any() for one in pools[1])
    first, second = teams(problem, pools, keep=1)[0]
    assert (first.visit < NEVER).all()
    assert second.length_m == min(one.length_m for one in pools[1])


def test_flights_that_come_too_close_make_no_good_team():
    starts = [state((60.0, 60.0, -10.0)), state((60.0, 72.0, -10.0))]
    problem = toy(*starts, horizon=4, separation_m=6.0)
    apart, together = (
        [_as_flight(flown(S500, x0, [(0.0, east, 0.0)] * 4)[0]) for east in (0.0, aside)]
        for x0, aside in zip(starts, (4.0, -4.0), strict=True)
    )
    best = teams(problem, [apart, together], keep=4)[0]
    distance = np.abs(best[0].positions_m - best[1].positions_m).max(axis=1)
    assert (distance >= 6.0).all()


def _as_flight(x):
    return PlannedTrajectory(x[:, :3], np.zeros(0, np.int64), 0.0, 0.0)


@pytest.mark.parametrize("sides", [0, 3, 6, 10])
def test_norms_are_limited_by_faces_that_a_quarter_turn_maps_onto_each_other(problem, sides):
    with pytest.raises(ValueError, match=f"physical_sides = {sides}: give a multiple of 4"):
        dataclasses.replace(problem, physical_sides=sides)

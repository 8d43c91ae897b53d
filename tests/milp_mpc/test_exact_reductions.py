"""Every formulation has the optimum of the paper's, on states taken from a flight.

The states come from `python benchmarks/planner.py states`.
"""

from dataclasses import asdict, fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy_problems import S500, TO_OPTIMALITY, box, flight, moving, state, toy
from uas_coverage_baselines.milp_mpc.model.blocks.coverage import coverable
from uas_coverage_baselines.milp_mpc.model.blocks.separation import from_obstacles
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import Target, TourSegment, WayHome, Weights
from uas_coverage_baselines.milp_mpc.model.problem_file import read_problems, write_problems
from uas_coverage_baselines.milp_mpc.model.reductions import FORMULATIONS
from uas_coverage_baselines.milp_mpc.model.reductions.bounds import rows_as_bounds
from uas_coverage_baselines.milp_mpc.model.reductions.elimination import (
    flown_states,
    motion_variables,
)
from uas_coverage_baselines.milp_mpc.model.reductions.lazy import solve_lazily
from uas_coverage_baselines.milp_mpc.model.reductions.travel import (
    cliques,
    exclusive,
    partition,
    steps_between,
)
from uas_coverage_baselines.milp_mpc.solvers.highs import solve
from uas_coverage_baselines.milp_mpc.solvers.interface import SolverLimits, SolveStatus

from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.vehicle import VehicleParams

FLOWN = read_problems(Path(__file__).parents[2] / "benchmarks" / "village_decisions.json")
CLOSED = SolverLimits(relative_gap=1e-6, absolute_gap=1e-5)
SAME = 5e-5
few = settings(max_examples=30, deadline=None, derandomize=True)


def smaller(problem, horizon, most):
    """The decision with a shorter horizon and the waypoints that are reached first."""
    moving = tuple(replace(m, position_m=m.position_m[: horizon + 1]) for m in problem.moving)
    problem = replace(problem, horizon=horizon, moving=moving)
    possible = coverable(problem).any(axis=0)
    first = np.where(possible.any(axis=0), possible.argmax(axis=0), horizon)
    kept = np.argsort(first, kind="stable")[:most]
    kept = kept[first[kept] < horizon]
    return replace(
        problem,
        waypoints_m=problem.waypoints_m[kept],
        waypoint_reach_m=problem.waypoint_reach_m[kept],
        waypoint_weight=problem.waypoint_weight[kept],
        waypoint_index=problem.waypoint_index[kept],
    )


def optima(problem):
    """Objective of each formulation, all solved to the end."""
    result = {}
    for name, formulation in FORMULATIONS.items():
        built, _ = formulation.build(problem)
        solution = solve(built, CLOSED)
        assert solution.status is SolveStatus.OPTIMAL, name
        result[name] = solution.objective
    return result


CASES = [(step, uas) for step, problem in FLOWN.items() for uas in range(problem.n_uas)]


@pytest.mark.parametrize(("step", "uas"), CASES[1::2])
def test_every_formulation_has_the_optimum_of_the_papers(step, uas):
    found = optima(smaller(FLOWN[step].only(uas), 8, 4))
    assert found == pytest.approx(dict.fromkeys(found, found["paper"]), abs=SAME)


def test_two_uas_together_have_the_optimum_of_the_papers():
    problem = smaller(FLOWN[0], 6, 1)
    between = problem.x0[:, :3].mean(axis=0) + np.array([0.0, 0.0, -12.0])
    problem = replace(
        problem,
        waypoints_m=between[None],
        waypoint_reach_m=np.array([7.5]),
        waypoint_weight=np.array([1.0]),
        waypoint_index=np.array([0]),
    )
    assert coverable(problem).any(axis=1).all()
    found = optima(problem)
    assert found == pytest.approx(dict.fromkeys(found, found["paper"]), abs=SAME)


def test_a_transit_target_counts_alike_with_and_without_coverage_states():
    problem = smaller(FLOWN[17].only(1), 8, 3)
    target = Target(problem.waypoints_m[0], 0.05, waypoint=0)
    found = optima(replace(problem, targets=(target,)))
    assert found == pytest.approx(dict.fromkeys(found, found["paper"]), abs=SAME)
    without = optima(replace(problem, targets=(replace(target, waypoint=None),)))
    assert without["paper"] > found["paper"] + 0.1


def test_waypoints_whose_boxes_overlap_are_not_taken_for_exclusive():
    start = state((50.0, 50.0, -10.0), (6.0, 0.0, 0.0))
    places = [
        ((62.0, 50.0, -10.0), 8.0),
        ((66.0, 52.0, -10.0), 8.0, 2.0),
        ((64.0, 50.0, -9.0), 8.0),
    ]
    problem = toy(start, horizon=5, waypoints=places)
    assert not exclusive(steps_between(problem)[0], 1).any()
    found = optima(problem)
    assert found == pytest.approx(dict.fromkeys(found, found["paper"]), abs=SAME)


def test_a_yaw_that_has_turned_keeps_its_columns_and_the_optimum():
    start = state((50.0, 50.0, -10.0), (6.0, 0.0, 0.0))
    start[8], start[11] = 0.05, -0.02
    problem = toy(start, horizon=4, waypoints=[((66.0, 52.0, -10.0), 8.0)])
    assert (motion_variables(Milp(), problem).x[0, :, 8] >= 0).all()
    found = optima(problem)
    assert found == pytest.approx(dict.fromkeys(found, found["paper"]), abs=SAME)


def test_a_nearly_empty_battery_limits_every_formulation_alike():
    start = state((50.0, 50.0, -10.0), (6.0, 0.0, 0.0), dod=S500.battery.dod_cutoff - 0.0031)
    target = Target(np.array([90.0, 90.0, -40.0]), 0.2)
    problem = toy(start, horizon=4, targets=[target], dod_max=2.0)
    found = optima(problem)
    assert found == pytest.approx(dict.fromkeys(found, found["paper"]), abs=SAME)
    fresh = optima(replace(problem, x0=np.where(problem.x0 == start[12], 0.1, problem.x0)))
    assert fresh["paper"] < found["paper"]


def test_a_tour_costs_alike_with_and_without_coverage_states():
    problem = smaller(FLOWN[17].only(1), 8, 3)
    following = problem.waypoints_m[0] + np.array([40.0, -20.0, 0.0])
    tour = TourSegment(
        waypoints=np.array([0]),
        aims_m=np.array([problem.waypoints_m[0], following]),
        radius_m=np.array([5.0, 5.0]),
        lead_s=0.5,
        onward_s=np.array([6.0]),
    )
    found = optima(replace(problem, tours=(tour,)))
    assert found == pytest.approx(dict.fromkeys(found, found["paper"]), abs=SAME)


def test_eliminated_states_follow_from_the_inputs():
    problem = smaller(FLOWN[35].only(0), 8, 3)
    whole, v = FORMULATIONS["visit"].build(problem)
    values = solve(whole, CLOSED).values
    assert flown_states(problem, values[v.u]) == pytest.approx(values[v.x], abs=1e-4)


@pytest.mark.parametrize("step", [17, 60])
def test_obstacles_added_lazily_give_the_same_optimum_from_fewer_rows(step):
    problem = smaller(FLOWN[step].only(1), 9, 4)
    whole = solve(FORMULATIONS["lift"].build(problem)[0], CLOSED)
    lazy = solve_lazily(problem, FORMULATIONS["lift"], lambda milp: solve(milp, CLOSED))
    assert lazy.solution.status is SolveStatus.OPTIMAL
    assert lazy.rounds > 1
    assert 0 < len(lazy.obstacles) < len(problem.obstacles)
    assert lazy.solution.objective == pytest.approx(whole.objective, abs=SAME)


def test_a_lazy_solve_says_when_it_did_not_find_a_flight():
    problem = smaller(FLOWN[17].only(1), 9, 4)
    nothing = SolverLimits(nodes=0, heuristics=False)
    lazy = solve_lazily(
        replace(problem, fence_margin_m=1e4), FORMULATIONS["lift"], lambda m: solve(m, nothing)
    )
    assert lazy.solution.values is None


commands = st.lists(
    st.tuples(*[st.floats(-14.0, 14.0).map(lambda v: round(v, 1))] * 2, st.floats(-4.0, 4.0)),
    min_size=12,
    max_size=12,
)


@few
@given(commands=commands, first=st.integers(0, 10), later=st.integers(1, 11), sides=st.just(4))
def test_no_flight_goes_from_one_waypoint_to_another_in_fewer_steps(commands, first, later, sides):
    path = flight(S500, state((0.0, 0.0, 0.0), (8.0, 3.0, 0.0)), commands)[:, :3]
    last = min(first + later, 12)
    # each box is touched at its corner that is nearest to the other: the hardest case
    turned = np.sign(path[last] - path[first])
    centres = path[first] - 2.99 * turned, path[last] + 2.99 * turned
    problem = toy(
        state((0.0, 0.0, 0.0), (8.0, 3.0, 0.0)),
        horizon=12,
        waypoints=[(centre, 6.0) for centre in centres],
        fence=box((-900.0, -900.0, -900.0), (900.0, 900.0, 900.0)),
    )
    assert steps_between(problem)[0, 0, 1] <= last - first
    turns = problem.reach.displacement(np.vstack([np.eye(3), -np.eye(3), [[0.6, 0.8, 0.3]]]))
    moved = (path[last] - path[first]) @ np.vstack([np.eye(3), -np.eye(3), [[0.6, 0.8, 0.3]]]).T
    assert (moved <= turns[0, last - first] + 1e-9).all()


def test_travel_times_are_not_silly_and_make_cliques():
    problem = FLOWN[17]
    steps = steps_between(problem)[0]
    away = np.abs(problem.waypoints_m[:, None] - problem.waypoints_m[None])
    reach = problem.waypoint_reach_m
    level = np.maximum(away[..., :2].max(axis=-1) - reach[:, None] - reach, 0.0)
    near = level < 12.0 * 14  # travel times end at the horizon
    assert (steps[near] >= np.floor(level[near] / 13.2) - 1).all()
    for samples in (3, 6):
        apart = exclusive(steps, samples)
        np.fill_diagonal(apart, True)
        groups, sets = partition(apart), cliques(exclusive(steps, samples), steps)
        assert (groups.sum(axis=0) == 1).all()
        assert sets.any(axis=0).all()
        for members in (*groups, *sets):
            assert apart[np.ix_(members, members)].all()


def test_rows_of_one_column_become_bounds_and_crossing_ones_stay():
    milp = Milp()
    x = milp.variables("x", (3,), lower=-1.0, upper=5.0)
    milp.subject_to("halved", ([[-2.0]], x[:1, None]), lower=-4.0)
    milp.subject_to("sum", (1.0, x), lower=1.0)
    milp.minimize([-1.0, 1.0, 2.0], x)
    whole = milp.build()
    bounded = rows_as_bounds(whole)
    assert len(bounded.row_lower) == 1
    assert bounded.upper.tolist() == [2.0, 5.0, 5.0]
    best = solve(whole, TO_OPTIMALITY).objective
    assert solve(bounded, TO_OPTIMALITY).objective == pytest.approx(best)
    milp.subject_to("crossing", (1.0, x[:1, None]), lower=7.0)
    assert rows_as_bounds(milp.build()).row_lower.tolist() == milp.build().row_lower.tolist()


def test_using_an_eliminated_column_is_an_error():
    problem = FLOWN[0].only(0)
    milp = Milp()
    v = motion_variables(milp, problem)
    with pytest.raises(ValueError, match="eliminated"):
        milp.subject_to("late", (1.0, v.uncovered[1:, :1]), upper=0.0)
    with pytest.raises(ValueError, match="eliminated"):
        milp.minimize(1.0, v.x[:, 1:, 12])


def test_a_decision_survives_its_file(tmp_path):
    problem = FLOWN[140]
    write_problems(tmp_path / "one.json", "a test", [problem], [7])
    again = read_problems(tmp_path / "one.json")[7]
    one, other = (FORMULATIONS["lift"].write(p)[0].lp_text() for p in (problem, again))
    assert one == other


def test_every_field_of_a_decision_survives_its_file(tmp_path):
    place = ((66.0, 52.0, -10.0), 8.0, 2.0)
    problem = toy(
        *(state((50.0, east, -10.0), (6.0, 0.0, 0.0), dod=0.2) for east in (50.0, 80.0)),
        horizon=3,
        obstacles=[box((80.0, 40.0, -20.0), (90.0, 60.0, 0.0))],
        moving_obstacles=[moving([(10.0, 10.0, -5.0)] * 4)],
        waypoints=[place, ((90.0, 20.0, -12.0), 6.0)],
        waypoint_sides=12,
        targets=[Target(np.array([80.0, 50.0, -5.0]), 0.2, 1), None],
        tours=(None, TourSegment(np.array([1]), np.eye(3)[:2], np.ones(2), 0.5, np.array([6.0]))),
        ways_home=(WayHome(np.array([60.0, 70.0, -9.0]), 12.0), None),
        weights=Weights(lift=0.3, return_home=1.0),
        dt_s=0.5,
        min_height_m=2.0,
        landing_zone_m=6.0,
        physical_sides=12,
        obstacle_sides=6,
        limit_sides=12,
        outer_limits=True,
        order=3,
        corners_of_all=False,
        data={"Radio": {"range_m": np.array([70.0, 90.0]), "station": np.array(2)}},
        prune=False,
        planar=True,
    )
    for one in fields(problem):
        default = one.default_factory() if callable(one.default_factory) else one.default
        same = plain(getattr(problem, one.name)) == plain(default)
        assert same is not True, f"{one.name} is looked at only where it is not the default"
    write_problems(tmp_path / "one.json", "a test", [problem], [0])
    again = read_problems(tmp_path / "one.json")[0]
    for one in fields(problem):
        np.testing.assert_equal(
            plain(getattr(again, one.name)), plain(getattr(problem, one.name)), one.name
        )


def plain(value):
    """Records as dictionaries, so that their arrays are compared value by value."""
    if isinstance(value, tuple | list):
        return [plain(one) for one in value]
    if isinstance(value, VehicleParams):
        return value.model_dump()
    if isinstance(value, ConvexPolytope):
        return [value.normals, value.offsets_m, value.vertices_m]
    return asdict(value) if is_dataclass(value) else value


def test_obstacles_out_of_reach_are_left_out_and_change_no_row():
    problem = smaller(FLOWN[17].only(0), 8, 3)
    x, y = problem.x0[0, :2]
    corners = [(x + 400.0 + 30.0 * row, y - 200.0 + 30.0 * row) for row in range(20)]
    far = tuple(
        (f"far_{row}", box((n, e, -20.0), (n + 10.0, e + 10.0, 0.0)))
        for row, (n, e) in enumerate(corners)
    )
    crowded = replace(
        problem,
        obstacles=problem.obstacles + far,
        obstacle_clearance_m=np.hstack([problem.obstacle_clearance_m, np.full((1, 20), 3.0)]),
    )
    met = {separation.name for separation in from_obstacles(crowded)}
    assert met <= {name for name, _ in problem.obstacles}
    rows = [FORMULATIONS["corner"].write(p)[0].lp_text() for p in (problem, crowded)]
    assert rows[0] == rows[1]
    everything = list(from_obstacles(replace(crowded, prune=False)))
    assert len(everything) == len(crowded.obstacles)

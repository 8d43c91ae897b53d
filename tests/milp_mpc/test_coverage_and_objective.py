"""What the plan counts as covered, and what the objective says of a flight."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from toy_problems import S500, TO_OPTIMALITY, feasible, flight, flown, state, toy, written
from uas_coverage_baselines.milp_mpc.model.blocks import Coverage, TargetDistance
from uas_coverage_baselines.milp_mpc.model.ocp import formulate
from uas_coverage_baselines.milp_mpc.model.problem import Target, Weights
from uas_coverage_baselines.milp_mpc.solvers.highs import solve

from uas_coverage_env.geometry import cylinder_faces, sphere_faces
from uas_coverage_env.geometry.round_shapes import inner_factor
from uas_coverage_env.vehicle import linear_model
from uas_coverage_env.vehicle.layout import DELTA_THRUST, DOD, LIFT, PSI, WX, WZ

MIDDLE = np.array([100.0, 100.0, -25.0])
FAR = state((5.0, 5.0, -5.0))
few = settings(max_examples=20, deadline=None, derandomize=True)


def coordinates(low, high):
    return st.floats(low, high, allow_nan=False).map(lambda value: round(value, 2))


def points(reach_m, height_m):
    return st.tuples(
        coordinates(-reach_m, reach_m),
        coordinates(-reach_m, reach_m),
        coordinates(-height_m, height_m),
    ).map(np.array)


def optimum(problem, *blocks, fixed):
    """Values and objective of the best point with columns fixed: pairs (columns, values)."""
    milp, v = written(problem, *blocks)
    built = milp.build()
    lower, upper = built.lower.copy(), built.upper.copy()
    for columns, values in fixed(v):
        lower[columns] = upper[columns] = values
    return solve(built, TO_OPTIMALITY, lower=lower, upper=upper), v


@few
@given(st.sampled_from([4, 8, 12]), coordinates(2.0, 20.0), st.lists(points(1.2, 1.2), min_size=4))
def test_the_plan_covers_exactly_from_the_inner_polyhedron_and_so_within_the_sphere(
    H, radius_m, places
):
    waypoints = [(MIDDLE, radius_m)]
    problem = toy(FAR, horizon=2, waypoints=waypoints, waypoint_sides=H, prune=False)
    milp, v = written(problem, Coverage())
    for away in radius_m * np.array(places):
        inside_m = float((sphere_faces(H) @ away).max()) - radius_m * inner_factor(H, 3)
        assume(abs(inside_m) > 1e-5)
        covered = [(v.position[0, 1], MIDDLE + away), (v.covers[0, 1, 0], 1.0)]
        if feasible(milp, covered):
            assert inside_m < 0.0
            assert np.linalg.norm(away) <= radius_m + 1e-6
        else:
            assert inside_m > 0.0
        assert feasible(milp, [(v.position[0, 1], MIDDLE + away), (v.covers[0, 1, 0], 0.0)])


waypoint_places = st.lists(
    st.tuples(points(25.0, 5.0), coordinates(4.0, 14.0), st.sampled_from([1.0, 2.5])),
    min_size=1,
    max_size=3,
)
command_lists = st.lists(points(14.0, 3.0), min_size=5, max_size=5)


@pytest.mark.parametrize("prune", [False, True])
@few
@given(places=waypoint_places, one=command_lists, other=command_lists)
def test_each_waypoint_counts_once_for_the_uas_that_is_there_first_and_stays_covered(
    prune, places, one, other
):
    starts = [state(MIDDLE, (6.0, 0.0, 0.0)), state(MIDDLE + np.array([30.0, 5.0, 4.0]))]
    paths = np.array(
        [
            flight(S500, x0, commands)[:, :3]
            for x0, commands in zip(starts, (one, other), strict=True)
        ]
    )
    waypoints = [(MIDDLE + away, radius_m, weight) for away, radius_m, weight in places]
    problem = toy(*starts, horizon=5, waypoints=waypoints, prune=prune)
    away = np.abs(paths[:, :-1, None, :] - problem.waypoints_m).max(axis=-1)
    assume((np.abs(away - problem.waypoint_reach_m) > 1e-5).all())
    inside = (away < problem.waypoint_reach_m).any(axis=0)
    first = np.where(inside.any(axis=0), inside.argmax(axis=0), 5)
    by_hand = -float((problem.waypoint_weight * (5 - first)).sum())
    solution, v = optimum(problem, Coverage(), fixed=lambda v: [(v.position[:, 1:], paths[:, 1:])])
    assert solution.objective == pytest.approx(by_hand, abs=1e-6)
    uncovered = solution.values[v.uncovered]
    assert (np.diff(uncovered, axis=0) <= 1e-9).all()
    assert set(uncovered.round(9).ravel()) <= {0.0, 1.0}
    times = np.where(v.covers >= 0, solution.values[v.covers], 0.0).sum(axis=(0, 1))
    assert times == pytest.approx((first < 5).astype(float), abs=1e-9)


def test_a_waypoint_that_both_uas_are_in_is_counted_once():
    starts = [state(MIDDLE), state(MIDDLE + np.array([2.0, 0.0, 0.0]))]
    problem = toy(*starts, horizon=2, waypoints=[(MIDDLE, 20.0)])
    milp, v = written(problem, Coverage())
    assert feasible(milp, [(v.covers[:, :, 0], [[0, 1], [0, 0]])])
    assert not feasible(milp, [(v.covers[:, :, 0], [[0, 1], [0, 1]])])
    assert not feasible(milp, [(v.covers[:, :, 0], [[1, 1], [0, 0]])])


def norm8(pairs):
    """(...) eight-sided norm of vectors (..., 2)."""
    return (pairs @ cylinder_faces(8)[:, :2].T).max(axis=-1)


@pytest.mark.parametrize("waypoint", [None, 0])
def test_the_objective_of_a_flight_is_the_sum_that_the_paper_writes(waypoint):
    start = state(MIDDLE, dod=0.1)
    commands = [(6.0, 2.0, -1.0)] * 3 + [(6.0, -4.0, 0.5)] * 3
    x, u = flown(S500, start, commands)
    place = x[3, :3]
    target = Target(place, 0.03, waypoint)
    problem = toy(start, horizon=6, waypoints=[(place, 2.0, 3.0)], targets=[target])
    milp, v = formulate(problem)
    built = milp.build()
    lower, upper = built.lower.copy(), built.upper.copy()
    lower[v.x[0]], lower[v.u[0]] = x, u
    upper[v.x[0]], upper[v.u[0]] = x, u
    solution = solve(built, TO_OPTIMALITY, lower=lower, upper=upper)

    w, limits, torque = Weights(), S500.limits, np.array(S500.torque_max_Nm)
    spent = (x[1:, DOD] - start[DOD]) / linear_model(S500, 0.1).E[DOD] - np.arange(1, 7)
    first_part = (
        w.lift * np.abs(u[:, LIFT]).sum() / limits.lift_max_N
        + w.torque * (np.abs(u[:, 1:4]) / torque).sum()
        + w.rate * np.abs(x[1:, WX:WZ]).sum() / limits.rate_max_radps
        + w.rate * np.abs(x[1:, WZ]).sum() / limits.yaw_rate_max_radps
        + w.yaw * np.abs(x[1:, PSI]).sum() / limits.yaw_max_rad
        + w.energy * spent.sum()
    )
    away = x[1:, :3] - place
    distance = np.maximum(norm8(away[:, :2]), np.abs(away[:, 2]))
    open_at = np.arange(1, 7) <= 3  # covered at n = 3, so Phi(n) = 0 from n = 4 on
    second_part = 0.03 * distance[open_at if waypoint == 0 else slice(None)].sum()
    third_part = 3.0 * (open_at.sum() - 6)
    assert solution.objective == pytest.approx(first_part + second_part + third_part, abs=1e-5)
    assert solution.values[v.covers[0, 3, 0]] == 1.0
    assert u[:, DELTA_THRUST].max() < limits.delta_thrust_max_N


def test_covering_the_target_waypoint_makes_the_distance_to_it_free():
    start = state(MIDDLE)
    target = Target(MIDDLE + np.array([40.0, 0.0, 0.0]), 0.01, waypoint=0)
    problem = toy(start, horizon=3, waypoints=[(MIDDLE, 20.0)], targets=[target], prune=False)

    def distances(phi):
        solution, _ = optimum(
            problem,
            TargetDistance(),
            fixed=lambda v: [
                (v.position[:, 1:], np.tile(MIDDLE, (1, 3, 1))),
                (v.uncovered[1:, 0], phi),
            ],
        )
        return solution.objective / 0.01

    assert distances([1.0, 1.0, 1.0]) == pytest.approx(120.0)
    assert distances([1.0, 0.0, 0.0]) == pytest.approx(40.0)
    assert distances([0.0, 0.0, 0.0]) == pytest.approx(0.0, abs=1e-9)

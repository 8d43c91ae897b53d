"""Plans stay within the vehicle's limits, which hold for every planner in the world."""

import numpy as np
import pytest
from toy_problems import S500, TO_OPTIMALITY, flown, state, toy, written
from uas_coverage_baselines.milp_mpc.model.blocks import Capabilities, Dynamics
from uas_coverage_baselines.milp_mpc.model.norm_bounds import NORMS
from uas_coverage_baselines.milp_mpc.solvers.highs import solve

from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.geometry.round_shapes import inner_factor

OPEN_SKY = ConvexPolytope.from_points(
    [(x, y, z) for x in (-1e3, 1e3) for y in (-1e3, 1e3) for z in (-1e3, 1e3)]
)
START = state((0.0, 0.0, 0.0), (3.0, 1.0, 0.0))


def flights_by_motion(problem):
    """Dynamics and limits alone, without a cost."""
    milp, v = written(problem, Dynamics(), Capabilities())
    built = milp.build()
    built.cost[:] = 0.0
    return built, v


def largest_norm(built, pair):
    """The largest norm of two columns that some feasible plan has, by looking in 32 directions."""
    largest = 0.0
    for angle in 2.0 * np.pi * np.arange(32) / 32:
        built.cost[:] = 0.0
        built.cost[pair] = -np.cos(angle), -np.sin(angle)
        values = solve(built, TO_OPTIMALITY).values
        largest = max(largest, float(np.hypot(*values[pair])))
    return largest


@pytest.mark.parametrize(("name", "first", "second", "limit"), NORMS)
def test_no_plan_exceeds_a_limit_whatever_it_is_made_for(name, first, second, limit):
    most = getattr(S500.limits, limit)
    problem = toy(START, horizon=8, fence=OPEN_SKY)
    built, v = flights_by_motion(problem)
    found = largest_norm(built, v.x[0, 8, [first, second]])
    assert found <= most * (1.0 + 1e-6)
    assert found > 0.98 * most, name


def test_more_sides_lose_less_of_the_speed():
    slowest = []
    for sides in (4, 8, 16, 32):
        problem = toy(START, horizon=12, fence=OPEN_SKY, limit_sides=sides)
        built, v = flights_by_motion(problem)
        built.cost[v.x[0, 12, 3]] = -1.0  # north is the middle of a face, the slowest direction
        slowest.append(solve(built, TO_OPTIMALITY).values[v.x[0, 12, 3]])
    np.testing.assert_allclose(slowest, 12.0 * np.cos(np.pi / np.array([4, 8, 16, 32])), rtol=1e-6)


def beyond_the_polygons():
    """States that the world allows, or the nonlinear plant reaches, outside of a plan's bounds."""
    along_a_face = state((0.0, 0.0, 0.0), (12.0, 0.0, 0.0))
    along_a_face[7] = -S500.trim_tilt_rad_per_mps * 12.0
    overshot = state((0.0, 0.0, 0.0), (9.0, 9.3, -1.0))
    overshot[6:8] = 0.2, -0.36
    commands = np.array([[12.0, 0.0, 0.0]] * 6 + [[0.0, 0.0, 0.0]])
    just_braking = flown(S500, state((0.0, 0.0, 0.0)), commands)[0][-1]
    return {"along a face": along_a_face, "overshot": overshot, "braking": just_braking}


@pytest.mark.parametrize("name", beyond_the_polygons())
def test_a_uas_outside_of_its_bounds_is_planned_for_and_comes_back_inside(name):
    start = beyond_the_polygons()[name]
    problem = toy(start, horizon=12, fence=OPEN_SKY)
    built, v = flights_by_motion(problem)
    values = solve(built, TO_OPTIMALITY).values
    assert values is not None
    x = values[v.x[0]]
    for _, first, second, limit in NORMS:
        most = getattr(S500.limits, limit)
        first_norm, last_norm = np.hypot(x[[0, 12], first], x[[0, 12], second])
        assert last_norm <= most * (1.0 + 1e-6)
        assert np.hypot(x[1:, first], x[1:, second]).max() <= max(first_norm, most) * 1.03


@pytest.mark.parametrize("share", [0.0, 12.0 * inner_factor(16, 2) / np.hypot(9.0, 9.3)])
def test_flights_of_the_inner_loop_are_plans_of_a_uas_outside_of_its_bounds(share):
    start = beyond_the_polygons()["overshot"]
    problem = toy(start, horizon=12, fence=OPEN_SKY)
    velocity = share * 9.0, share * 9.3, -1.0 * (share > 0.0)
    _, inputs = flown(S500, start, [velocity] * 12)
    built, v = flights_by_motion(problem)
    lower, upper = built.lower.copy(), built.upper.copy()
    columns = v.u[0][:, :4]
    lower[columns], upper[columns] = inputs[:, :4] - 1e-9, inputs[:, :4] + 1e-9
    assert solve(built, TO_OPTIMALITY, lower=lower, upper=upper).values is not None

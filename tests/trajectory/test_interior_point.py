import numpy as np
import pytest
from scipy.optimize import minimize
from uas_coverage_baselines.trajectory.flight_model import (
    NORMS,
    POSITION,
    VELOCITY,
    flight_model,
)
from uas_coverage_baselines.trajectory.interior_point import solve
from uas_coverage_baselines.trajectory.riccati import Factors, factor, newton_step
from uas_coverage_baselines.trajectory.rows import SoftRows

from uas_coverage_env.vehicle import compile_vehicle, load_vehicle, vehicle_names


def model_of(name="s500_v2", dt_s=1.0):
    return flight_model(compile_vehicle(load_vehicle(name), dt_s)[()])


@pytest.fixture(scope="module")
def model():
    return model_of()


def goal_rows(steps, goal_m, radius_m=2.0, *planes):
    """Be near a place, slowly, at the last step; planes are (stage, normal, bound)."""
    n = len(planes)
    return SoftRows(
        np.array([steps, steps, *(stage for stage, _, _ in planes)], np.int64),
        np.array([True, True] + [False] * n),
        np.array([POSITION, VELOCITY] + [POSITION] * n),
        np.array([goal_m, np.zeros(3), *(normal for _, normal, _ in planes)], float),
        np.array([radius_m, 0.4, *(bound for _, _, bound in planes)]),
        np.array([1.0, 4.0] + [2.0] * n),
    )


def solved(model, rows, steps, start=None, complementarity=1e-8):
    x = np.zeros((steps + 1, 10))
    x[0] = np.zeros(10) if start is None else start
    return solve(model, rows, x, np.zeros((steps, 3)), complementarity=complementarity)


def reference(model, rows, steps, start):
    """The optimal cost by SLSQP in the inputs and violations alone, the dynamics eliminated."""
    n_u = 3 * steps

    def states(u):
        x = [start]
        for row in u.reshape(steps, 3):
            x.append(model.A @ x[-1] + model.B @ row)
        return np.array(x)

    def limits(z):
        x = states(z[:n_u])
        norms = model.norms**2 - np.array([(x[1:, pair] ** 2).sum(axis=1) for pair in NORMS]).T
        vertical = [x[1:, 9] + model.vertical[0], model.vertical[1] - x[1:, 9]]
        return np.concatenate([norms.ravel() / model.norms[0], *vertical])

    def soft(z):
        x, excess, values = states(z[:n_u]), z[n_u:], []
        for k, stage in enumerate(rows.stage):
            at = x[stage, rows.states[k]]
            if rows.ball[k]:
                value = np.sum((at - rows.vector[k]) ** 2) - rows.bound[k] ** 2
                values.append(excess[k] - 0.5 * value / rows.bound[k])
            else:
                values.append(excess[k] - rows.vector[k] @ at + rows.bound[k])
        return np.array(values)

    bounds = [*zip(model.input_low, model.input_high, strict=True)] * steps
    bounds += [(0.0, None)] * len(rows.stage)
    weight = np.concatenate([np.tile(model.input_weight, steps), np.zeros(len(rows.stage))])
    price = np.concatenate([np.zeros(n_u), rows.weight])
    found = minimize(  # pyrefly: ignore[no-matching-overload]  # constraints may be arrays
        lambda z: 0.5 * np.sum(weight * z**2) + price @ z,
        np.concatenate([np.zeros(n_u), np.full(len(rows.stage), 50.0)]),
        jac=lambda z: weight * z + price,
        bounds=bounds,
        constraints=[{"type": "ineq", "fun": limits}, {"type": "ineq", "fun": soft}],
        method="SLSQP",
        options={"maxiter": 500, "ftol": 1e-9},
    )
    assert found.success
    return found.fun


@pytest.mark.parametrize(
    ("steps", "goal_m"), [(6, [8.0, 5.0, -4.0]), (5, [12.0, -9.0, -6.0]), (4, [60.0, 10.0, -9.0])]
)
def test_its_optimum_is_that_of_a_dense_reference_solver(model, steps, goal_m):
    """Reached exactly, just reached, and out of reach."""
    rows = goal_rows(steps, goal_m, 2.0, (2, [1.0, 0.0, 0.0], 1.0))
    solution = solved(model, rows, steps)
    assert solution.converged
    # violations of balls are priced by (|y|² - b²) / 2b in the program
    at = solution.x[rows.stage[:, None], rows.states]
    away = at - rows.vector
    priced = solution.violation.copy()
    for k in np.flatnonzero(rows.ball):
        value = 0.5 * (away[k] @ away[k] - rows.bound[k] ** 2) / rows.bound[k]
        priced[k] = max(value, 0.0)
    cost = 0.5 * np.sum(model.input_weight * solution.u**2) + rows.weight @ priced
    assert cost == pytest.approx(reference(model, rows, steps, np.zeros(10)), rel=2e-4, abs=2e-6)


@pytest.mark.parametrize("name", vehicle_names())
@pytest.mark.parametrize("dt_s", [0.5, 1.0])
def test_no_limit_of_any_vehicle_is_exceeded(name, dt_s):
    model = model_of(name, dt_s)
    rng = np.random.default_rng(5)
    for steps in (8, 25, 60):
        reach_m = model.norms[0] * dt_s * steps
        goal_m = rng.uniform(-1.0, 1.0, 3) * [reach_m, reach_m, 0.2 * reach_m]
        solution = solved(model, goal_rows(steps, goal_m), steps, complementarity=3e-6)
        assert solution.converged
        x, u = solution.x[1:], solution.u
        for pair, limit in zip(NORMS, model.norms, strict=True):
            assert np.hypot(x[:, pair[0]], x[:, pair[1]]).max() <= limit + 1e-4
        assert x[:, 9].max() <= model.vertical[1] + 1e-4
        assert -x[:, 9].min() <= model.vertical[0] + 1e-4
        assert (u >= model.input_low - 1e-4).all()
        assert (u <= model.input_high + 1e-4).all()


def test_its_states_follow_from_its_inputs(model):
    solution = solved(model, goal_rows(30, [100.0, 50.0, -20.0]), 30)
    following = solution.x[:-1] @ model.A.T + solution.u @ model.B.T
    np.testing.assert_allclose(following, solution.x[1:], atol=1e-4)


def test_costates_are_what_a_change_of_the_start_costs(model):
    """The derivative of the optimal cost, by differences."""
    steps, rows = 8, goal_rows(8, [90.0, 30.0, -9.0])
    at_rest = solved(model, rows, steps)

    def cost(solution):
        away = solution.x[rows.stage[0], POSITION] - rows.vector[0]
        position = 0.5 * (away @ away - rows.bound[0] ** 2) / rows.bound[0]
        speed = solution.x[-1, VELOCITY]
        slow = 0.5 * (speed @ speed - rows.bound[1] ** 2) / rows.bound[1]
        inputs = 0.5 * np.sum(model.input_weight * solution.u**2)
        return inputs + max(position, 0.0) + 4.0 * max(slow, 0.0)

    for state in (0, 1, 4, 8):
        start = np.zeros(10)
        start[state] = 1e-3
        change = (cost(solved(model, rows, steps, start)) - cost(at_rest)) / 1e-3
        expected = (model.A.T @ at_rest.costate[0])[state]
        assert change == pytest.approx(expected, rel=2e-2, abs=1e-3)


def test_what_cannot_be_reached_is_reached_as_nearly_as_possible(model):
    near = solved(model, goal_rows(10, [50.0, 0.0, -5.0]), 10)
    far = solved(model, goal_rows(10, [500.0, 0.0, -5.0]), 10)
    assert near.violation.max() < 1e-3
    assert 380.0 < far.violation[0] < 498.0
    assert far.converged


def test_the_first_steps_may_exceed_limits_by_as_much_as_they_are_loosened(model):
    start = np.zeros(10)
    start[VELOCITY[0]] = 1.2 * model.norms[0]
    x = np.zeros((13, 10))
    x[0] = start
    loose = np.ones(13)
    loose[1:6] = np.linspace(1.2, 1.0, 5)
    found = solve(model, goal_rows(12, [60.0, 0.0, 0.0]), x, np.zeros((12, 3)), loose=loose)
    assert found.converged
    assert (np.abs(found.x[1:, 1]) <= loose[1:] * model.norms[0] + 1e-3).all()


def test_a_newton_step_solves_the_dense_system_of_its_optimality_conditions(model):
    rng = np.random.default_rng(1)
    N, n_x, n_u = 4, 10, 3
    Q = np.zeros((N + 1, n_x, n_x))
    for n in range(1, N + 1):
        root = rng.normal(size=(n_x, n_x))
        Q[n] = root @ root.T
    R = rng.uniform(0.5, 2.0, (N, n_u))
    q, r, d = rng.normal(size=(N + 1, n_x)), rng.normal(size=(N, n_u)), rng.normal(size=(N, n_x))
    factors = Factors(np.zeros((N + 1, n_x, n_x)), np.zeros((N, n_u, n_x)), np.zeros((N, n_u, n_u)))
    dx, du, costate = np.zeros((N + 1, n_x)), np.zeros((N, n_u)), np.zeros((N, n_x))
    factor(model.A, model.B, Q, R, factors)
    newton_step(model.A, model.B, factors, q, r, d, dx, du, costate)
    for n in range(N):
        following = model.A @ dx[n] + model.B @ du[n] + d[n]
        np.testing.assert_allclose(dx[n + 1], following, rtol=1e-8, atol=1e-8)
        inputs = R[n] * du[n] + r[n] + model.B.T @ costate[n]
        np.testing.assert_allclose(inputs, 0.0, atol=1e-6)
        onward = model.A.T @ costate[n + 1] if n + 1 < N else 0.0
        np.testing.assert_allclose(
            Q[n + 1] @ dx[n + 1] + q[n + 1] + onward, costate[n], rtol=1e-6, atol=1e-6
        )

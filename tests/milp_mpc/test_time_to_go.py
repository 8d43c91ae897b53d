"""The terminal cost of `order=search`: in the program, in plain arithmetic, in every form."""

from dataclasses import replace

import numpy as np
import pytest
from golden_lp import compare, readable
from toy_problems import FIELD, S500, TO_OPTIMALITY, state, toy, written
from uas_coverage_baselines.milp_mpc.model.blocks.time_to_go import TimeToGo
from uas_coverage_baselines.milp_mpc.model.problem import TourSegment, Trajectories
from uas_coverage_baselines.milp_mpc.model.reductions import FORMULATIONS
from uas_coverage_baselines.milp_mpc.solvers.highs import solve

NORTHBOUND = state((50.0, 50.0, -10.0), (8.0, 0.0, 0.0))
PLACES = [((62.0, 52.0, -10.0), 6.0), ((80.0, 56.0, -12.0), 6.0), ((100.0, 60.0, -10.0), 6.0)]
HOME = (20.0, 90.0, -10.0)
N = 4


def with_tour(horizon=N, count=3, lead_s=1.0, **fields):
    """Toy places one after the other, then home."""
    places = np.array([place for place, _ in PLACES[:count]])
    tour = TourSegment(
        np.arange(count),
        np.vstack([places, HOME]),
        np.array([3.0] * count + [0.0]),
        lead_s,
        np.linspace(2.0, 7.0, count),
    )
    made = toy(NORTHBOUND, horizon=horizon, waypoints=PLACES[:count], tours=(tour,), **fields)
    return made, tour


def path(seed):
    """(N+1, 3) positions of some flight, from where the toy begins."""
    steps = np.random.default_rng(seed).uniform(-8.0, 8.0, (N, 3)) * (1.0, 1.0, 0.3)
    return np.vstack([np.zeros(3), steps.cumsum(axis=0)]) + NORTHBOUND[:3]


def time_to_go(problem, positions, visits):
    """The block's cost of a flight, in closed form."""
    flights = Trajectories(positions[None], np.array([visits]))
    return TimeToGo().cost_along(problem, 0, flights)[0]


def cost_in_program(problem, positions, visits):
    """The smallest cost with the flight and its visits given; None where they are not allowed."""
    milp, v = written(problem, TimeToGo())
    built = milp.build()
    lower, upper = built.lower.copy(), built.upper.copy()
    covers = np.zeros((N, problem.n_waypoints))
    for w, step in enumerate(visits):
        covers[step : step + 1, w] = 1.0
    given = [
        (v.position[0, -1], positions[-1]),
        (v.velocity[0, -1], (positions[-1] - positions[-2]) / problem.dt_s),
        (v.covers[0], covers),
        (v.uncovered[-1], 1.0 - covers.max(axis=0)),
    ]
    for columns, values in given:
        lower[columns] = upper[columns] = values
    solution = solve(built, TO_OPTIMALITY, lower=lower, upper=upper)
    return None if solution.values is None else solution.objective


@pytest.mark.parametrize("visits", [(N, N, N), (0, N, N), (1, 2, N), (0, 1, 3)])
@pytest.mark.parametrize("seed", range(4))
def test_the_program_and_the_arithmetic_give_a_flight_the_same_cost(seed, visits):
    problem, _ = with_tour(prune=False)
    positions = path(seed)
    counted = time_to_go(problem, positions, visits)
    assert cost_in_program(problem, positions, visits) == pytest.approx(counted, abs=1e-6)


@pytest.mark.parametrize("visited", range(4))
def test_only_the_next_aim_counts(visited):
    problem, tour = with_tour(lead_s=0.0)
    positions = path(5)
    visits = np.where(np.arange(3) < visited, np.arange(3), N)
    cost = time_to_go(problem, positions, visits)
    away = tour.aims_m[visited] - positions[-1]
    turns = np.arange(8) * np.pi / 4
    limits = S500.limits
    level = (away[0] * np.cos(turns) + away[1] * np.sin(turns)).max() - tour.radius_m[visited]
    up = (-away[2] - tour.radius_m[visited]) / limits.v_up_max_mps
    down = (away[2] - tour.radius_m[visited]) / limits.v_down_max_mps
    flying = max(level / limits.v_xy_max_mps, up, down, 0.0)
    assert cost == pytest.approx(flying + tour.onward_s[visited:].sum(), rel=0.02)


def test_a_visit_out_of_order_counts_for_nothing():
    problem, _ = with_tour(prune=False)
    positions = path(0)
    none, second, both = (
        time_to_go(problem, positions, visits) for visits in ((N, N, N), (N, 1, N), (0, 1, N))
    )
    assert second == none
    assert both != none
    assert cost_in_program(problem, positions, (N, 1, N)) is None
    assert cost_in_program(problem, positions, (2, 1, N)) is None


@pytest.mark.parametrize("count", [1, 2, 3])
def test_every_form_of_the_program_has_the_same_optimum_along_a_tour(count):
    problem, _ = with_tour(horizon=5, count=count, fence=FIELD)
    limits = replace(TO_OPTIMALITY, relative_gap=1e-6, absolute_gap=1e-5)
    found = {
        name: solve(FORMULATIONS[name].build(problem)[0], limits).objective
        for name in ("corner", "clique", "lift")
    }
    assert np.isfinite(found["corner"])
    assert found == pytest.approx(dict.fromkeys(found, found["corner"]), abs=5e-5)


def test_the_rows_of_the_terminal_cost(request):
    problem, _ = with_tour(horizon=2, count=2, prune=False)
    milp, _ = written(problem, TimeToGo())
    heading = """
        Time to go along a tour, faces of eq. (const_Vec_ub): the distance to the next aim, in
        seconds, from where the UAS is one second after the horizon; what follows it as a cost of
        Phi(N); and visits in order.
    """
    compare(request, "time_to_go", readable(milp, heading))

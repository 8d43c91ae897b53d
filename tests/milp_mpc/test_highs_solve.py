"""The solver's word counts only after our own arithmetic has confirmed it."""

import numpy as np
import pytest
from toy_problems import S500, TO_OPTIMALITY, box, flight, state, toy
from uas_coverage_baselines.milp_mpc import highs
from uas_coverage_baselines.milp_mpc.highs import TOLERANCE, SolverLimits, SolveStatus, solve
from uas_coverage_baselines.milp_mpc.milp import Milp
from uas_coverage_baselines.milp_mpc.ocp import formulate


def knapsack():
    """max 5a + 4b + 3c with 2a + 3b + c <= 4, binaries: a and c, worth 8; b alone 4."""
    milp = Milp()
    take = milp.variables("take", (3,), lower=0.0, upper=1.0, integer=True)
    milp.subject_to("room", (np.array([2.0, 3.0, 1.0]), take), upper=4.0)
    milp.minimize([-5.0, -4.0, -3.0], take)
    milp.add_constant(1.0)
    return milp.build()


def split_evenly(n_rows=3, n_columns=24):
    """Numbers to be split into halves of equal sums: easy to say, hard to solve or refute."""
    draw = np.random.default_rng(7)
    milp = Milp()
    left = milp.variables("left", (n_columns,), lower=0.0, upper=1.0, integer=True)
    numbers = draw.integers(0, 100, (n_rows, n_columns)).astype(float)
    half = np.floor(numbers.sum(axis=1) / 2)
    milp.subject_to("sum", (numbers, left), lower=half, upper=half)
    milp.minimize(draw.uniform(0.0, 1.0, n_columns), left)
    return milp.build()


def decision(horizon=6):
    """A real decision with some branching in it."""
    start = flight(S500, state((95.0, 100.0, -15.0)), [(6.0, 1.0, 0.0)] * 2)[-1]
    place = start[:3]
    problem = toy(
        start,
        horizon=horizon,
        obstacles=[box(place + np.array([16.0, -4.0, -20.0]), place + np.array([22.0, 5.0, 15.0]))],
        waypoints=[(place + away, 9.0) for away in ((22.0, 3.0, 0.0), (12.0, 14.0, -3.0))],
    )
    return formulate(problem)[0].build()


def test_an_optimal_solution_is_returned_with_its_objective_and_bound():
    solution = solve(knapsack(), TO_OPTIMALITY)
    assert solution.status is SolveStatus.OPTIMAL
    assert solution.values.tolist() == [1.0, 0.0, 1.0]
    assert solution.objective == pytest.approx(-7.0)
    assert solution.bound == pytest.approx(-7.0)
    assert solution.violation <= TOLERANCE


def test_a_program_without_whole_numbers_is_solved_as_well():
    milp = Milp()
    x = milp.variables("x", (2,), lower=0.0)
    milp.subject_to("sum", (1.0, x), lower=2.0)
    milp.minimize([1.0, 3.0], x)
    solution = solve(milp.build(), SolverLimits())
    assert solution.status is SolveStatus.OPTIMAL
    assert solution.values == pytest.approx([2.0, 0.0])
    assert solution.bound == pytest.approx(2.0)


@pytest.mark.parametrize("integer", [True, False])
def test_an_infeasible_program_has_a_status_and_no_values(integer):
    milp = Milp()
    x = milp.variables("x", (2,), lower=0.0, upper=1.0, integer=integer)
    milp.subject_to("sum", (1.0, x), lower=3.0)
    milp.minimize(1.0, x)
    solution = solve(milp.build(), SolverLimits())
    assert solution.status is SolveStatus.INFEASIBLE
    assert solution.values is None
    assert solution.objective == np.inf


def test_an_unbounded_program_is_never_called_solved():
    milp = Milp()
    milp.minimize(-1.0, milp.variables("x", (1,), lower=0.0))
    solution = solve(milp.build(), SolverLimits())
    assert solution.status in (SolveStatus.FEASIBLE, SolveStatus.NO_SOLUTION)
    assert solution.bound == -np.inf


@pytest.mark.parametrize(
    "limits",
    [
        SolverLimits(time_s=0.0),
        SolverLimits(time_s=0.01),
        SolverLimits(nodes=0),
        SolverLimits(nodes=1),
    ],
)
def test_limits_end_a_solve_with_a_status_and_no_exception(limits):
    program = split_evenly()
    solution = solve(program, limits)
    if solution.values is None:
        assert solution.status is SolveStatus.NO_SOLUTION
        assert solution.objective == np.inf
    else:
        assert solution.status in (SolveStatus.FEASIBLE, SolveStatus.OPTIMAL)
        assert program.violation(solution.values) <= TOLERANCE


def test_a_solve_that_ends_early_says_how_far_it_is_from_proven():
    solution = solve(decision(), SolverLimits(nodes=1))
    best = solve(decision(), TO_OPTIMALITY)
    assert best.status is SolveStatus.OPTIMAL
    assert solution.bound <= best.objective + 1e-6
    assert solution.objective >= best.objective - 1e-6
    assert best.bound == pytest.approx(best.objective, abs=1e-5)


def test_the_values_of_a_decision_keep_every_row_by_our_own_arithmetic():
    program = decision()
    solution = solve(program, SolverLimits(nodes=20))
    assert program.violation(solution.values) <= TOLERANCE
    assert solution.violation == program.violation(solution.values)
    assert (solution.values[program.integer] % 1.0 == 0.0).all()
    assert solution.objective == program.objective(solution.values)


@pytest.mark.parametrize("size", [1e-5, 0.2, np.nan])
def test_a_solution_that_breaks_a_row_is_rejected_whatever_the_solver_says(monkeypatch, size):
    class Liar(highs.highspy.Highs):
        def getSolution(self):
            solution = super().getSolution()
            solution.col_value = [value - size for value in solution.col_value]
            return solution

    milp = Milp()
    x = milp.variables("x", (2,), lower=0.0, upper=5.0)
    milp.subject_to("sum", (1.0, x), lower=3.0)
    milp.minimize([1.0, 2.0], x)
    assert solve(milp.build(), SolverLimits()).status is SolveStatus.OPTIMAL
    monkeypatch.setattr(highs.highspy, "Highs", Liar)
    solution = solve(milp.build(), SolverLimits())
    assert solution.status is SolveStatus.NO_SOLUTION
    assert solution.values is None
    assert solution.violation > TOLERANCE


def test_bounds_can_be_replaced_and_are_kept_exactly():
    program = knapsack()
    upper = program.upper.copy()
    upper[0] = 0.0
    solution = solve(program, TO_OPTIMALITY, upper=upper)
    assert solution.values.tolist() == [0.0, 1.0, 1.0]
    lower = np.array([0.0, 1.0, 0.0])
    solution = solve(program, TO_OPTIMALITY, lower=lower)
    assert solution.values.tolist() == [0.0, 1.0, 1.0]
    assert program.lower.tolist() == [0.0, 0.0, 0.0]


def test_a_start_is_completed_and_a_foolish_one_does_no_harm():
    program = knapsack()
    good = (np.array([0, 2]), np.array([1.0, 1.0]))
    foolish = (np.array([0, 1, 2]), np.array([1.0, 1.0, 1.0]))
    for start in (good, foolish):
        assert solve(program, TO_OPTIMALITY, start=start).objective == pytest.approx(-7.0)


def test_a_start_is_what_a_solve_without_nodes_returns_at_least():
    program = decision()
    best = solve(program, TO_OPTIMALITY)
    whole = np.flatnonzero(program.integer)
    again = solve(program, SolverLimits(nodes=0), start=(whole, best.values[whole]))
    assert again.objective <= best.objective + 1e-5


@pytest.mark.parametrize("heuristics", [True, False])
def test_the_same_nodes_give_the_same_values_bit_by_bit(heuristics):
    limits = SolverLimits(nodes=3, heuristics=heuristics)
    first, second = (solve(decision(8), limits) for _ in range(2))
    assert first.values is not None
    assert first.values.tobytes() == second.values.tobytes()
    assert (first.objective, first.bound) == (second.objective, second.bound)

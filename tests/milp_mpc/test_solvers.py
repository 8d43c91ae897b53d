"""Every solver gives the same answers, and its word counts only after our own arithmetic."""

import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec

import numpy as np
import pytest
from toy_problems import S500, TO_OPTIMALITY, box, flight, planned, state, toy
from uas_coverage_baselines.milp_mpc import solvers
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.ocp import formulate
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble
from uas_coverage_baselines.milp_mpc.search.decision import Effort, decide
from uas_coverage_baselines.milp_mpc.solvers import SOLVERS, SolverLimits, interface, solver_named
from uas_coverage_baselines.milp_mpc.solvers.interface import TOLERANCE, SolverError, SolveStatus

from uas_coverage_env import InputError
from uas_coverage_env.cli import main
from uas_coverage_env.flight.loop import recorded_versions

PACKAGES = {"highs": "highspy", "scip": "pyscipopt", "gurobi": "gurobipy"}


@pytest.fixture(params=SOLVERS)
def name(request):
    return request.param


@pytest.fixture
def solve(name):
    return solver_named(name)


def knapsack():
    """max 5a + 4b + 3c with 2a + 3b + c <= 4, binaries: a and c, worth 8; b alone 4."""
    milp = Milp()
    take = milp.variables("take", (3,), lower=0.0, upper=1.0, integer=True)
    milp.subject_to("room", (np.array([2.0, 3.0, 1.0]), take), upper=4.0)
    milp.minimize([-5.0, -4.0, -3.0], take)
    milp.add_constant(1.0)
    return milp.build()


def split_evenly(n_rows=3, n_columns=24, choice=None):
    """Numbers to be split into halves of equal sums: easy to say, hard to solve or refute.

    With a choice (n_columns,) the sums are those of the chosen numbers, so that it is a solution.
    """
    draw = np.random.default_rng(7)
    milp = Milp()
    left = milp.variables("left", (n_columns,), lower=0.0, upper=1.0, integer=True)
    numbers = draw.integers(0, 100, (n_rows, n_columns)).astype(float)
    sums = np.floor(numbers.sum(axis=1) / 2) if choice is None else numbers @ choice
    milp.subject_to("sum", (numbers, left), lower=sums, upper=sums)
    milp.minimize(draw.uniform(0.0, 1.0, n_columns), left)
    return milp.build()


def decision(horizon=6):
    """The program of `turn`."""
    return formulate(turn(horizon))[0].build()


def turn(horizon=6):
    """A real decision with some branching in it."""
    start = flight(S500, state((95.0, 100.0, -15.0)), [(6.0, 1.0, 0.0)] * 2)[-1]
    place = start[:3]
    return toy(
        start,
        horizon=horizon,
        obstacles=[box(place + np.array([16.0, -4.0, -20.0]), place + np.array([22.0, 5.0, 15.0]))],
        waypoints=[(place + away, 9.0) for away in ((22.0, 3.0, 0.0), (12.0, 14.0, -3.0))],
    )


def test_an_optimal_solution_is_returned_with_its_objective_and_bound(solve):
    solution = solve(knapsack(), TO_OPTIMALITY)
    assert solution.status is SolveStatus.OPTIMAL
    assert solution.values.tolist() == [1.0, 0.0, 1.0]
    assert solution.objective == pytest.approx(-7.0)
    assert solution.bound == pytest.approx(-7.0)
    assert solution.violation <= TOLERANCE


def test_a_program_without_whole_numbers_is_solved_as_well(solve):
    milp = Milp()
    x = milp.variables("x", (2,), lower=0.0)
    milp.subject_to("sum", (1.0, x), lower=2.0)
    milp.minimize([1.0, 3.0], x)
    solution = solve(milp.build(), SolverLimits())
    assert solution.status is SolveStatus.OPTIMAL
    assert solution.values == pytest.approx([2.0, 0.0])
    assert solution.bound == pytest.approx(2.0)


@pytest.mark.parametrize("integer", [True, False])
def test_an_infeasible_program_has_a_status_and_no_values(solve, integer):
    milp = Milp()
    x = milp.variables("x", (2,), lower=0.0, upper=1.0, integer=integer)
    milp.subject_to("sum", (1.0, x), lower=3.0)
    milp.minimize(1.0, x)
    solution = solve(milp.build(), SolverLimits())
    assert solution.status is SolveStatus.INFEASIBLE
    assert solution.values is None
    assert solution.objective == np.inf


def test_an_unbounded_program_is_never_called_solved(solve):
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
def test_limits_end_a_solve_with_a_status_and_no_exception(solve, limits):
    program = split_evenly()
    solution = solve(program, limits)
    if solution.values is None:
        assert solution.status is SolveStatus.NO_SOLUTION
        assert solution.objective == np.inf
    else:
        assert solution.status in (SolveStatus.FEASIBLE, SolveStatus.OPTIMAL)
        assert program.violation(solution.values) <= TOLERANCE


def test_a_solve_that_ends_early_says_how_far_it_is_from_proven(solve):
    solution = solve(decision(), SolverLimits(nodes=1))
    best = solve(decision(), TO_OPTIMALITY)
    assert best.status is SolveStatus.OPTIMAL
    assert solution.bound <= best.objective + 1e-6
    assert solution.objective >= best.objective - 1e-6
    assert best.bound == pytest.approx(best.objective, abs=1e-5)


def test_the_values_of_a_decision_keep_every_row_by_our_own_arithmetic(solve):
    program = decision()
    solution = solve(program, SolverLimits(nodes=20))
    assert program.violation(solution.values) <= TOLERANCE
    assert solution.violation == program.violation(solution.values)
    assert (solution.values[program.integer] % 1.0 == 0.0).all()
    assert solution.objective == program.objective(solution.values)


@pytest.mark.parametrize("size", [1e-5, 0.2, np.nan])
def test_a_solution_that_breaks_a_row_is_rejected_whatever_the_solver_says(
    solve, name, monkeypatch, size
):
    def lying(claim, *rest):
        return interface.confirmed(replace(claim, values=claim.values - size), *rest)

    milp = Milp()
    x = milp.variables("x", (2,), lower=0.0, upper=5.0)
    milp.subject_to("sum", (1.0, x), lower=3.0)
    milp.minimize([1.0, 2.0], x)
    assert solve(milp.build(), SolverLimits()).status is SolveStatus.OPTIMAL
    monkeypatch.setattr(import_module(solve.__module__), "confirmed", lying)
    solution = solve(milp.build(), SolverLimits())
    assert solution.status is SolveStatus.NO_SOLUTION
    assert solution.values is None
    assert not solution.violation <= TOLERANCE


def test_bounds_can_be_replaced_and_are_kept_exactly(solve):
    program = knapsack()
    upper = program.upper.copy()
    upper[0] = 0.0
    solution = solve(program, TO_OPTIMALITY, upper=upper)
    assert solution.values.tolist() == [0.0, 1.0, 1.0]
    lower = np.array([0.0, 1.0, 0.0])
    solution = solve(program, TO_OPTIMALITY, lower=lower)
    assert solution.values.tolist() == [0.0, 1.0, 1.0]
    assert program.lower.tolist() == [0.0, 0.0, 0.0]


def test_a_start_is_completed_and_a_foolish_one_does_no_harm(solve):
    program = knapsack()
    good = (np.array([0, 2]), np.array([1.0, 1.0]))
    foolish = (np.array([0, 1, 2]), np.array([1.0, 1.0, 1.0]))
    for start in (good, foolish):
        assert solve(program, TO_OPTIMALITY, start=start).objective == pytest.approx(-7.0)


@pytest.mark.parametrize("heuristics", [True, False])
def test_a_partial_start_is_completed_to_a_solution_that_the_root_does_not_find(solve, heuristics):
    choice = np.random.default_rng(8).integers(0, 2, 24).astype(float)
    program = split_evenly(choice=choice)
    limits = SolverLimits(nodes=0, heuristics=heuristics)
    assert solve(program, limits).values is None
    known = np.arange(len(choice) - 3)
    solution = solve(program, limits, start=(known, choice[known]))
    assert solution.objective <= program.objective(choice) + 1e-6


@pytest.mark.parametrize("heuristics", [True, False])
def test_the_same_nodes_give_the_same_values_bit_by_bit(solve, heuristics):
    limits = SolverLimits(nodes=20, heuristics=heuristics)
    first, second = (solve(decision(8), limits) for _ in range(2))
    assert first.values is not None
    assert first.values.tobytes() == second.values.tobytes()
    assert (first.objective, first.bound) == (second.objective, second.bound)


@pytest.mark.parametrize("horizon", [4, 6])
def test_every_solver_finds_the_same_optimum(horizon):
    best = {n: solver_named(n)(decision(horizon), TO_OPTIMALITY) for n in SOLVERS}
    assert {solution.status for solution in best.values()} == {SolveStatus.OPTIMAL}
    for solution in best.values():
        assert solution.objective == pytest.approx(best["highs"].objective, abs=1e-5)
        assert solution.bound == pytest.approx(best["highs"].objective, abs=1e-5)


def test_programs_solved_side_by_side_give_what_they_give_one_by_one(solve):
    programs = [decision(4), decision(5), knapsack(), split_evenly(2, 12)] * 2
    limits = SolverLimits(nodes=5)
    alone = [solve(program, limits) for program in programs]
    with ThreadPoolExecutor(4) as side_by_side:
        together = list(side_by_side.map(lambda program: solve(program, limits), programs))
    for one, other in zip(alone, together, strict=True):
        assert (one.status, one.objective, one.bound) == (
            other.status,
            other.objective,
            other.bound,
        )
        if one.values is not None:
            assert one.values.tobytes() == other.values.tobytes()


def test_rows_without_columns_count(solve):
    milp = Milp()
    x = milp.variables("x", (1,), upper=1.0)
    nothing = np.full((1,), -1)
    milp.minimize(-1.0, x)
    milp.subject_to("kept", (1.0, nothing), lower=-1.0, upper=1.0)
    assert solve(milp.build(), SolverLimits()).values == pytest.approx([1.0])
    milp.subject_to("broken", (1.0, nothing), lower=1.0)
    assert solve(milp.build(), SolverLimits()).values is None


def test_a_decision_is_made_with_every_solver(name):
    problem = turn(8)
    plan = planned(decide(problem, None, 1.0, Effort(teams=2, solver=name)))
    assert first_trouble(problem, plan) is None
    assert plan.covers.any()


def test_an_unknown_solver_is_refused_with_the_names_there_are():
    with pytest.raises(InputError, match="'cplex'; allowed: highs, scip, gurobi"):
        solver_named("cplex")


@pytest.mark.parametrize("missing", ["scip", "gurobi"])
def test_a_missing_package_is_one_line_that_says_what_to_install(missing, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, PACKAGES[missing], None)
    monkeypatch.delitem(sys.modules, f"{solvers.__name__}.{missing}", raising=False)
    command = ["run", "village", "--planner", "milp-mpc", "--option", f"solver={missing}"]
    assert main(command) == 2
    output = capsys.readouterr()
    assert output.out == ""
    (line,) = output.err.splitlines()
    assert f"needs the package {PACKAGES[missing]}" in line
    assert "pip install 'uas-coverage-env[solvers]'" in line


def test_a_program_beyond_gurobis_licence_is_one_line():
    milp = Milp()
    x = milp.variables("x", (2001,), lower=0.0, upper=1.0, integer=True)
    milp.minimize(-1.0, x)
    try:
        solution = solver_named("gurobi")(milp.build(), SolverLimits())
    except InputError as error:  # the licence that comes with the package
        message = str(error)
    else:  # a licence without limits: nothing to refuse
        assert solution.objective == -2001.0
        return
    assert "2001 columns and 0 rows" in message
    assert "\n" not in message


def test_a_program_that_highs_refuses_is_the_solver_s_error():
    milp = Milp()
    milp.variables("x", (2,), lower=0.0, upper=1.0)
    built = milp.build()
    with pytest.raises(SolverError, match="refuses"):
        solver_named("highs")(built, SolverLimits(), lower=built.lower[:1], upper=built.upper)


def test_the_flight_record_names_the_version_of_every_solver_installed():
    installed = {name for name in ("highspy", "pyscipopt", "gurobipy") if find_spec(name)}
    assert installed <= set(recorded_versions())

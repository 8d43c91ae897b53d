"""Whole missions in which the solver fails at random decisions, judged by the independent check."""

import dataclasses

import numpy as np
import pytest
from lively_missions import with_balloon
from uas_coverage_baselines.milp_mpc.solvers import highs
from uas_coverage_baselines.milp_mpc.solvers.interface import Solution, SolveStatus, confirmed

from uas_coverage_env import generate_scenario, independent_check, load_planner, rollout

TOGETHER = {"horizon": "8", "teams": "1", "threads": "1"}
QUICK = {**TOGETHER, "at_once": "1"}  # UAS are planned in turns: no joint program, a third the work
RUNS = (1, 2, 3, 5, 8, 13)  # decisions in a row


def nothing(status):
    """A solve that ends with nothing in hand."""
    return lambda *args, **limits: Solution(status, None, np.inf, -np.inf, np.inf, 0.0)


FAILURES = {
    "no solution": nothing(SolveStatus.NO_SOLUTION),
    "infeasible": nothing(SolveStatus.INFEASIBLE),
}


class Killed:
    """A planner whose solver fails at the decisions of a list.

    Attributes:
        failures: Decision -> what the solver does instead of solving.
        failed: Whether each decision so far was one of them.
    """

    def __init__(self, planner, failures, monkeypatch):
        self.planner, self.failures, self._monkeypatch = planner, failures, monkeypatch
        self.options, self.failed = planner.options, []
        self._solve = highs.solve

    def warm_up(self, scenario):
        self.planner.warm_up(scenario)

    def reset(self, scenario, seed):
        self.planner.reset(scenario, seed)
        self.failed = []

    def act(self, swarm):
        failure = self.failures.get(swarm.step)
        self.failed.append(failure is not None)
        with self._monkeypatch.context() as patched:
            if failure is not None:
                patched.setattr(highs, "solve", failure)
            return self.planner.act(swarm)

    @property
    def last_decision(self):
        return self.planner.last_decision


def at_random(seed, first_run=()):
    """Failures of all kinds in runs of 1 to 13 decisions, after the given runs."""
    draw = np.random.default_rng(seed)
    failures, step = {}, int(draw.integers(3, 9))
    for run in (*first_run, *draw.choice(RUNS, 12)):
        for now in range(step, step + int(run)):
            failures[now] = FAILURES[str(draw.choice(list(FAILURES)))]
        step += int(run) + int(draw.integers(2, 9))
    return failures


def town_of(n_uas):
    """UAS among four blocks, and a balloon that drifts across their ways."""
    built = generate_scenario(7, n_uas=n_uas, n_waypoints=5, n_obstacles=4)
    return with_balloon(built, start_m=(200.0, 150.0, -18.0), velocity_mps=(-1.5, -1.0, 0.0))


@pytest.fixture(scope="module")
def town():
    return town_of(3)


def judged(flight, directory):
    """The independent check's report; nothing touched, nothing too near, nothing that differs."""
    flight.save(directory)
    report = independent_check.check(directory)
    assert report.problems == []
    assert report.breaches == 0
    return report


@pytest.mark.parametrize(
    ("seed", "first_run", "options", "n_uas"),
    [(0, (5, 8), QUICK, 3), (1, (30,), QUICK, 3), (3, (), TOGETHER, 2)],
)
def test_a_mission_survives_a_solver_killed_at_random(
    monkeypatch, tmp_path, seed, first_run, options, n_uas
):
    planner = Killed(load_planner("milp-mpc", options), at_random(seed, first_run), monkeypatch)
    flight = rollout(town_of(n_uas), planner, max_steps=200)
    report = judged(flight, tmp_path / "flight")
    fallbacks = [decision.fallback for decision in flight.decisions]
    assert sum(planner.failed) >= 15, "a mission that nothing happens to proves nothing"
    missed = [
        k for k, (f, g) in enumerate(zip(planner.failed, fallbacks, strict=True)) if f and not g
    ]
    assert not missed
    assert fallbacks == planner.failed
    assert report.coverage == 1.0
    assert report.all_home


def test_a_solver_that_lies_is_not_believed(monkeypatch, tmp_path, town):
    draw = np.random.default_rng(4)

    def lied(claim, *args):
        if claim.values is not None:
            claim = dataclasses.replace(
                claim, values=claim.values + draw.normal(0.0, 0.1, len(claim.values))
            )
        return confirmed(claim, *args)

    def lying(*args, **limits):
        with monkeypatch.context() as patched:
            patched.setattr(highs, "confirmed", lied)
            return solve(*args, **limits)

    solve = highs.solve
    failures = {step: lying for step in range(60) if step % 6 in (3, 4)}
    planner = Killed(load_planner("milp-mpc", QUICK), failures, monkeypatch)
    flight = rollout(town, planner, max_steps=30)
    judged(flight, tmp_path / "flight")
    assert [decision.fallback for decision in flight.decisions] == planner.failed


def test_a_start_inside_the_planner_s_margin_ends_in_a_fallback_and_touches_nothing(tmp_path):
    built = generate_scenario(7, n_uas=2, n_waypoints=3, n_obstacles=3)
    north_m, east_m, _ = built.uas[1].start_m
    # radius and safe distance of the balloon, radius of the UAS, and a hand's breadth
    beside_m = 4.0 + 3.0 + built.uas[1].radius_m + 0.05
    town = with_balloon(built, (north_m + beside_m, east_m, -4.0), (0.0, 0.0, 0.0))
    flight = rollout(town, load_planner("milp-mpc", QUICK), max_steps=8)
    judged(flight, tmp_path / "flight")
    assert flight.decisions[0].fallback


def test_without_time_every_uas_hovers_at_the_start(tmp_path, town):
    # less time than is kept for afterwards, on any machine
    planner = load_planner("milp-mpc", {"time_limit_s": "1e-6", "horizon": "8", "threads": "1"})
    flight = rollout(town, planner, max_steps=15)
    judged(flight, tmp_path / "hovering")
    assert all(decision.fallback for decision in flight.decisions)
    starts = flight.x[0, :, :3]
    assert np.abs(flight.x[:, :, :3] - starts).max() < 0.2


def with_little_charge(scenario, seconds):
    """The scenario with batteries for about so many seconds of flight."""
    data = scenario.model_dump(by_alias=True)
    for uas in data["uas"]:
        uas["dod_max"] = 1.0 - uas["soc_0"] + 0.00085 * seconds
    return type(scenario).model_validate(data)


@pytest.mark.parametrize(("order", "dynamics"), [("search", "lpv"), ("none", "nonlinear")])
def test_where_the_solver_is_dead_for_good_every_uas_comes_home(
    monkeypatch, tmp_path, town, order, dynamics
):
    short = with_little_charge(town, 110.0)
    dead = {step: FAILURES["no solution"] for step in range(14, 400)}
    killed = Killed(load_planner("milp-mpc", QUICK | {"order": order}), dead, monkeypatch)
    flight = rollout(short, killed, dynamics=dynamics)
    flight.save(tmp_path / "flight")
    tolerance = {} if dynamics == "lpv" else {"plan_tolerance_m": 1.0}
    report = independent_check.check(tmp_path / "flight", **tolerance)
    assert report.problems == []
    assert report.breaches == 0
    assert report.all_home
    assert all(decision.fallback for decision in flight.decisions[14:])
    away_m = np.linalg.norm(flight.x[14, :, :3] - flight.x[0, :, :3], axis=1)
    assert away_m.max() > 20.0, "a flight that stays at home proves nothing"


@pytest.mark.parametrize("kind", [RuntimeError, MemoryError])
def test_a_solver_that_raises_does_not_end_the_flight(monkeypatch, tmp_path, town, kind):
    def raising(*args):
        raise kind("out of order")

    def broken(*args, **limits):
        with monkeypatch.context() as patched:
            patched.setattr(highs.highspy.Highs, "run", raising)
            return solve(*args, **limits)

    solve = highs.solve
    failures = {step: broken for step in range(60) if step % 6 in (3, 4)}
    planner = Killed(load_planner("milp-mpc", QUICK), failures, monkeypatch)
    flight = rollout(town, planner, max_steps=15)
    judged(flight, tmp_path / "flight")
    assert [decision.fallback for decision in flight.decisions] == planner.failed

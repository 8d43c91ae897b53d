"""One UAS by itself whose best plan covers nothing: what is searched for near it, and when."""

import dataclasses
import time

import numpy as np
import pytest
from toy_problems import BY_NODES, S500, flown, planned, state, toy, two_around_a_tower
from uas_coverage_baselines.milp_mpc.model.appraisal import Appraisal
from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble
from uas_coverage_baselines.milp_mpc.search.team_search import TeamSearch

HORIZON = 8
AHEAD = ((62.0, 75.0, -12.0), 4.0)


def one(waypoints=(AHEAD,)):
    return toy(state((60.0, 60.0, -12.0)), horizon=HORIZON, waypoints=waypoints)


def past(problem):
    """A plan that flies past the waypoints and covers none."""
    x, u = flown(S500, problem.x0[0], [(0.0, 3.0, 0.0)] * HORIZON)
    covers = np.zeros((1, HORIZON, problem.n_scenario_waypoints), bool)
    plan = Plan(problem.names, x[None], u[None], covers, 0.0, -np.inf)
    return dataclasses.replace(plan, objective=Appraisal(problem).objective(plan))


def begun(problem, work=0.1, programs=1):
    """A search that has found that plan, by so much work and so many programs."""
    search = TeamSearch(problem, BY_NODES, time.perf_counter())
    search.prepare([0])
    search.collect(0, [past(problem)] * 8)
    search.combine([[]])
    search.work, search.programs = work, programs
    return search


def noted(monkeypatch, instead=TeamSearch._refined):
    """The flights near which programs are solved from now on."""
    near = []

    def refined(search, uas, flight, *rest):
        near.append(flight.positions_m.tobytes())
        return instead(search, uas, flight, *rest)

    monkeypatch.setattr(TeamSearch, "_refined", refined)
    return near


def test_a_waypoint_that_the_best_plan_flies_past_is_taken():
    search = begun(one())
    before = planned(search.outcome)
    assert not before.covers.any()
    search.cover()
    plan = planned(search.outcome)
    assert plan.covers.any()
    assert plan.objective < before.objective - 1.0
    assert first_trouble(search.problem, plan) is None


@pytest.mark.parametrize(("work", "solved"), [(0.99, 1), (1.0, 0)])
def test_nothing_is_searched_for_once_the_work_is_done(work, solved, monkeypatch):
    search, near = begun(one(), work), noted(monkeypatch, lambda *task: None)
    search.cover()
    assert len(near) == solved


def test_a_plan_that_covers_something_or_has_nothing_to_cover_is_left_alone(monkeypatch):
    search = begun(one())
    search.cover()
    near = noted(monkeypatch)
    search.cover()
    begun(one(waypoints=())).cover()
    assert not near


def test_the_work_of_programs_near_the_best_plan_counts():
    search = begun(one())
    search.cover()
    assert search.work > 0.1
    assert search.programs > 1


def test_the_plans_of_a_team_are_left_as_they_are(problem, by_nodes, monkeypatch):
    search, near = TeamSearch(problem, BY_NODES, time.perf_counter()), noted(monkeypatch)
    search.prepare(range(2))
    for uas in range(2):
        own = {key: getattr(by_nodes, key)[[uas]] for key in ("x", "u", "covers")}
        search.collect(uas, [dataclasses.replace(by_nodes, names=(problem.names[uas],), **own)])
    search.combine([[], []])
    nothing = dataclasses.replace(search._best, covers=np.zeros_like(by_nodes.covers))
    search._best = nothing
    search.work, search.programs = 0.1, 1
    search.cover()
    assert not near


def test_what_is_left_of_the_work_goes_into_the_root_of_the_whole_program(monkeypatch):
    given = []
    solved = TeamSearch._solved

    def limited(search, program, limits, *start):
        given.append(limits.nodes)
        return solved(search, program, limits, *start)

    monkeypatch.setattr(TeamSearch, "_solved", limited)
    for work in (1.0, 10.0):
        effort = dataclasses.replace(BY_NODES, work=work)
        search = TeamSearch(two_around_a_tower(n_uas=1), effort, time.perf_counter())
        search.prepare([0])
        search.improve()
    assert given == [1, 10]

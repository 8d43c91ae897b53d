"""The work of a decision: what it is spent on, and that nothing else decides."""

import dataclasses
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from toy_problems import BY_NODES, planned
from uas_coverage_baselines.milp_mpc.planner import MilpMpc, MilpMpcOptions
from uas_coverage_baselines.milp_mpc.search import team_search
from uas_coverage_baselines.milp_mpc.search.decision import decide
from uas_coverage_baselines.milp_mpc.search.heuristic import construct
from uas_coverage_baselines.milp_mpc.search.restricted import NARROW
from uas_coverage_baselines.milp_mpc.search.round_robin import RoundRobin

from uas_coverage_env import load_scenario
from uas_coverage_env.mission import MissionBrief


def test_a_share_of_the_work_is_the_joint_programs_once_each_uas_has_a_plan(
    problem, by_nodes, monkeypatch
):
    refined = []
    monkeypatch.setattr(team_search.TeamSearch, "_refined", lambda *task: refined.append(task[1]))
    search = team_search.TeamSearch(problem, BY_NODES, time.perf_counter())
    alone = {key: getattr(by_nodes, key)[:1] for key in ("x", "u", "covers")}
    search.collect(0, [dataclasses.replace(by_nodes, names=by_nodes.names[:1], **alone)])
    with ThreadPoolExecutor(1) as one:
        for work in (0.6, 0.8, 2.5):
            search._joint, search.work = 0.3, work
            search.refine([(0, None), (1, None)], NARROW, one)
            refined.append("next")
    assert refined == [0, 1, "next", 1, "next", "next"]


def test_the_work_of_a_decision_is_that_of_its_programs_whatever_is_solved_beside(problem):
    spent = []
    for threads in (1, 3):
        search = team_search.TeamSearch(problem, BY_NODES, time.perf_counter())
        search.prepare(range(2))
        tasks = [(uas, one) for uas in range(2) for one in construct(problem, uas, 1.0)[:3]]
        with ThreadPoolExecutor(threads) as side_by_side:
            search.refine(tasks, NARROW, side_by_side)
        spent.append(search.work)
    assert spent[0] == spent[1] > 0.0


def test_with_less_work_fewer_programs_are_solved_and_each_uas_has_a_plan(problem, monkeypatch):
    counted = []
    refined = team_search.TeamSearch._refined

    def counting(search, *task):
        counted.append(search.effort.work)
        return refined(search, *task)

    monkeypatch.setattr(team_search.TeamSearch, "_refined", counting)
    little = dataclasses.replace(BY_NODES, work=1e-3)
    for effort in (little, BY_NODES):
        turns = RoundRobin()
        turns.work_of_one = 1e-6  # so that both are planned for
        plan = planned(decide(problem, None, 1.0, effort, round_robin=turns))
        assert set(plan.renewed) == set(problem.names)
    assert counted.count(little.work) < counted.count(BY_NODES.work)


@pytest.mark.parametrize(("of_one", "many"), [(0.05, 2), (0.3, 1), (3.0, 1)])
def test_as_many_uas_are_planned_for_as_the_work_suffices_for(problem, of_one, many):
    search, turns = team_search.TeamSearch(problem, BY_NODES, time.perf_counter()), RoundRobin()
    turns.work_of_one = of_one
    first, then = (search.planned(turns, []) for _ in range(2))
    assert len(first) == len(then) == many
    assert set(first + then) == {0, 1}, "the other one is next"


@pytest.mark.parametrize(("name", "share"), [("indoor", 0.2), ("village", 1.0), ("air_taxi", 1.0)])
def test_a_decision_takes_no_more_than_its_step_is_long(name, share):
    planner = MilpMpc(MilpMpcOptions(effort=2.0))
    planner.reset(MissionBrief.of(load_scenario(name)), 0)
    assert planner._effort().work == pytest.approx(2.0 * share)

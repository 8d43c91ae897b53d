"""What a team of plans costs, where the UAS would cover the same, and where blocks see several."""

import dataclasses
import time

import numpy as np
import pytest
from added_blocks import Apart, Floor
from toy_problems import S500, flown, objective_of, planned, state, toy
from uas_coverage_baselines.milp_mpc.model.appraisal import Appraisal
from uas_coverage_baselines.milp_mpc.model.ocp import OCP
from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_baselines.milp_mpc.search.decision import Effort
from uas_coverage_baselines.milp_mpc.search.team_search import TeamSearch

HORIZON = 6
STARTS = state((80.0, 60.0, -12.0)), state((90.0, 100.0, -12.0))
WAYPOINTS = [((96.0, 62.0, -12.0), 6.0, 3.0), ((85.0, 80.0, -12.0), 35.0, 2.0)]
WORTH = 2.0  # of the second
EFFORT = Effort(joint=None)


def two():
    """Two UAS with a waypoint between them that both can cover, and one of the first alone."""
    return toy(*STARTS, horizon=HORIZON, waypoints=WAYPOINTS, targets=(None, None))


def plan_of(problem, uas, command, covered, blocks=OCP):
    """The plan of one UAS under a velocity; `covered` is pairs of waypoint and step."""
    alone = problem.only(uas)
    x, u = flown(S500, problem.x0[uas], [command] * HORIZON)
    covers = np.zeros((1, HORIZON, problem.n_scenario_waypoints), bool)
    for waypoint, step in covered:
        covers[0, step, waypoint] = True
    plan = Plan((problem.names[uas],), x[None], u[None], covers, 0.0, -np.inf)
    return dataclasses.replace(plan, objective=Appraisal(alone, blocks).objective(plan))


def team_of(problem, plans, blocks=OCP):
    """What becomes of plans of which each UAS has one."""
    search = TeamSearch(problem, EFFORT, time.perf_counter(), blocks)
    for uas, plan in enumerate(plans):
        search.collect(uas, [plan])
    search.combine([[], []])
    return planned(search.outcome)


@pytest.mark.parametrize(("steps", "owner"), [((2, 4), 0), ((4, 2), 1), ((3, 3), 0)])
def test_a_waypoint_that_two_plans_cover_counts_for_the_first_to_get_there_alone(steps, owner):
    problem = two()
    plans = [
        plan_of(problem, uas, (0.0, way, 0.0), [(1, step)])
        for uas, way, step in zip((0, 1), (1.0, -1.0), steps, strict=True)
    ]
    team = team_of(problem, plans)
    covered = np.argwhere(team.covers)
    assert covered.tolist() == [[owner, steps[owner], 1]]
    later = steps[1 - owner]
    alone = sum(plan.objective for plan in plans)
    assert team.objective == pytest.approx(alone + WORTH * (HORIZON - later))


def first_inside(path_m, place_m, radius_m):
    """The first step from which a path lies well inside a waypoint, as its polyhedron has it."""
    return int(np.argmax(np.linalg.norm(path_m - place_m, axis=1) < 0.5 * radius_m))


def test_the_team_has_the_objective_that_the_whole_program_gives_it():
    problem, ways = two(), ((0.8, 2.0, 0.0), (-0.8, -3.0, 0.0))
    paths_m = [plan_of(problem, uas, way, []).x[0, :, :3] for uas, way in enumerate(ways)]
    steps = [first_inside(path_m, *WAYPOINTS[1][:2]) for path_m in paths_m]
    assert 0 < steps[1] < steps[0] < HORIZON
    plans = [plan_of(problem, uas, ways[uas], [(1, steps[uas])]) for uas in range(2)]
    team = team_of(problem, plans)
    assert np.argwhere(team.covers).tolist() == [[1, steps[1], 1]]
    assert team.objective == pytest.approx(objective_of(problem, team), abs=2e-3)
    assert team.objective > sum(plan.objective for plan in plans) + 1.0


def test_the_team_pays_what_a_block_asks_of_two_at_once():
    blocks = (*OCP, Apart(60.0), Floor(14.0))
    problem = two()
    plans = [
        plan_of(problem, uas, (0.0, way, 0.0), [], blocks) for uas, way in ((0, 1.0), (1, -1.0))
    ]
    team = team_of(problem, plans, blocks)
    together = objective_of(problem, team, blocks)
    assert team.objective == pytest.approx(together, abs=2e-3)
    east_m = plans[1].x[0, 1:, 1] - plans[0].x[0, 1:, 1]
    asked = 0.1 * np.maximum(60.0 - east_m, 0.0).sum()
    assert asked > 5.0
    assert team.objective == pytest.approx(sum(p.objective for p in plans) + asked, abs=2e-3)


def test_a_team_says_which_uas_have_a_new_plan():
    problem = two()
    plans = [plan_of(problem, uas, (0.0, 0.0, 0.0), []) for uas in range(2)]
    search = TeamSearch(problem, EFFORT, time.perf_counter())
    search.collect(1, [plans[1]])
    search.combine([[plans[0]], [plan_of(problem, 1, (0.0, 1.0, 0.0), [])]])
    assert planned(search.outcome).renewed == ("b",)


def test_a_plan_into_the_ground_is_not_kept_whatever_program_it_comes_from():
    problem = two()
    plan = plan_of(problem, 0, (0.0, 1.0, 0.0), [])
    low = plan.x.copy()
    low[0, 3, 2] = 5.0
    search = TeamSearch(problem, EFFORT, time.perf_counter())
    search.collect(0, [dataclasses.replace(plan, x=low)])
    assert not search.has_plan(0)
    search.collect(0, [plan])
    assert search.has_plan(0)

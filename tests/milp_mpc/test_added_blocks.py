"""A block that is added to the OCP is flown, priced and kept, without an edit of the package."""

import dataclasses
import time

import added_blocks
import numpy as np
import pytest
from added_blocks import Apart, Ceiling, Doubled, Early, Floor, OneLevel, Thrifty, Turned
from practice_missions import fly, mission
from toy_problems import TO_OPTIMALITY, flown, planned, state, toy
from uas_coverage_baselines.milp_mpc import MilpMpc
from uas_coverage_baselines.milp_mpc.fallback.backup import backup_trajectory
from uas_coverage_baselines.milp_mpc.fallback.plans import fallback_plans
from uas_coverage_baselines.milp_mpc.fallback.reasons import Reason
from uas_coverage_baselines.milp_mpc.model.appraisal import Appraisal
from uas_coverage_baselines.milp_mpc.model.blocks import InsideGeofence, TargetDistance
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, formulate
from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_baselines.milp_mpc.model.reductions import FORMULATIONS
from uas_coverage_baselines.milp_mpc.search import team_search
from uas_coverage_baselines.milp_mpc.search.decision import Effort, decide
from uas_coverage_baselines.milp_mpc.search.heuristic import construct
from uas_coverage_baselines.milp_mpc.search.restricted import RestrictedMilp
from uas_coverage_baselines.milp_mpc.solvers.highs import solve

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.simulation import World

BY_NODES = Effort(teams=2)
ORDERS = ("none", "search")


@pytest.fixture(scope="module")
def garden():
    return mission(
        [((80.0, 50.0, -18.0), 8.0), ((75.0, 90.0, -20.0), 8.0), ((45.0, 95.0, -12.0), 10.0)],
        [(50.0, 50.0, -1.0), (50.0, 70.0, -1.0)],
    )


@pytest.fixture
def grounded():
    """Two UAS on the ground with a waypoint each."""
    return toy(
        state((50.0, 50.0, -1.0)),
        state((50.0, 90.0, -1.0)),
        horizon=8,
        waypoints=[((70.0, 50.0, -12.0), 8.0), ((70.0, 92.0, -12.0), 8.0)],
    )


def made(order, scenario, *added):
    """The planner with blocks added, ready for the mission."""
    # places that are covered in order have to be within reach below a ceiling, too
    sides = {"waypoint_sides": 12} if order == "search" else {}
    options = MilpMpc.Options(horizon=8, teams=1, order=order, **sides)
    result = MilpMpc(options, blocks=(*OCP, *added))
    result.reset(MissionBrief.of(scenario), 0)
    return result


def heights_of(world, planner, steps):
    """(T, U) heights, and the decisions."""
    heights, decisions = [], []
    for _ in range(steps):
        fly(world, planner, 1)
        decisions.append(planner.last_decision)
        heights.append(-world.state.x[:, 2])
    return np.array(heights), decisions


@pytest.mark.parametrize("name", FORMULATIONS)
def test_a_block_that_is_added_is_in_every_formulation(grounded, name):
    milp, _ = FORMULATIONS[name].write(grounded, (*OCP, Ceiling(30.0)))
    assert sum(row.startswith("ceiling") for row in milp.row_names()) == 2 * 8


def test_a_formulation_replaces_blocks_and_leaves_out_none():
    for name, formulation in FORMULATIONS.items():
        replaced = {one for group in formulation.replaces for one in group}
        kept = [block for block in OCP if type(block) not in replaced]
        assert replaced <= {type(block) for block in OCP}, name
        assert [block for block in formulation.of(OCP) if block in kept] == kept, name


def test_a_subclass_of_a_block_is_not_replaced_and_a_block_left_out_is_not_missed(grounded):
    class Inner(InsideGeofence):
        def add_to(self, milp, v, problem):
            super().add_to(milp, v, dataclasses.replace(problem, fence_margin_m=20.0))

    inner = tuple(Inner() if isinstance(block, InsideGeofence) else block for block in OCP)
    program = RestrictedMilp(grounded, inner)
    north = program.variables.position[:, 1:, 0]
    assert (program.built.lower[north] >= 20.0 - 1e-9).all()
    rows = RestrictedMilp(grounded, OCP[:-1]).milp.row_names()
    assert not any(row.startswith("reserve") for row in rows)
    without_corners = tuple(b for b in OCP if type(b).__name__ != "CornerCutting")
    assert RestrictedMilp(grounded, without_corners).milp.row_names()


@pytest.mark.parametrize("block", [Thrifty(), Turned(), Early(), Doubled()])
def test_a_block_may_use_columns_that_reduced_programs_do_without(grounded, block):
    alone = grounded.only(0)
    found = solve(RestrictedMilp(alone, (*OCP, block)).built, TO_OPTIMALITY)
    whole = solve(formulate(alone, (*OCP, block))[0].build(), TO_OPTIMALITY)
    assert found.objective == pytest.approx(whole.objective, abs=1e-4)
    plain = solve(RestrictedMilp(alone).built, TO_OPTIMALITY)
    assert isinstance(block, Thrifty) or found.objective > plain.objective + 1e-3


@pytest.mark.parametrize("order", ORDERS)
def test_with_a_priced_floor_every_uas_takes_off_and_no_decision_falls_back(order, garden):
    world, flier = World(garden), made(order, garden, Floor(8.0, 5.0))
    heights, decisions = heights_of(world, flier, 10)
    assert [decision.reason for decision in decisions if decision.fallback] == []
    assert (heights[-1] > 7.9).all()


@pytest.mark.parametrize("order", ORDERS)
def test_a_ceiling_holds_in_the_flight(order, garden):
    heights, _ = heights_of(World(garden), made(order, garden), 12)
    assert heights.max() > 12.0
    world = World(garden)
    heights, decisions = heights_of(world, made(order, garden, Ceiling(11.0)), 12)
    assert heights.max() <= 11.0 + 1e-4
    assert heights.max() > 8.0
    assert not any(decision.fallback for decision in decisions)


def test_the_backup_trajectory_keeps_below_a_ceiling_too():
    climbing = state((50.0, 50.0, -6.0), (0.0, 0.0, -2.5))
    problem = toy(climbing, horizon=8)
    x, u = flown(problem.vehicles[0], climbing, [(0.0, 0.0, -2.5)] * 2 + [(6.0, 0.0, 0.0)] * 6)
    plan = Plan(problem.names, x[None], u[None], np.zeros((1, 8, 0), bool), 0.0, -np.inf)
    top = -x[:, 2].min()
    over = -backup_trajectory(problem, plan, 1.0).x[0, :, 2].min()
    assert over >= top - 1e-9
    below = backup_trajectory(problem, plan, 1.0, (*OCP, Ceiling(top + 0.05)))
    assert below is not None
    assert -below.x[0, :, 2].min() <= top + 0.05 + 1e-4
    assert backup_trajectory(problem, plan, 1.0, (*OCP, Ceiling(6.2))) is None


def test_what_is_flown_while_waiting_costs_what_its_rows_cost(grounded):
    alone, blocks = grounded.only(0), (*OCP, Floor(8.0, 5.0))
    (plan,) = fallback_plans(grounded, 0, None, 1.0, blocks)
    (before,) = fallback_plans(grounded, 0, None, 1.0)
    below_m = np.maximum(8.0 + plan.x[0, 1:, 2], 0.0)
    assert plan.objective == pytest.approx(before.objective + 5.0 * below_m.sum(), abs=1e-3)
    milp, v = formulate(alone, blocks)
    built = milp.build()
    lower, upper = built.lower.copy(), built.upper.copy()
    for columns, values in ((v.x[:, 1:], plan.x[:, 1:]), (v.u, plan.u)):
        lower[columns], upper[columns] = values - 1e-7, values + 1e-7
    upper[v.covers[v.covers >= 0]] = 0.0
    whole = solve(built, TO_OPTIMALITY, lower=lower, upper=upper)
    assert whole.objective == pytest.approx(plan.objective, abs=2e-3)


def test_a_subclass_with_rows_of_its_own_is_priced_by_these(grounded):
    class Costly(TargetDistance):
        def add_to(self, milp, v, problem):
            Floor(8.0, 5.0).add_to(milp, v, problem)

    blocks = tuple(Costly() if type(block) is TargetDistance else block for block in OCP)
    (plan,) = fallback_plans(grounded, 0, None, 1.0, blocks)
    (floor,) = fallback_plans(grounded, 0, None, 1.0, (*OCP, Floor(8.0, 5.0)))
    assert plan.objective == pytest.approx(floor.objective)


def test_a_flight_that_breaks_rows_is_refused_by_name(grounded):
    (plan,) = fallback_plans(grounded, 0, None, 1.0)
    alone = grounded.only(0)
    assert Appraisal(alone, (*OCP, Ceiling(5.0))).trouble(plan) is None
    refused = Appraisal(alone, (*OCP, Ceiling(0.5))).trouble(plan)
    assert refused.startswith("ceiling(0,")


def test_whole_columns_of_a_block_are_chosen_at_best(grounded):
    alone = grounded.only(0)
    x, u = flown(alone.vehicles[0], alone.x0[0], [(0.0, 0.0, -2.5)] * 8)
    plan = Plan(alone.names, x[None], u[None], np.zeros((1, 8, 2), bool), 0.0, -np.inf)
    high = int((x[1:, 2] < -10.0).sum())
    assert 0 < high < 8
    assert Appraisal(alone, [OneLevel()]).price_of(plan).cost == pytest.approx(2.0 * high)


def test_constructed_flights_are_ranked_by_what_blocks_say_of_their_paths(grounded):
    plain = construct(grounded, 0, 1.0)
    priced = {
        f.positions_m.tobytes(): f for f in construct(grounded, 0, 1.0, blocks=(*OCP, Floor()))
    }
    assert set(priced) == {f.positions_m.tobytes() for f in plain}
    for one in plain:
        below_m = np.maximum(8.0 + one.positions_m[1:, 2], 0.0).sum()
        assert priced[one.positions_m.tobytes()].cost == pytest.approx(one.cost + 5.0 * below_m)


def test_a_block_about_two_uas_is_priced_for_the_team(grounded):
    blocks = (*OCP, Apart(60.0))
    search = team_search.TeamSearch(grounded, BY_NODES, time.perf_counter(), blocks)
    plans = [fallback_plans(grounded, uas, None, 1.0, blocks)[0] for uas in range(2)]
    joined = search._joined(plans)
    east = joined.x[:, 1:, 1]
    short_m = np.maximum(60.0 + east[0] - east[1], 0.0)
    apart = joined.objective - sum(plan.objective for plan in plans)
    assert apart == pytest.approx(0.1 * short_m.sum())
    assert apart > 1.0


def test_a_block_that_needs_others_and_has_no_closed_form_says_what_it_lacks(grounded):
    with pytest.raises(ValueError, match="cost_along"):
        decide(grounded, None, 1.0, BY_NODES, blocks=(*OCP, Doubled()))


def test_waiting_that_is_cheaper_is_the_reason_of_a_fallback():
    class StayLow:
        def add_to(self, milp, v, problem):
            above = milp.variables("low.above", (1, problem.horizon), lower=0.0)
            terms = (1.0, above[..., None]), (1.0, v.position[:, 1:, 2:])
            milp.subject_to("low", *terms, lower=-1.0)
            milp.minimize(100.0, above)

    problem = toy(state((50.0, 50.0, -1.0)), horizon=8, waypoints=[((66.0, 50.0, -12.0), 8.0)])
    assert isinstance(decide(problem, None, 1.0, BY_NODES), Plan)
    outcome = decide(problem, None, 1.0, BY_NODES, blocks=(*OCP, StayLow()))
    # a program's plan to stay is as good as waiting, up to the gap: either may be flown
    assert outcome is Reason.WAITING_IS_CHEAPER or not planned(outcome).covers.any()


@pytest.mark.parametrize("wrong", [Ceiling, object(), None])
def test_what_is_no_block_is_refused_at_once(wrong):
    with pytest.raises(InputError, match="add_to"):
        MilpMpc(blocks=(*OCP, wrong))


class TakesLess:
    """Adds nothing, and lacks two arguments."""

    def add_to(self, milp): ...


def test_a_block_that_cannot_be_called_is_refused_with_its_file_and_line():
    line = TakesLess.add_to.__code__.co_firstlineno
    where = rf"called with \(milp, variables, problem\): .*test_added_blocks\.py:{line}\)"
    with pytest.raises(InputError, match=where):
        MilpMpc(blocks=(*OCP, TakesLess()))


@pytest.mark.parametrize(
    ("names", "height_m"),
    [("added_blocks:Ceiling", 14.0), ("added_blocks:LOW", 9.0), ("added_blocks:made", 10.0)],
)
def test_a_block_is_found_by_its_module(names, height_m):
    flier = MilpMpc(MilpMpc.Options(blocks=names))
    assert flier.blocks[: len(OCP)] == OCP
    for blocks in (flier.blocks, flier.rehearsal().blocks):
        assert isinstance(blocks[-1], added_blocks.Ceiling)
        assert blocks[-1].height_m == height_m
    assert len(flier.rehearsal().blocks) == len(OCP) + 1

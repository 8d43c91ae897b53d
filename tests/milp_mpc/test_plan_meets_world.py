"""The plan's model is the world's: what is predicted is what happens."""

import numpy as np
import pytest
from practice_missions import LITTLE, mission, obstacle, with_uas, wrenches
from uas_coverage_baselines.milp_mpc.model.problem import Weights
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble
from uas_coverage_baselines.milp_mpc.planner import MilpMpcOptions
from uas_coverage_baselines.milp_mpc.problem_builder import ProblemBuilder
from uas_coverage_baselines.milp_mpc.search.decision import decide

from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DELTA_THRUST
from uas_coverage_env.world import Velocity

HORIZON = 10


def two_kinds_of_vehicle():
    """An S500 and a hexacopter, a shed in the way, waypoints around it; batteries half empty."""
    scenario = mission(
        [((75.0, 60.0, -8.0), 8.0), ((60.0, 100.0, -6.0), 8.0), ((110.0, 95.0, -10.0), 10.0)],
        [(50.0, 50.0, -1.0), (50.0, 110.0, -1.0)],
        obstacles=[obstacle((62.0, 74.0, -12.0), (74.0, 92.0, 0.0))],
    )
    scenario = with_uas(scenario, 0, soc_0=0.5)
    return with_uas(scenario, 1, vehicle="hexacopter", soc_0=0.6)


@pytest.fixture(scope="module", params=["practice", "corridor"])
def planned(request):
    """A plan from the middle of a flight, and the world it begins in."""
    scenario = two_kinds_of_vehicle() if request.param == "practice" else load_scenario("corridor")
    world = World(scenario)
    for _ in range(4):
        world.step({name: Velocity(3.0, 4.0, 7.0) for name in world.names})
    swarm = world.swarm_state()
    around = ProblemBuilder(MissionBrief.of(scenario), MilpMpcOptions(horizon=HORIZON))
    problem = around.problem(swarm, dict.fromkeys(world.names), Weights(), 0.15)
    plan = decide(problem, None, scenario.dt_s, LITTLE)
    assert plan is not None
    return world, problem, plan


@pytest.fixture
def world(planned):
    """The world back at the plan's beginning, whatever another test flew."""
    original = planned[0]
    state = original.state.copy()
    yield original
    for array, before in zip(original.state, state, strict=True):
        array[:] = before


def test_the_plan_holds_by_our_own_geometry(planned):
    _, problem, plan = planned
    assert first_trouble(problem, plan) is None
    assert plan.x.shape == (2, HORIZON + 1, 14)
    assert np.isfinite(plan.objective)
    assert plan.bound <= plan.objective


def test_the_next_state_is_the_predicted_one_in_all_fourteen_states(planned, world):
    _, _, plan = planned
    outcome = world.step(wrenches(plan, 0))
    assert world.state.x == pytest.approx(plan.x[:, 1], abs=1e-6)
    assert outcome["u"] == pytest.approx(plan.u[:, 0], abs=1e-6)


def test_the_whole_plan_flown_blindly_is_the_predicted_flight(planned, world):
    _, _, plan = planned
    for step in range(HORIZON):
        outcome = world.step(wrenches(plan, step))
        assert (outcome["contact"] == 0).all()
        assert (outcome["breaches"] == 0).all()
        assert world.state.x == pytest.approx(plan.x[:, step + 1], abs=1e-5)
        # the plan bounds Delta T only from below; it pays for more, so it never takes more
        assert outcome["u"][:, DELTA_THRUST] == pytest.approx(
            plan.u[:, step, DELTA_THRUST], abs=1e-5
        )


def test_what_the_plan_covers_is_covered_in_the_world_by_then(planned, world):
    _, _, plan = planned
    assert plan.covers.any(), "a plan that covers nothing would prove nothing"
    assert (plan.covers.sum(axis=(0, 1)) <= 1).all()
    for step in range(HORIZON):
        by_now = plan.covers[:, : step + 1].any(axis=(0, 1))
        assert not (by_now & world.state.uncovered).any()
        world.step(wrenches(plan, step))


def test_the_plan_begins_where_the_uas_are(planned):
    world, problem, plan = planned
    assert plan.names == world.names
    assert plan.x[:, 0] == pytest.approx(world.swarm_state().x, abs=1e-9)
    assert problem.x0 == pytest.approx(plan.x[:, 0], abs=1e-9)

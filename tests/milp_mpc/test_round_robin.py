"""Where not all can be planned for at once, every UAS gets a turn and nothing is touched."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from practice_missions import mission
from toy_problems import planned, state, toy
from uas_coverage_baselines.milp_mpc.fallback.backup import backup_trajectory
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble
from uas_coverage_baselines.milp_mpc.planner import MilpMpc, MilpMpcOptions
from uas_coverage_baselines.milp_mpc.search.decision import Effort, decide
from uas_coverage_baselines.milp_mpc.search.round_robin import RoundRobin

from uas_coverage_env.flight import rollout
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.vehicle import load_vehicle

ONE = Effort(teams=1, at_once=1)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(n_uas=st.integers(1, 12), most=st.integers(1, 5), urgent=st.data())
def test_no_uas_waits_longer_than_the_others_together_take(n_uas, most, urgent):
    turns, names = RoundRobin(), [f"uas_{k}" for k in range(n_uas)]
    waited = np.zeros(n_uas, int)
    for _ in range(30):
        taken = turns.select(names, [], most)
        assert len(set(taken)) == min(most, n_uas)
        waited += 1
        waited[taken] = 0
        assert waited.max() <= -(-n_uas // most)
    pressing = urgent.draw(st.sets(st.integers(0, n_uas - 1), max_size=most))
    assert pressing <= set(turns.select(names, pressing, most))


@pytest.fixture(scope="module")
def problem():
    starts = [state((60.0, 60.0 + 30.0 * k, -10.0), (3.0, 0.0, 0.0)) for k in range(3)]
    places = [((100.0, 60.0 + 30.0 * k, -10.0), 8.0) for k in range(3)]
    return toy(*starts, horizon=8, waypoints=places)


def test_one_after_the_other_gets_a_new_plan_and_the_others_go_on(problem):
    turns, renewed = RoundRobin(), []
    out = None
    for _ in range(3):
        plan = planned(decide(problem, None, 1.0, ONE, backup=out, round_robin=turns))
        assert first_trouble(problem, plan) is None
        assert len(plan.renewed) == 1
        if out is not None:
            for name in set(problem.names) - set(plan.renewed):
                went_on = out.x[out.of(name), : problem.horizon + 1]
                assert plan.x[plan.of(name)] == pytest.approx(went_on)
        renewed += plan.renewed
        out = backup_trajectory(problem, plan, 1.0)
    assert sorted(renewed) == sorted(problem.names)
    assert plan.covers.any(axis=(0, 1)).all()


def test_a_mixed_fleet_whose_uas_take_turns_covers_everything_and_comes_home():
    places = [((60.0, 40.0 + 25.0 * k, -10.0), 8.0) for k in range(4)]
    scenario = mission(places, [(20.0, 20.0, -1.0), (20.0, 150.0, -1.0)])
    data = scenario.model_dump(by_alias=True)
    data["uas"][1].update(vehicle="hexacopter", radius_m=0.6)
    scenario = type(scenario).model_validate(data)
    assert scenario.vehicles == (load_vehicle("s500_v2"), load_vehicle("hexacopter"))
    planner = MilpMpc(MilpMpcOptions(horizon=8, at_once=1, order="search"))
    flight = rollout(scenario, planner, seed=0)
    assert accomplished(flight)
    assert not flight.breaches
    assert not any(decision.fallback for decision in flight.decisions)
    moved_m = np.linalg.norm(flight.x[:, :, :3] - flight.x[0, :, :3], axis=2).max(axis=0)
    assert (moved_m > 30.0).all(), "both have to fly"

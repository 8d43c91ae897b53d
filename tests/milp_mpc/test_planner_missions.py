"""The planner at work: repeatable, for different vehicles, until every UAS has landed."""

import itertools
import os
import subprocess
import sys
import time

import numpy as np
import pytest
from practice_missions import fly, mission, planner, with_uas
from uas_coverage_baselines.milp_mpc import moving_horizon as planner_module
from uas_coverage_baselines.milp_mpc.fallback.reasons import Reason
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble
from uas_coverage_baselines.milp_mpc.planner import MilpMpc

from uas_coverage_env.entities.state import LANDED
from uas_coverage_env.flight import load_planner, rollout
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.scenario import generate_scenario, load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import VZ


def commands_of(scenario, decisions, **options):
    """The commands of a flight's first decisions, and its last state."""
    world, made = World(scenario), planner(scenario, **options)
    commands = []
    for _ in range(decisions):
        commands.append(made.act(world.swarm_state()))
        world.step(commands[-1])
    return commands, world.state.x


def village_flown(steps=3):
    """The first steps of the village with the defaults, to the bit."""
    flight = rollout(load_scenario("village"), MilpMpc(), max_steps=steps)
    assert not any(decision.fallback for decision in flight.decisions)
    return flight.x.tobytes(), flight.u.tobytes()


@pytest.fixture(scope="module")
def village_as_it_is():
    return village_flown()


def test_by_default_the_village_is_flown_the_same_again_on_a_busy_machine(village_as_it_is):
    spin = "while True: pass"
    busy = [subprocess.Popen([sys.executable, "-c", spin]) for _ in range(os.cpu_count() or 1)]
    try:
        assert village_flown() == village_as_it_is
    finally:
        for one in busy:
            one.kill()
            one.wait()


def test_by_default_a_clock_that_runs_a_thousand_times_as_fast_changes_no_flight(
    village_as_it_is, monkeypatch
):
    clock = time.perf_counter
    monkeypatch.setattr(time, "perf_counter", lambda: 1000.0 * clock())
    assert village_flown() == village_as_it_is


def test_how_many_programs_are_solved_side_by_side_changes_nothing():
    scenario = load_scenario("open_field")
    alone, _ = commands_of(scenario, 2, threads=1)
    together, _ = commands_of(scenario, 2, threads=4)
    assert alone == together


def test_where_a_time_limit_ends_a_decision_its_record_says_so(monkeypatch):
    scenario, spent = load_scenario("open_field"), itertools.count()
    made = planner(scenario, time_limit_s=10.0)
    # the first programs are solved in time, the later ones are not begun
    monkeypatch.setattr(time, "perf_counter", lambda: float(next(spent)))
    made.act(World(scenario).swarm_state())
    decision = made.last_decision
    assert not decision.fallback
    assert decision.reason == Reason.CUT_SHORT
    monkeypatch.undo()
    made = planner(scenario)
    made.act(World(scenario).swarm_state())
    assert made.last_decision.reason is None


def test_one_decision_for_different_vehicles_is_a_verified_plan(monkeypatch):
    seen = []
    decide = planner_module.decide

    def noting(problem, *rest, **options):
        plan = decide(problem, *rest, **options)
        seen.append((problem, plan))
        return plan

    monkeypatch.setattr(planner_module, "decide", noting)
    scenario = load_scenario("corridor")
    world = World(scenario)
    commands = planner(scenario).act(world.swarm_state())
    ((problem, plan),) = seen
    motors = {vehicle.airframe.n_motors for vehicle in problem.vehicles}
    assert motors == {4, 6}
    assert first_trouble(problem, plan) is None
    assert set(commands) == set(world.names)
    world.step(commands)
    assert world.state.x == pytest.approx(plan.x[:, 1], abs=1e-6)


def test_every_uas_lands_where_it_stands_once_there_is_nothing_to_do():
    starts = [(50.0, 50.0, -1.0), (50.0, 90.0, -1.0)]
    scenario = mission([((52.0, 51.0, -2.0), 8.0)], starts)
    world = World(scenario)
    assert not world.state.uncovered.any()
    fly(world, planner(scenario), 4)
    assert (world.state.uas["status"] == LANDED).all()
    assert np.abs(world.state.x[:, :3] - starts).max() < 1.0


@pytest.fixture(scope="module")
def finished():
    """Outcomes, world and planner of a mission that needs only one of two UAS."""
    scenario = mission([((35.0, 15.0, -6.0), 10.0)], [(10.0, 10.0, -1.0), (190.0, 190.0, -1.0)])
    scenario = with_uas(scenario, 1, vehicle="hexacopter")
    world, made = World(scenario), planner(scenario, horizon=18)
    return fly(world, made, 40), world, made


def test_a_mission_ends_with_everything_covered_and_every_uas_landed(finished):
    outcomes, world, _ = finished
    assert not world.state.uncovered.any()
    assert (world.state.uas["status"] == LANDED).all()
    assert (outcomes["contact"] == 0).all()
    assert outcomes["breaches"].sum() == 0
    assert outcomes["newly_covered"].sum(axis=0).tolist() == [1, 0]


def test_a_uas_that_is_never_needed_lands_where_it_stands(finished):
    outcomes, world, _ = finished
    assert outcomes["landed"].sum(axis=0).tolist() == [1, 1]
    assert np.linalg.norm(world.state.x[1, :3] - world.arena.uas["home_m"][1]) < 2.0
    assert not world.state.uas[1].departed


def test_a_landed_uas_is_no_part_of_the_plans_that_follow(finished):
    outcomes, world, made = finished
    landed_at = outcomes["landed"].argmax(axis=0)
    assert landed_at[0] != landed_at[1], "both at once would prove nothing"
    last = world.names[int(landed_at.argmax())]
    assert set(made.last_decision.predicted_m) == {last}


def test_the_mission_is_announced_as_returning_once_everything_is_covered(finished):
    outcomes, _, _ = finished
    covered_at = int(outcomes["newly_covered"].sum(axis=1).argmax())
    flying = outcomes["u"].any(axis=2)
    assert not outcomes["returning"][: covered_at + 1].any()
    assert (outcomes["returning"] | ~flying)[covered_at + 1 :].all()


def test_a_uas_too_low_on_charge_lands_before_it_leaves():
    far = [((150.0, 100.0 + 20.0 * k, -8.0), 8.0) for k in range(3)]
    scenario = mission(far, [(50.0, 50.0, -1.0), (50.0, 150.0, -1.0)])
    scenario = with_uas(scenario, 0, soc_0=0.26)
    world = World(scenario)
    outcomes = fly(world, planner(scenario), 3)
    assert outcomes["landed"][0].tolist() == [True, False]
    assert outcomes["returning"][0].tolist() == [True, False]
    assert world.state.uncovered.all()


@pytest.mark.parametrize("horizon", [8, 18])
def test_a_uas_that_is_at_home_and_still_moves_comes_to_rest_and_lands(horizon):
    scenario = mission([((52.0, 51.0, -2.0), 8.0)], [(50.0, 50.0, -1.0)])
    world = World(scenario)
    world.state.x[0, VZ] = 0.9
    fly(world, planner(scenario, horizon=horizon), 12)
    assert world.done


@pytest.mark.slow
def test_a_whole_mission_is_flown_to_its_end_without_a_violation():
    options = {"horizon": "12", "teams": "2"}
    town = generate_scenario(12, n_uas=2, n_waypoints=4, n_obstacles=2)
    flight = rollout(town, load_planner("milp-mpc", options), seed=0)
    assert accomplished(flight)
    assert flight.breaches == 0

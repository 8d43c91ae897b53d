"""Better plans for the rest of a mission, looked for while it is flown."""

from dataclasses import replace

import numpy as np
import pytest
import uas_coverage_baselines.trajectory.mission_plan as mission_plan
import uas_coverage_baselines.trajectory.program as program_module
from small_fleets import field
from small_worlds import mover
from uas_coverage_baselines.trajectory import Trajectory, TrajectoryOptions
from uas_coverage_baselines.trajectory.improving import Improvement

from uas_coverage_env import rollout
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.scenario import generate_scenario
from uas_coverage_env.vehicle.layout import VX, VZ

QUICK = {"orders": 1, "moves": 20_000, "programs": 40}


def flown(scenario, **options):
    known = options.pop("rollout", {})
    return rollout(scenario, Trajectory(TrajectoryOptions(**(QUICK | options))), **known)


@pytest.fixture(scope="module")
def small_town():
    return generate_scenario(3, n_uas=1, n_waypoints=14, n_obstacles=4)


@pytest.fixture
def bad_orders(monkeypatch):
    """Plans whose last waypoints are visited in an order that is plainly bad."""
    orders = mission_plan._orders

    def bad(*args):
        best = orders(*args)[0]
        routes = tuple(np.append(r[:6], np.sort(r[6:])) for r in best.routes)
        return [replace(best, routes=routes)]

    monkeypatch.setattr(mission_plan, "_orders", bad)


@pytest.fixture
def found(monkeypatch):
    """What was found in flight."""
    better, plans = Improvement.better, []

    def watched(*args):
        plan = better(*args)
        plans.extend([] if plan is None else [plan])
        return plan

    monkeypatch.setattr(Improvement, "better", watched)
    return plans


@pytest.mark.usefixtures("bad_orders")
def test_a_bad_order_is_left_for_a_better_one_while_flying(small_town, found):
    as_planned = flown(small_town, idle_work=0)
    assert not found
    improved = flown(small_town)
    assert found
    assert improved.steps < as_planned.steps - 5
    assert accomplished(improved)
    assert improved.violations == ()
    assert improved.breaches == 0
    assert not any(decision.fallback for decision in improved.decisions)
    np.testing.assert_array_equal(flown(small_town).x, improved.x)


@pytest.mark.usefixtures("bad_orders")
def test_before_it_takes_over_the_flight_is_as_planned(small_town):
    as_planned, improved = flown(small_town, idle_work=0), flown(small_town)
    n = min(as_planned.steps, improved.steps)
    same = (as_planned.x[:n, 0] == improved.x[:n, 0]).all(axis=1)
    assert same[:10].all()
    assert not same.all()


@pytest.mark.usefixtures("bad_orders")
def test_flights_that_fail_the_verification_do_not_take_over(small_town, found, monkeypatch):
    as_planned = flown(small_town, idle_work=0)
    trouble = mission_plan.trouble_alone
    planned = []

    def only_before_take_off(fleet, uas, x, flight):
        if not x[VX : VZ + 1].any():
            return trouble(fleet, uas, x, flight)
        planned.append(uas)
        return "not this one"

    monkeypatch.setattr(mission_plan, "trouble_alone", only_before_take_off)
    flight = flown(small_town)
    assert planned
    assert not found
    np.testing.assert_array_equal(flight.x, as_planned.x)


@pytest.mark.usefixtures("bad_orders")
def test_where_the_plant_is_another_nothing_is_looked_for(small_town, found):
    flight = flown(small_town, rollout={"dynamics": "nonlinear"})
    assert accomplished(flight)
    assert not found


@pytest.mark.usefixtures("bad_orders")
def test_what_moves_is_predicted_to_where_the_better_plan_begins(found):
    crossing = mover((30.0, 5.0, -20.0), (0.0, (0.0, 2.0, 0.0)))
    flight = flown(field(moving_obstacles=(crossing,)), idle_work=2000)
    assert accomplished(flight)
    assert flight.breaches == 0
    assert flight.violations == ()


@pytest.mark.usefixtures("bad_orders")
def test_a_decision_does_about_as_much_work_as_it_is_told_to(small_town, monkeypatch):
    """Between two flights looked for it stops; each takes more than a tenth of the work."""
    calls, solve = [], program_module.solve

    def counted(model, rows, x, u, **options):
        calls[-1] += len(u)
        return solve(model, rows, x, u, **options)

    class Counting(Trajectory):
        def act(self, swarm):
            calls.append(0)
            return super().act(swarm)

    calls.append(0)
    monkeypatch.setattr(program_module, "solve", counted)
    rollout(small_town, Counting(TrajectoryOptions(**QUICK, idle_work=300)))
    in_flight = np.array(calls[2:])
    assert in_flight.max() > 0
    assert in_flight.max() < 300 + 4 * 3 * len(in_flight)

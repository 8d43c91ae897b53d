"""A wall stops no UAS: aims go round it, and what plans cannot do a route does.

The missions are small ones of the kind in which `milp-mpc`, without an order and with one, stood
before a wall until their batteries were empty.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from uas_coverage_baselines.milp_mpc import moving_horizon
from uas_coverage_baselines.milp_mpc.fallback.reasons import Reason
from uas_coverage_baselines.milp_mpc.model.problem import Plan

from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.flight import load_planner
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.attempts import Attempts
from uas_coverage_env.planning.backup.braking import brake
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle import compile_vehicle
from uas_coverage_env.vehicle.layout import DOD

WALLS = Path(__file__).parent / "walls"
CHEAP = {
    "at_once": "1",
    "horizon": "10",
    "threads": "1",
    "teams": "2",
}


ORDERS = {"none": {}, "search": {"order": "search", "waypoint_sides": "12"}}


class Flight:
    """A flight of one of the walls' missions, step by step."""

    def __init__(self, name, order):
        self.scenario = load_scenario(str(WALLS / f"{name}.toml"))
        self.world = World(self.scenario)
        self.planner: Any = load_planner("milp-mpc", CHEAP | ORDERS[order])
        self.planner.reset(MissionBrief.of(self.scenario), 0)
        self.reasons, self.breaches = [], 0

    def behind(self, *position_m):
        """All UAS on the ground but the first, which has covered everything and is there."""
        self.world.state.x[0, :3] = position_m
        self.world.state.uas[0].departed = True
        self.world.state.uas["status"][1:] = LANDED
        self.world.state.uncovered[:] = False
        return self

    def until(self, over, at_most):
        for _ in range(at_most):
            if over(self.world.state) or self.world.done:
                break
            commands = self.planner.act(self.world.swarm_state())
            self.reasons.append(self.planner.last_decision.reason)
            outcome = self.world.step(commands)
            assert (outcome["contact"] == 0).all()
            self.breaches += int(outcome["breaches"].sum())
        return self


def covered(state):
    return not state.uncovered.any()


def landed(state):
    return not (state.uas["status"] == FLYING).any()


@pytest.mark.parametrize("order", ["none", "search"])
def test_what_lies_behind_a_wall_is_covered(order):
    flight = Flight("wall", order).until(covered, 45)
    assert covered(flight.world.state)
    assert flight.breaches == 0
    assert Reason.STANDSTILL not in flight.reasons


@pytest.mark.parametrize("order", ["none", "search"])
@pytest.mark.parametrize(
    ("name", "behind_m"), [("wall", (70.0, 62.0, -10.0)), ("canyon", (70.0, 97.0, -10.0))]
)
def test_from_behind_walls_and_through_gaps_a_uas_comes_home(order, name, behind_m):
    flight = Flight(name, order).behind(*behind_m).until(landed, 90)
    assert landed(flight.world.state)
    assert flight.world.state.uas[0].status == LANDED
    assert flight.breaches == 0


class Hovering:
    """Plans, one after the other, to stay."""

    def __call__(self, problem, previous, dt_s, effort, **rest):
        flown = [
            brake(compile_vehicle(vehicle, dt_s)[()], x, problem.horizon)
            for vehicle, x in zip(problem.vehicles, problem.x0, strict=True)
        ]
        x = np.array([np.vstack([x0, x]) for x0, (x, _) in zip(problem.x0, flown, strict=True)])
        u = np.array([inputs for _, inputs in flown])
        covers = np.zeros((*u.shape[:2], problem.n_scenario_waypoints), bool)
        return Plan(problem.names, x, u, covers, 0.0, -np.inf, renewed=problem.names)


# with time enough to be home: an order leaves out what a UAS could not come home from any more
@pytest.mark.parametrize("order", ["none", "search"])
@pytest.mark.parametrize("name", ["wall", "low_wall"])
def test_plans_that_lead_nowhere_are_overruled_by_a_route_and_counted(monkeypatch, order, name):
    monkeypatch.setattr(moving_horizon, "decide", Hovering())
    flight = Flight(name, order).until(covered, 150)
    assert covered(flight.world.state)
    assert flight.breaches == 0
    assert set(flight.reasons[:30]) == {None}
    assert Reason.STANDSTILL in flight.reasons


def test_charge_for_the_way_home_overrules_every_plan(monkeypatch):
    monkeypatch.setattr(moving_horizon, "decide", Hovering())
    flight = Flight("wall", "search").behind(70.0, 62.0, -10.0)
    flight.world.state.uncovered[:] = True
    flight.world.state.x[0, DOD] = 0.70
    flight.until(landed, 100)
    assert flight.world.state.uas[0].status == LANDED
    assert Reason.CHARGE in flight.reasons
    first = flight.reasons.index(Reason.CHARGE)
    assert set(flight.reasons[first:]) == {Reason.CHARGE}, "it is not sent out again"
    assert 0.70 < flight.world.state.x[0, DOD] < 0.75


def test_a_uas_that_came_no_nearer_to_home_flies_slowly_only_at_its_end(monkeypatch):
    monkeypatch.setattr(moving_horizon, "decide", Hovering())
    monkeypatch.setattr(Attempts, "is_hard", lambda *_: True)
    flight = Flight("wall", "none").behind(70.0, 62.0, -10.0).until(landed, 100)
    assert landed(flight.world.state)
    assert flight.world.state.uas[0].status == LANDED
    assert Reason.STANDSTILL in flight.reasons
    assert len(flight.reasons) <= 45, "78 where all of the way home is flown slowly"

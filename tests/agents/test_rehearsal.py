"""Flights of `learned-route` are rehearsed before take-off, and go as they were rehearsed."""

from itertools import pairwise

import numpy as np
import pytest
from uas_coverage_agents.policy import load_policy
from uas_coverage_agents.policy.route_networks import RouteNetworks
from uas_coverage_agents.route import policy_runner
from uas_coverage_agents.route.fleet_routes import FleetRoutes
from uas_coverage_agents.route.layers import layers_of
from uas_coverage_agents.route.planner import SHIPPED, LearnedRoute, LearnedRouteOptions
from uas_coverage_agents.route.rehearsal import Rehearsal

from uas_coverage_env import generate_scenario, rollout
from uas_coverage_env.flight import covered_at
from uas_coverage_env.mission import MissionBrief, WorldView
from uas_coverage_env.scenario import Wind
from uas_coverage_env.world import build_arena


@pytest.fixture(scope="module")
def town():
    return generate_scenario(seed=5, n_uas=2, n_waypoints=8, n_obstacles=2)


@pytest.fixture
def searched(monkeypatch):
    """How often a step was searched while it was flown."""
    calls, search = [], policy_runner.plan_along

    def plan_along(*arguments):
        calls.append(arguments[2])
        return search(*arguments)

    monkeypatch.setattr(policy_runner, "plan_along", plan_along)
    return calls


def test_in_still_air_nothing_is_searched_after_take_off(town, searched):
    flight = rollout(town, "learned-route")
    assert flight.covered[-1].all()
    assert len(searched) == 1  # the warm-up


@pytest.mark.parametrize("kind", ["wind", "helicopter"])
def test_in_wind_and_near_what_moves_every_step_is_searched(town, searched, kind):
    if kind == "wind":
        scenario = town.model_copy(update={"wind": Wind(mean_mps=2.0, from_deg=0.0)})
    else:
        scenario = "village"
    rollout(scenario, "learned-route", max_steps=3)
    assert len(searched) > 3


def _rehearsal(scenario):
    brief = MissionBrief.of(scenario)
    policy, view = load_policy(SHIPPED), WorldView(brief)
    network = policy.description.network
    assert isinstance(network, RouteNetworks)
    layers, x = layers_of(network.flight, policy.tensors, "flight."), view.state.x
    return Rehearsal(view.arena, view.arena, layers, x, np.random.default_rng(0))


def test_the_times_of_a_rehearsal_are_those_of_the_flight(town, monkeypatch):
    kept = []

    def reached_s(rehearsal, u, route):
        kept.append((route, known(rehearsal, u, route)))
        return kept[-1][1]

    known = Rehearsal.reached_s
    monkeypatch.setattr(Rehearsal, "reached_s", reached_s)
    covered = covered_at(rollout(town, LearnedRoute(LearnedRouteOptions(rehearsed=1))))
    for route, at_s in kept[-2:]:  # before them, those of the warm-up
        assert at_s[:-1].tolist() == covered[route].tolist()


def test_a_uas_that_is_elsewhere_than_rehearsed_gets_no_more_of_its_commands(town):
    rehearsal, route = _rehearsal(town), np.arange(8)
    rehearsal.take([route, route[:0]])
    start = np.array(build_arena(town).uas["home_m"][0])
    x = np.concatenate([start, np.zeros(11)])
    assert rehearsal.next(0, x, route) is not None
    x[0] += 0.5
    assert rehearsal.next(0, x, route) is None
    assert rehearsal.next(1, x, route) is None


def test_a_uas_with_another_route_than_rehearsed_gets_none_of_its_commands(town):
    rehearsal, route = _rehearsal(town), np.arange(8)
    rehearsal.take([route, route[:0]])
    x = np.concatenate([np.array(build_arena(town).uas["home_m"][0]), np.zeros(11)])
    assert rehearsal.next(0, x, route[::-1]) is None


def test_a_leg_that_took_long_is_left_out_of_the_routes_that_are_built_next(town):
    policy, brief = load_policy(SHIPPED), MissionBrief.of(town)
    network = policy.description.network
    assert isinstance(network, RouteNetworks)
    score, at_home = (layers_of(part, policy.tensors, name) for part, name in (
        (network.order, "order."), (network.home, "home.")
    ))  # fmt: skip
    routes = FleetRoutes(brief, 0, score, at_home, samples=16, changes=2000)
    first = routes.of_all()
    u = int(np.argmax([len(route) for route in first]))
    a, b = first[u][:2]
    reached_s = [np.zeros(len(route) + 1) for route in first]
    reached_s[u][1:] = 500.0
    routes.build_again(reached_s)
    again = [route.tolist() for route in routes.of_all()]
    assert sorted(w for route in again for w in route) == list(range(8))
    assert (a, b) not in {pair for route in again for pair in pairwise(route)}

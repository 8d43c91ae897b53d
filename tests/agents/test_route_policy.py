"""`learned-route`: routes of the whole fleet, and flights along them."""

from dataclasses import replace

import numpy as np
import pytest
from uas_coverage_agents.policy import load_policy
from uas_coverage_agents.policy.route_networks import RouteNetworks
from uas_coverage_agents.route.fleet_routes import RouteProblems
from uas_coverage_agents.route.landing import is_landed, towards_home
from uas_coverage_agents.route.layers import layers_of, value_of
from uas_coverage_agents.route.leg_flight import (
    AHEAD,
    IS_HOME,
    NORTH,
    RADIUS,
    places_ahead,
    steer_along,
)
from uas_coverage_agents.route.leg_plan import plan_along
from uas_coverage_agents.route.leg_search import HORIZON, search_workspace
from uas_coverage_agents.route.order import WEIGHT, build, no_record, route_workspace
from uas_coverage_agents.route.places import detour_s, places_along
from uas_coverage_agents.route.planner import SHIPPED, LearnedRoute, LearnedRouteOptions

from uas_coverage_env import generate_scenario, rollout
from uas_coverage_env.autopilot.control import command_wrench, write_command
from uas_coverage_env.autopilot.lookahead import fixed_slack
from uas_coverage_env.entities.commands import COMMAND_DTYPE, VELOCITY
from uas_coverage_env.flight.metrics import coverage, energy_Wh, home
from uas_coverage_env.mission import MissionBrief, WorldView, first_sight
from uas_coverage_env.mission.raised import raised
from uas_coverage_env.planning.reserves import LEARNED_ROUTE as RESERVE
from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.planning.routing.search import arrays_of
from uas_coverage_env.vehicle.layout import THETA, VX, VY, X
from uas_coverage_env.vehicle.lpv import fly_kinematics
from uas_coverage_env.world import build_arena


@pytest.fixture(scope="module")
def town():
    return generate_scenario(seed=5, n_uas=2, n_waypoints=8, n_obstacles=2)


def _built(scenario, wanted, late=None, works=None):
    brief = MissionBrief.of(scenario)
    policy = load_policy(SHIPPED)
    network = policy.description.network
    assert isinstance(network, RouteNetworks)
    score = layers_of(network.order, policy.tensors, "order.")
    home_score = layers_of(network.home, policy.tensors, "home.")
    late = np.zeros(len(brief.waypoints), np.bool_) if late is None else late
    works = np.ones(len(brief.uas), np.bool_) if works is None else works
    problems = RouteProblems(brief)
    task = arrays_of(problems.seen(first_sight(brief), works, wanted), WEIGHT)
    routes = np.full((len(brief.uas), len(brief.waypoints)), -1)
    lengths = np.zeros(len(brief.uas), np.int64)
    rng = np.random.default_rng(0)
    cost_s = build(
        task, problems.unit_s, score, home_score, np.array([wanted & ~late, wanted & late]), 0.0,
        rng, route_workspace(), no_record(), routes, lengths,
    )  # fmt: skip
    return [routes[u, :n].tolist() for u, n in enumerate(lengths)], cost_s


@pytest.mark.parametrize("n_uas", [1, 3, 32])
def test_one_set_of_weights_gives_every_waypoint_to_exactly_one_uas(n_uas):
    scenario = generate_scenario(seed=1, n_uas=n_uas, n_waypoints=40, n_obstacles=0)
    routes, cost_s = _built(scenario, np.ones(40, np.bool_))
    assert sorted(w for route in routes for w in route) == list(range(40))
    assert np.isfinite(cost_s)


def test_what_a_moving_obstacle_covers_comes_after_everything_else(town):
    late = np.zeros(8, np.bool_)
    late[3] = True
    routes, _ = _built(town, np.ones(8, np.bool_), late=late)
    assert any(route and route[-1] == 3 for route in routes)


def test_a_uas_that_may_not_work_gets_no_waypoint_and_covered_ones_are_left_out(town):
    wanted = np.ones(8, np.bool_)
    wanted[[0, 5]] = False
    routes, _ = _built(town, wanted, works=np.array([True, False]))
    assert routes[1] == []
    assert sorted(routes[0]) == [1, 2, 3, 4, 6, 7]


def test_a_mission_is_accomplished_with_less_energy_than_by_the_nearest_waypoint(town):
    flight = rollout(town, LearnedRoute(LearnedRouteOptions(samples=4)))
    nearest = rollout(town, "nearest-waypoint")
    assert coverage(flight) == 1.0
    assert home(flight).all()
    assert not flight.violations
    assert energy_Wh(flight).sum() < energy_Wh(nearest).sum()


def test_the_same_seed_flies_the_same_mission(town):
    first = rollout(town, LearnedRoute(LearnedRouteOptions(samples=3)), max_steps=20)
    again = rollout(town, LearnedRoute(LearnedRouteOptions(samples=3)), max_steps=20)
    np.testing.assert_array_equal(first.x, again.x)


def test_commands_do_not_depend_on_what_lies_behind_the_arrays_in_memory(town):
    """Tubes end with the lookahead; longer paths were once held against what followed them."""
    view = WorldView(MissionBrief.of(town))
    tube_m = view.arena.tube_m
    policy = load_policy(SHIPPED)
    network = policy.description.network
    assert isinstance(network, RouteNetworks)
    flight = layers_of(network.flight, policy.tensors, "flight.")

    def commands(behind_m):
        memory = np.full(tube_m.size + 100, behind_m)
        memory[: tube_m.size] = tube_m.ravel()
        arena = view.arena._replace(tube_m=memory[: tube_m.size].reshape(tube_m.shape))
        rng, last, command = (
            np.random.default_rng(0),
            len(tube_m) - 1,
            np.zeros(1, COMMAND_DTYPE)[0],
        )
        for _ in range(50):
            x = view.state.x[last].copy()
            x[:3] = *rng.uniform(10.0, 110.0, 2), -20.0
            x[VX], x[VY] = velocity_mps = rng.uniform(-8.0, 8.0, 2)
            targets = rng.permutation(AHEAD)
            steer_along(arena, last, x, velocity_mps, targets, AHEAD, flight, 1, 0.0, command)
            yield command["values"].tolist()

    assert list(commands(0.0)) == list(commands(1e6))


def test_the_networks_of_the_file_are_those_that_are_compiled():
    policy = load_policy(SHIPPED)
    network = policy.description.network
    assert isinstance(network, RouteNetworks)
    rows = np.random.default_rng(0).normal(size=network.inputs)
    layers = layers_of(network.order, policy.tensors, "order.")
    expected = policy.forward(rows)[0]
    assert value_of(layers, rows[: network.order.inputs]) == pytest.approx(expected)


def test_at_full_speed_it_brakes_so_late_that_it_lands_two_steps_after_flying_past_would(town):
    arena = build_arena(town)
    vehicle, uas, rules = arena.vehicles[0], arena.uas[0], arena.rules[0]
    command, u, values = np.zeros(1, COMMAND_DTYPE)[0], np.zeros(5), np.zeros(3)
    x, reference = np.zeros(14), np.array([uas.speed_mps, 0.0])
    x[:3] = uas.home_m
    x[X] -= 60.0
    x[VX], x[THETA] = uas.speed_mps, -vehicle.trim_rad_per_mps * uas.speed_mps
    steps = 0
    while not is_landed(uas, rules, x) and steps < 30:
        towards_home(vehicle, uas, rules, x, reference, values, command)
        write_command(command, VELOCITY, *values)
        command_wrench(vehicle, x, reference, command, u)
        fly_kinematics(vehicle, x, u)
        steps += 1
    assert steps * vehicle.dt_s <= 60.0 / uas.speed_mps + 2.0


@pytest.fixture(scope="module")
def behind_a_house():
    """A UAS, a waypoint, and between them a house somewhat higher than the waypoint."""
    scenario = generate_scenario(seed=5, n_uas=1, n_waypoints=2, n_obstacles=1)
    box_m = [(n, e, d) for n in (50.0, 62.0) for e in (40.0, 60.0) for d in (0.0, -20.0)]
    house = scenario.obstacles[0].model_copy(update={"vertices_m": tuple(box_m)})
    places_m = ((90.0, 50.0, -14.0), (110.0, 70.0, -14.0))
    waypoints = tuple(
        w.model_copy(update={"position_m": at_m, "radius_m": 10.0})
        for w, at_m in zip(scenario.waypoints, places_m, strict=True)
    )
    return scenario.model_copy(update={"obstacles": (house,), "waypoints": waypoints})


def _arenas(scenario):
    brief = MissionBrief.of(scenario)
    higher = raised(brief)
    assert higher is not None
    return WorldView(brief).arena, build_arena(higher.as_scenario())


def _state(north_m, east_m, speed_mps):
    x = np.zeros(14)
    x[:3] = north_m, east_m, -14.0
    x[VX] = speed_mps
    return x


def test_what_takes_longer_to_pass_over_is_passed_round(behind_a_house):
    arena, around = _arenas(behind_a_house)
    x, places, targets = _state(20.0, 50.0, 8.0), np.zeros((AHEAD, 5)), np.arange(AHEAD)
    places_ahead(arena, 0, x, targets, 2, places)
    assert places[0, NORTH] == 90.0  # the world's routes lead over it
    places_along(arena, around, 0, x, targets, 2, places)
    assert places[0, RADIUS] < 10.0  # a corner, and then the waypoint
    assert places[1, NORTH] == 90.0 or places[2, NORTH] == 90.0
    assert places[-1, IS_HOME] == 1.0 or places[-1, NORTH] == 110.0
    to = np.array([90.0, 50.0, -14.0, 10.0, 0.0])
    beside = np.array([20.0, 90.0, -14.0, 10.0, 0.0])
    assert 0.0 < detour_s(around, around, 0, 0, x, to) < 5.0
    assert detour_s(arena, around, 0, 0, x, beside) == 0.0


def test_a_plan_covers_the_waypoint_behind_a_house_and_stays_clear(behind_a_house):
    arena, around = _arenas(behind_a_house)
    policy = load_policy(SHIPPED)
    network = policy.description.network
    assert isinstance(network, RouteNetworks)
    layers = layers_of(network.flight, policy.tensors, "flight.")
    x, reference, plan = _state(20.0, 50.0, 8.0), np.array([8.0, 0.0]), np.zeros((HORIZON, 3))
    workspace = search_workspace(int(arena.rules[0].lookahead_steps))
    assert plan_along(
        arena, around, 0, x, reference, np.arange(2), layers, plan, False,
        np.random.default_rng(0), workspace,
    )  # fmt: skip
    command, u, path_m = np.zeros(1, COMMAND_DTYPE)[0], np.zeros(5), [x[:3].copy()]
    while np.linalg.norm(x[:3] - (90.0, 50.0, -14.0)) > 10.0 and len(path_m) <= HORIZON:
        write_command(command, VELOCITY, *plan[len(path_m) - 1])
        command_wrench(arena.vehicles[0], x, reference, command, u)
        fly_kinematics(arena.vehicles[0], x, u)
        path_m.append(x[:3].copy())
    assert len(path_m) <= 12
    path_m = np.array(path_m)
    assert fixed_slack(arena, 0, path_m, len(path_m) - 1, -1.0, 2.0) >= 0.0


def test_the_way_home_from_here_has_its_landing_but_of_a_uas_that_has_not_set_off(town):
    brief = MissionBrief.of(town)
    swarm = replace(first_sight(brief), departed=np.array([True, False]))
    swarm.x[:, 1] += 40.0
    works, wanted = np.ones(2, np.bool_), swarm.uncovered.copy()
    way_s = Legs(brief).way_home_s(0, swarm.x[0, :3])
    found = RouteProblems(brief).seen(swarm, works, wanted).uas["idle_s"]
    assert way_s > 2.0
    expected_s = RESERVE.legs_share * way_s + RESERVE.landing_s
    assert found == pytest.approx([expected_s, 0.0])
    only = RouteProblems(brief).seen(swarm, np.array([False, True]), wanted)
    assert not only.uas["idle_s"].any()

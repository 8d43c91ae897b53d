"""The fleet as `learned-route` sees it, and its routes, made cheaper by the search of planners."""

import numpy as np
import pytest
from uas_coverage_agents.policy import load_policy
from uas_coverage_agents.route import fleet_routes
from uas_coverage_agents.route.fleet_routes import CHANGES, FleetRoutes, RouteProblems
from uas_coverage_agents.route.layers import layers_of
from uas_coverage_agents.route.order import (
    IN_THE_AIR,
    WEIGHT,
    build,
    home_seconds,
    leg_seconds,
    observe_choices,
    route_workspace,
)
from uas_coverage_agents.route.planner import SHIPPED

from uas_coverage_env import generate_scenario, load_planner
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.planning.routing import SearchEffort, improve_routes
from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.planning.routing.search import arrays_of, routes_of


def town(n_uas, n_waypoints):
    scenario = generate_scenario(seed=3, n_uas=n_uas, n_waypoints=n_waypoints, n_obstacles=4)
    return MissionBrief.of(scenario)


def seen(brief, departed=False):
    swarm = first_sight(brief)
    swarm.departed[:] = departed
    works = np.ones(len(brief.uas), np.bool_)
    return RouteProblems(brief).seen(swarm, works, swarm.uncovered)


def built(brief, changes, seed=0):
    policy = load_policy(SHIPPED)
    network = policy.description.network
    score = layers_of(network.order, policy.tensors, "order.")
    home_score = layers_of(network.home, policy.tensors, "home.")
    routes = FleetRoutes(brief, seed, score, home_score, 4, changes)
    return routes.of_all()


def cost_s(brief, routes):
    effort = SearchEffort(0, total_weight=WEIGHT)
    return improve_routes(seen(brief), routes_of(routes), effort, 0).cost_s


def test_the_way_home_is_96_percent_of_its_leg_and_4_s_to_land():
    brief = town(2, 8)
    problem, legs = seen(brief), Legs(brief)
    assert problem.home_s == pytest.approx(0.96 * legs.home_s + 4.0)
    assert problem.between_s == pytest.approx(0.96 * legs.between_s)
    battery_s = legs.arena.uas["dod_max"] / legs.arena.uas["dod_per_s"]
    until_s = brief.max_steps * brief.dt_s
    assert problem.uas["budget_s"] == pytest.approx(np.minimum(battery_s, until_s) - 14.0)


def test_staying_on_the_ground_takes_no_time_and_coming_home_takes_a_landing():
    brief = town(2, 8)
    assert seen(brief).uas["idle_s"].tolist() == [0.0, 0.0]
    assert seen(brief, departed=True).uas["idle_s"] == pytest.approx([4.0, 4.0], abs=0.1)


def test_a_leg_takes_its_time_and_that_of_the_turn_before_it():
    brief = town(1, 8)
    problem = seen(brief)
    task = arrays_of(problem, WEIGHT)
    assert leg_seconds(task, 0, IN_THE_AIR, 8, 3) == problem.first_s[0, 3]
    straight_s = problem.between_s[0, 3, 5]
    there_and_back = leg_seconds(task, 0, 3, 5, 5)  # from 5 to 3, and back
    assert there_and_back == pytest.approx(straight_s + 1.5 * problem.turn_s[0, 3])
    back_home_s = home_seconds(task, 0, 3, len(task.place) - 1)  # from the start to 3, and back
    assert back_home_s == pytest.approx(problem.home_s[0, 3] + 1.5 * problem.turn_s[0, 3])


def test_no_waypoint_is_offered_that_the_charge_does_not_last_for():
    brief = town(1, 8)
    problem, open_ = seen(brief), np.ones(8, np.bool_)
    there_s = problem.first_s[0] + problem.home_s[0]
    for budget_s in np.sort(there_s) + 0.01:
        task = arrays_of(problem.replace(budget_s=np.array([budget_s])), WEIGHT)
        room = route_workspace()
        n = observe_choices(
            task, 1.0, 0, np.zeros(1), np.array([IN_THE_AIR]), np.array([8]), open_, room
        )
        offered = room.candidates[:n][room.legal[:n]]
        assert sorted(offered) == np.flatnonzero(there_s <= budget_s).tolist()


@pytest.mark.parametrize("n_uas", [1, 3])
def test_changes_make_routes_cheaper_and_each_waypoint_is_still_visited_once(n_uas):
    brief = town(n_uas, 24)
    before, after = built(brief, 0), built(brief, CHANGES)
    assert sorted(np.concatenate(after)) == list(range(24))
    assert cost_s(brief, after) < cost_s(brief, before)


@pytest.mark.parametrize("name", ["learned-velocity", "learned-route"])
def test_a_warm_up_builds_one_set_of_routes_and_the_mission_after_it_all_of_them(name, monkeypatch):
    built = []

    def counted(*arguments):
        built.append(name)
        return build(*arguments)

    monkeypatch.setattr(fleet_routes, "build", counted)
    brief, planner = town(2, 6), load_planner(name)
    planner.reset(brief, 0)
    for_a_mission = len(built)
    planner.warm_up(brief)
    for_a_warm_up = len(built) - for_a_mission
    assert 0 < for_a_warm_up <= 3
    planner.reset(brief, 0)
    assert len(built) - for_a_mission - for_a_warm_up == for_a_mission > 10

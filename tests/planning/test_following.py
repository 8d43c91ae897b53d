"""An order flown under guidance: who is sent where, and when it is searched again."""

import dataclasses

import numpy as np
import pytest
from small_worlds import meadow, mover, waypoint

from uas_coverage_env import MissionBrief, rollout
from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.mission import first_sight
from uas_coverage_env.planning.following import Following, SearchedOrder, Seen, searched_order
from uas_coverage_env.planning.following.searched_order import SearchedAgain
from uas_coverage_env.planning.reserves import TOUR
from uas_coverage_env.planning.routing import (
    RoutingProblem,
    SearchEffort,
    empty_routes,
    search_orders,
)
from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.vehicle.layout import DOD
from uas_coverage_env.world import GoTo

STARTS_M = ((20.0, 20.0, -1.0), (180.0, 20.0, -1.0))
PLACES_M = [(x, y, -15.0) for x in (30.0, 170.0) for y in (60.0, 110.0, 160.0)]
SCENARIO = meadow(STARTS_M, waypoints=[waypoint(place_m, 5.0) for place_m in PLACES_M])
BRIEF = MissionBrief.of(SCENARIO)


class ByRoutes:
    """An order that is given."""

    def __init__(self, *routes):
        self.given, self.seen = routes, []

    def routes(self, seen):
        self.seen.append(seen)
        return [[w for w in route if seen.wanted[w]] for route in self.given]


class Tasks:
    """The routing problem of the mission, and how often it was asked for."""

    def __init__(self):
        self.legs, self.asked = Legs(BRIEF), 0

    def __call__(self, seen, visited):
        self.asked += 1
        swarm = dataclasses.replace(seen.swarm, uncovered=visited)
        return RoutingProblem.seen(BRIEF, swarm, self.legs, seen.works, TOUR)


def first_order(problem, effort, searches, seed):
    """The cheapest of some searches that begin with nothing."""
    tried = [(effort, seed + k) for k in range(searches)]
    return search_orders(problem, empty_routes(problem.n_uas), tried)[0]


class AlongOrder:
    """A planner of some lines."""

    def reset(self, brief, seed):
        self.tasks = Tasks()
        begin = seen_now()
        effort = SearchEffort(2_000)
        order = first_order(self.tasks(begin, begin.wanted), effort, 2, seed)
        self.order = SearchedOrder(self.tasks, order, SearchedAgain(effort, 0, seed))
        self.following = Following(brief, self.order)

    def act(self, swarm):
        return self.following.commands(swarm)


def seen_now(works=(True, True), blocked=(), step=0, covered=()):
    swarm = dataclasses.replace(first_sight(BRIEF), step=step)
    wanted, closed = np.ones(6, bool), np.zeros(6, bool)
    wanted[list(covered)], closed[list(blocked)] = False, True
    return Seen(swarm, np.array(works), wanted, closed)


@pytest.fixture
def tasks():
    return Tasks()


@pytest.fixture
def searched(tasks):
    order = first_order(tasks(seen_now(), np.ones(6, bool)), SearchEffort(2_000), 2, 1)
    made = SearchedOrder(tasks, order, SearchedAgain(SearchEffort(2_000), 0, 1))
    tasks.asked = 0
    return made


def visited(routes):
    return sorted(int(w) for route in routes for w in route)


def test_each_uas_is_sent_to_the_first_of_its_route_and_home_in_the_end():
    following = Following(BRIEF, ByRoutes([2, 0], []))
    assert following.commands(first_sight(BRIEF)) == {
        "uas_1": GoTo(2, mode="covering"), "uas_2": GoTo(None),
    }  # fmt: skip


def test_a_uas_that_has_landed_or_returns_works_no_more_and_gets_no_command_if_landed():
    order = ByRoutes([0], [1])
    following, swarm = Following(BRIEF, order), first_sight(BRIEF)
    returning = np.array([True, False])
    following.commands(dataclasses.replace(swarm, returning=returning))
    assert order.seen[-1].works.tolist() == [False, True]
    status = np.array([FLYING, LANDED])
    commands = following.commands(dataclasses.replace(swarm, status=status))
    assert order.seen[-1].works.tolist() == [True, False]
    assert list(commands) == ["uas_1"]


def test_a_uas_is_called_home_by_its_charge_unless_the_world_does_that():
    swarm = first_sight(BRIEF)
    x = swarm.x.copy()
    x[0, :2], x[0, 2], x[0, DOD] = 190.0, -15.0, 0.745
    empty = dataclasses.replace(swarm, x=x, departed=np.ones(2, bool))
    for calls, works in ((True, [False, True]), (False, [True, True])):
        order = ByRoutes([0], [1])
        Following(BRIEF, order, calls_home=calls).commands(empty)
        assert order.seen[-1].works.tolist() == works


def test_what_moves_blocks_the_waypoints_inside_its_keep_out():
    over = mover((30.0, 60.0, -15.0), (0.0, (0.0, 0.0, 0.0)))
    brief = MissionBrief.of(SCENARIO.model_copy(
        update={"moving_obstacles": meadow(moving_obstacles=[over]).moving_obstacles}
    ))  # fmt: skip
    order = ByRoutes([0], [1])
    Following(brief, order).commands(first_sight(brief))
    assert order.seen[-1].blocked.tolist() == [True, False, False, False, False, False]


def test_an_order_is_kept_while_nothing_happens(searched, tasks):
    before = [route.tolist() for route in searched.routes(seen_now())]
    for step in range(1, 30):
        assert [route.tolist() for route in searched.routes(seen_now(step=step))] == before
    assert tasks.asked == 0


def test_what_is_covered_is_left_out_without_a_search(searched, tasks):
    before = searched.routes(seen_now())
    first = int(before[0][0])
    after = searched.routes(seen_now(covered=[first], step=1))
    assert after[0].tolist() == before[0][1:].tolist()
    assert tasks.asked == 0


def test_the_waypoints_of_a_uas_that_drops_out_go_to_the_other_and_come_back_with_it(searched):
    searched.routes(seen_now())
    routes = searched.routes(seen_now(works=(True, False), step=1))
    assert visited(routes) == list(range(6))
    assert not len(routes[1])
    assert len(searched.routes(seen_now(step=2))[1])


def test_what_is_blocked_waits_until_nothing_else_is_left(searched):
    routes = searched.routes(seen_now(blocked=[0, 5]))
    assert visited(routes) == [1, 2, 3, 4]
    assert visited(searched.routes(seen_now(step=1))) == list(range(6))
    last = searched.routes(seen_now(blocked=[0, 5], covered=[1, 2, 3, 4], step=2))
    assert visited(last) == [0, 5]


def test_it_is_searched_again_after_so_many_steps(tasks):
    order = first_order(tasks(seen_now(), np.ones(6, bool)), SearchEffort(2_000), 1, 1)
    searched = SearchedOrder(tasks, order, SearchedAgain(SearchEffort(100), 10, 1))
    tasks.asked = 0
    for step in range(40):
        searched.routes(seen_now(step=step))
    assert tasks.asked == 4


@pytest.mark.parametrize(("better_s", "changes"), [(0.0, False), (1.9, False), (2.1, True)])
def test_an_order_is_changed_for_one_that_is_better_by_two_seconds(
    tasks, monkeypatch, better_s, changes
):
    order = first_order(tasks(seen_now(), np.ones(6, bool)), SearchEffort(2_000), 1, 1)
    other = dataclasses.replace(order, routes=order.routes[::-1], cost_s=order.cost_s - better_s)

    def improved(problem, known, effort, seed):
        return other if effort.moves else known

    monkeypatch.setattr(searched_order, "improve_routes", improved)
    again = SearchedOrder(tasks, order, SearchedAgain(SearchEffort(100), 1, 1))
    expected = other if changes else order
    routes = again.routes(seen_now())
    assert [route.tolist() for route in routes] == [route.tolist() for route in expected.routes]
    assert again.order.cost_s == expected.cost_s


def test_nothing_is_searched_for_once_all_is_covered(searched, tasks):
    searched.routes(seen_now())
    searched.routes(seen_now(covered=range(6), works=(True, False), step=1))
    searched.routes(seen_now(covered=range(6), step=2))
    assert tasks.asked == 0


def test_a_planner_of_some_lines_flies_a_mission_along_the_cheapest_order():
    flight = rollout(SCENARIO, AlongOrder())
    assert accomplished(flight)
    assert not flight.breaches

"""What turns and setting off cost, and what each kind of move of the search may change."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from test_order_search import COST, SOME, TURNED_DEG, task

from uas_coverage_env.planning.routing import SearchEffort, empty_routes, improve_routes
from uas_coverage_env.planning.routing.clock import CUTTING, STOPPING
from uas_coverage_env.planning.routing.search import OrderSearch, routes_of


def test_turns_cost_what_their_table_says_and_turning_by_90_degrees_saves_time():
    half = len(CUTTING) // 2
    assert CUTTING[[0, half, -1]].tolist() == [1.5, -0.45, 0.0]
    assert STOPPING[[0, half, -1]].tolist() == [1.1, 1.0, 0.0]
    assert STOPPING[round(half * (1.0 + math.cos(math.radians(5.0))))] == 0.0, "no corner"
    places = np.array([(0.0, 0.0), (100.0, 0.0)])
    ways_m = {0: (200.0, 0.0), 45: (171.0, 71.0), 90: (100.0, 100.0), 180: (0.0, 0.0)}
    for turned_deg, end_m in ways_m.items():
        one = task(0, 1, 1).replace(
            waypoints_m=np.array([(100.0, 0.0, -20.0)]),
            position_m=places[:1],
            home_m=np.array([end_m]),
            velocity_mps=np.array([(12.0, 0.0)]),
            first_s=np.array([[10.0]]),
            home_s=np.array([[20.0]]),
            turn_s=np.array([[2.0]]),
        )
        took_s = improve_routes(one, routes_of([np.array([0])]), SearchEffort(0), 0).seconds[0]
        cost = float(np.interp(turned_deg, TURNED_DEG, COST))
        assert took_s == pytest.approx(30.0 + 2.0 * cost, abs=0.05), turned_deg


def test_setting_off_the_other_way_takes_twice_the_time_to_stop():
    one = task(0, 1, 1, turn_s=np.zeros((1, 1)), acceleration_mps2=3.0, speed_mps=12.0)
    towards = one.waypoints_m[0, :2] - one.uas["position_m"][0]
    towards /= np.linalg.norm(towards)
    route, seconds = routes_of([np.array([0])]), []
    for mps in (12.0, 0.0, -12.0):
        flown = one.replace(velocity_mps=mps * towards[None])
        seconds.append(improve_routes(flown, route, SearchEffort(0), 0).seconds[0])
    assert np.diff(seconds) == pytest.approx([12.0 / 6.0, 3.0 * 12.0 / 6.0])


MANY = task(9, 24, 2)


@pytest.mark.parametrize("operator", ["2-opt", "or-opt"])
def test_moves_within_a_route_leave_each_uas_its_waypoints_and_shorten_its_route(operator):
    before = improve_routes(MANY, routes_of([np.arange(12), np.arange(12, 24)]), SearchEffort(0), 0)
    after = improve_routes(MANY, before, SearchEffort(5_000, operators=(operator,)), 0)
    assert [set(route) for route in after.routes] == [set(range(12)), set(range(12, 24))]
    assert after.cost_s < 0.9 * before.cost_s
    for old, new in zip(before.routes, after.routes, strict=True):
        assert old.tolist() != new.tolist()


def test_exchanging_tails_once_makes_routes_of_a_beginning_and_a_tail_each():
    before = improve_routes(MANY, routes_of([np.arange(12), np.arange(12, 24)]), SearchEffort(0), 0)
    effort = SearchEffort(1, hottest_s=1e6, coldest_s=1e5, operators=("2-opt*",))
    searches = [OrderSearch(MANY, before, effort, seed) for seed in range(40)]
    for search in searches:
        search.go_on(1)
    after = [search.best for search in searches if search.best_s < before.cost_s]
    assert after
    for one, two in (order.routes for order in after):
        kept, come = one[one < 12], one[one >= 12]
        assert one.tolist() == [*range(len(kept)), *range(24 - len(come), 24)]
        assert sorted([*one, *two]) == list(range(24))


def test_relocating_alone_shares_the_waypoints_of_one_uas_with_the_other():
    before = improve_routes(MANY, routes_of([np.arange(24), np.zeros(0, int)]), SearchEffort(0), 0)
    after = improve_routes(MANY, before, SearchEffort(5_000, operators=("relocate",)), 0)
    assert all(len(route) > 4 for route in after.routes)
    assert after.cost_s < 0.7 * before.cost_s


def test_without_operators_nothing_changes_and_an_unknown_one_is_named():
    before = routes_of([np.arange(12), np.arange(12, 24)])
    after = improve_routes(MANY, before, SearchEffort(1_000, operators=()), 0)
    assert [route.tolist() for route in after.routes] == [list(range(12)), list(range(12, 24))]
    with pytest.raises(ValueError, match=r"operators: '3-opt' is none of relocate, 2-opt\*, 2-opt"):
        SearchEffort(1, operators=("2-opt", "3-opt"))


def test_only_the_first_waypoints_of_a_route_are_moved_where_a_window_is_asked_for():
    alone = task(9, 24, 1, neighbours=np.zeros((24, 0), np.int64))
    effort = SearchEffort(3_000, window=3, hottest_s=1e-3, coldest_s=1e-4, operators=("or-opt",))
    whole = improve_routes(alone, routes_of([np.arange(24)]), replace(effort, window=0), 0)
    assert np.flatnonzero(whole.routes[0] != np.arange(24)).max() > 10
    # one that a move begins with comes from the first three places
    first = improve_routes(alone, routes_of([np.arange(24)]), replace(effort, moves=1), 3)
    moved = [w for w in range(24) if first.routes[0].tolist().index(w) > w]
    assert all(w < 6 for w in moved)


def test_progress_is_told_from_the_first_order_to_the_best_each_cheaper_than_the_last():
    told = []
    found = improve_routes(MANY, empty_routes(2), SOME, 0, told.append)
    costs_s = [order.cost_s for order in told]
    assert len(told) > 3
    assert costs_s[0] == improve_routes(MANY, empty_routes(2), SearchEffort(0), 0).cost_s
    assert all(later < before for before, later in pairwise(costs_s))
    assert costs_s[-1] == found.cost_s == improve_routes(MANY, empty_routes(2), SOME, 0).cost_s


def test_what_is_replaced_in_a_problem_leaves_the_problem_it_was_made_of_as_it_is():
    less = MANY.replace(budget_s=np.array([10.0, 20.0]), turn_s=np.zeros((2, 24)))
    assert less.uas["budget_s"].tolist() == [10.0, 20.0]
    assert MANY.uas["budget_s"].tolist() == [1000.0, 1000.0]
    assert less.uas["speed_mps"].tolist() == MANY.uas["speed_mps"].tolist()
    with pytest.raises(TypeError, match="budgets"):
        MANY.replace(budgets=np.zeros(2))


def test_a_stretch_that_is_reversed_takes_what_its_legs_take_that_way():
    """Judged by sums along the route, where legs take longer the later they end in the list."""
    windy = task(9, 24, 1)
    windy = windy.replace(between_s=windy.between_s * np.linspace(0.5, 1.5, 24))
    effort = SearchEffort(3_000, by_pieces=True, operators=("2-opt",))
    found = improve_routes(windy, routes_of([np.arange(24)]), effort, 0)
    again = improve_routes(windy, found, SearchEffort(0), 0)
    assert found.seconds == pytest.approx(again.seconds, abs=1e-6)
    assert found.cost_s == pytest.approx(again.cost_s, abs=1e-6)

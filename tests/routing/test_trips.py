"""Orders with fresh packs: what is visited now, what later, and when the mission is over."""

from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_order_search import seconds_of, task

from uas_coverage_env.planning.routing import (
    SearchEffort,
    empty_routes,
    improve_routes,
    search_orders,
)
from uas_coverage_env.planning.routing.trips import FreshPacks, improve_trips

SOME = SearchEffort(20_000)
SWAP_S = 60.0
seeds = st.integers(0, 10_000)
few = settings(max_examples=10, deadline=None, derandomize=True)


def at_home(seed, waypoints, uas, budget_s):
    """The problem of UAS at home, at rest, each of which lasts for so long."""
    made = task(seed, waypoints, uas)
    first_s = made.home_s - 4.0  # of landing
    return made.replace(
        first_s=first_s,
        idle_s=np.zeros(uas),
        position_m=made.uas["home_m"],
        velocity_mps=np.zeros((uas, 2)),
        budget_s=np.full(uas, float(budget_s)),
    )


def packs(home, left, **changes):
    n_uas = home.n_uas
    swap_s = np.full(n_uas, SWAP_S)
    known = {"left": np.full(n_uas, left), "ground_s": swap_s, "swap_s": swap_s, "until_s": 1e4}
    return FreshPacks(problem=lambda: home, **(known | changes))


def found(home, fresh, effort=SOME, seed=0):
    return improve_trips(home, empty_routes(home.n_uas), effort, seed, fresh)


def same(one, other):
    return all(np.array_equal(a, b) for a, b in zip(one.routes, other.routes, strict=True))


def test_where_one_charge_suffices_packs_change_nothing():
    home = at_home(1, 12, 2, 500.0)
    order = found(home, packs(home, 3))
    plain = improve_routes(home, empty_routes(2), SOME, 0)
    assert same(order, plain)
    assert order.cost_s == plain.cost_s
    assert not order.trips


def test_without_a_pack_left_what_does_not_fit_is_left_out():
    home = at_home(1, 20, 2, 60.0)
    order = found(home, None)
    assert len(order.left_out)
    assert same(order, improve_routes(home, empty_routes(2), SOME, 0))


@few
@given(seeds, st.integers(2, 25), st.integers(1, 3), st.floats(70.0, 150.0))
def test_every_waypoint_is_visited_now_or_later_or_left_out(seed, waypoints, uas, budget_s):
    home = at_home(seed, waypoints, uas, budget_s)
    order = found(home, packs(home, 4), SearchEffort(5_000))
    visits = np.concatenate([*order.routes, order.later, order.left_out])
    assert sorted(visits.tolist()) == list(range(waypoints))


@few
@given(seeds, st.integers(1, 3))
def test_no_charge_is_overdrawn_and_the_mission_ends_with_the_last_flight(seed, uas):
    home = at_home(seed, 20, uas, 100.0)
    order = found(home, packs(home, 9))
    ends_s = []
    for u in range(uas):
        trips = order.trips[u] if order.trips else ()
        flown = [seconds_of(home, u, trip) for trip in (order.routes[u], *trips)]
        assert max(flown) <= 100.0 + 0.5  # the turns of the search come from a table
        ends_s.append(sum(flown) + SWAP_S * len(trips))
    if order.trips:
        assert order.mission_s == pytest.approx(max(ends_s), abs=1.0)


def two_fields(budget_s):
    """Home between two groups of three waypoints, 240 m apart: one group for each charge."""
    home = at_home(0, 6, 1, budget_s)
    places = np.array([(x, y, -20.0) for x in (-120.0, 120.0) for y in (-20.0, 0.0, 20.0)])
    away = np.linalg.norm(places[:, :2], axis=1)
    apart = np.linalg.norm(places[:, None, :2] - places[None, :, :2], axis=2)
    return home.replace(
        waypoints_m=places,
        first_s=away[None] / 10.0,
        home_s=away[None] / 10.0 + 4.0,
        between_s=apart[None] / 10.0,
        position_m=np.zeros((1, 2)),
        home_m=np.zeros((1, 2)),
        turn_s=np.zeros((1, 6)),
        neighbours=np.argsort(apart, axis=1, kind="stable")[:, 1:],
    )


def test_a_charge_is_for_one_of_two_fields_where_it_does_not_last_for_both():
    home = two_fields(45.0)
    order = found(home, packs(home, 1))
    fields = [set((route // 3).tolist()) for route in (order.routes[0], *order.trips[0])]
    assert sorted(fields, key=min) == [{0}, {1}]
    assert not len(order.left_out)


def test_a_uas_on_the_ground_is_planned_for_from_when_it_is_ready():
    home = two_fields(45.0)
    on_ground = home.replace(budget_s=np.full(1, -np.inf))
    fresh = packs(home, 2, ground_s=np.array([25.0]))
    order = improve_trips(on_ground, empty_routes(1), SOME, 0, fresh)
    assert not len(order.routes[0])
    flown_s = [seconds_of(home, 0, trip) for trip in order.trips[0]]
    assert len(flown_s) == 2
    assert order.mission_s == pytest.approx(25.0 + SWAP_S + sum(flown_s), abs=1.0)


def test_packs_that_come_too_late_are_not_planned_with():
    home = at_home(1, 20, 2, 60.0)
    order = found(home, packs(home, 3, until_s=90.0))
    assert not order.trips
    assert same(order, improve_routes(home, empty_routes(2), SOME, 0))


def test_no_uas_comes_home_for_nothing_to_fly_with_a_fresh_pack():
    """It has a little less charge than a fresh pack: the next one would last for both fields."""
    fresh_home = two_fields(75.0)
    now = fresh_home.replace(budget_s=np.array([60.0]))
    order = improve_trips(now, empty_routes(1), SOME, 0, packs(fresh_home, 3))
    assert len(order.routes[0])


def test_a_flight_that_is_planned_stays_one_though_its_charge_seems_too_small():
    home = two_fields(45.0)
    whole = found(home, packs(home, 1))
    tight = home.replace(budget_s=np.array([30.0]))
    planned = packs(home, 2, is_planned=np.array([True]))
    assert len(improve_trips(tight, whole, SOME, 0, packs(home, 2)).routes[0]) < 3
    assert set(improve_trips(tight, whole, SOME, 0, planned).routes[0]) == set(whole.routes[0])


def cheapest_with_a_pack_each(home, swap_s, total_weight):
    """The cost of the best order with one fresh pack each, all of which are tried."""
    n, n_uas = home.n_waypoints, home.n_uas
    quickest = [{frozenset(): 0.0} for _ in range(n_uas)]
    for u, chosen in product(range(n_uas), product((False, True), repeat=n)):
        mine = frozenset(np.flatnonzero(chosen).tolist())
        if mine:
            seconds = min(seconds_of(home, u, p) for p in permutations(sorted(mine)))
            quickest[u][mine] = seconds if seconds <= home.uas["budget_s"][u] else np.inf
    best = np.inf
    for flights in product(range(2 * n_uas), repeat=n):
        sets = [
            frozenset(np.flatnonzero(np.array(flights) == f).tolist()) for f in range(2 * n_uas)
        ]
        now, later = sets[:n_uas], sets[n_uas:]
        if any(trip and not first for first, trip in zip(now, later, strict=True)):
            continue
        first_s = [quickest[u][now[u]] for u in range(n_uas)]
        later_s = [quickest[u][later[u]] for u in range(n_uas)]
        waits_s = [swap_s[u] if later[u] else 0.0 for u in range(n_uas)]
        ends_s = np.array([first_s, waits_s, later_s]).sum(axis=0)
        best = min(best, ends_s.max() + total_weight * (sum(first_s) + sum(later_s)))
    return best


@pytest.mark.parametrize(
    ("town", "budget_s", "swap_s"),
    [(3, 45.0, (60.0,)), (2, 50.0, (90.0, 5.0)), (2, 50.0, (5.0, 90.0)), (8, 45.0, (5.0, 90.0))],
)
def test_of_all_orders_with_a_fresh_pack_each_the_cheapest_is_found(town, budget_s, swap_s):
    home = at_home(town, 5, len(swap_s), budget_s)
    swaps_s = np.array(swap_s)
    fresh = packs(home, 1, ground_s=swaps_s, swap_s=swaps_s)
    orders = [found(home, fresh, seed=seed) for seed in range(3)]
    order = min(orders, key=lambda order: order.cost_s)
    assert order.trips
    least_s = cheapest_with_a_pack_each(home, swap_s, SOME.total_weight)
    assert order.cost_s == pytest.approx(least_s, abs=0.3)


def test_several_searches_are_sorted_and_are_what_each_alone_finds_with_any_threads():
    home = at_home(1, 20, 2, 80.0)
    fresh = packs(home, 2)
    searches = [
        (replace(SOME, moves=moves), seed) for moves, seed in ((10, 3), (5_000, 1), (900, 2))
    ]
    alone = [improve_trips(home, empty_routes(2), *search, fresh).cost_s for search in searches]
    for threads in (1, 3):
        orders = search_orders(home, empty_routes(2), searches, fresh, threads)
        assert [order.cost_s for order in orders] == sorted(alone)
    assert search_orders(home, empty_routes(2), [(SOME, 0)])[0].trips == ()


def test_a_later_trip_waits_for_no_release_and_goes_where_a_charge_of_now_must_not():
    home = two_fields(45.0)
    late = home.replace(
        release_s=np.where(np.arange(6) < 3, 1_000.0, 0.0),
        forbidden=np.arange(6)[None] < 3,
    )
    order = found(late, packs(home, 1))
    assert set(order.routes[0]) == {3, 4, 5}
    assert set(order.trips[0][0]) == {0, 1, 2}
    assert not len(order.left_out)


def test_flights_fill_no_more_than_their_share_of_a_budget_but_for_what_is_left_out_otherwise():
    home = at_home(1, 20, 2, 56.0)

    def longest_s(share):
        order = found(home, packs(home, 9, budget_share=share))
        assert not len(order.left_out)
        flights = [(u, order.routes[u]) for u in range(2)]
        flights += [(u, trip) for u in range(2) for trip in order.trips[u]]
        return max(seconds_of(home, u, route) for u, route in flights)

    assert longest_s(1.0) > 0.9 * 56.0
    assert longest_s(0.8) <= 0.84 * 56.0 + 0.5  # the turns of the search come from a table


def test_where_each_far_waypoint_takes_a_pack_of_its_own_so_many_packs_are_planned_with():
    home = at_home(0, 6, 1, 36.5)
    angles = np.radians([0.0, 120.0, 240.0, 60.0, 180.0, 300.0])
    away_m = np.array([150.0] * 3 + [40.0] * 3)
    level_m = away_m[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    apart_m = np.linalg.norm(level_m[:, None] - level_m, axis=2)
    star = home.replace(
        waypoints_m=np.column_stack([level_m, np.full(6, -20.0)]),
        first_s=away_m[None] / 10.0,
        home_s=away_m[None] / 10.0 + 4.0,
        between_s=apart_m[None] / 10.0,
        speed_mps=10.0,
        position_m=np.zeros((1, 2)),
        home_m=np.zeros((1, 2)),
        turn_s=np.zeros((1, 6)),
        neighbours=np.argsort(apart_m, axis=1, kind="stable")[:, 1:],
    )
    order = found(star, packs(star, 5))
    assert not len(order.left_out)
    assert sorted(len(trip) for trip in (order.routes[0], *order.trips[0])) == [1, 1, 1, 3]

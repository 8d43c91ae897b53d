"""The order search: what an order must keep, and the optimum where it can be enumerated."""

import math
from itertools import pairwise, permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from uas_coverage_env.planning.routing import (
    Routes,
    RoutingProblem,
    SearchEffort,
    annealing,
    empty_routes,
    improve_routes,
)
from uas_coverage_env.planning.routing import search as search_module
from uas_coverage_env.planning.routing.clock import CUTTING
from uas_coverage_env.planning.routing.problem import ROUTED_UAS_DTYPE
from uas_coverage_env.planning.routing.search import OrderSearch, routes_of
from uas_coverage_env.planning.routing.window import RouteWindow

SOME = SearchEffort(20_000)
TURNED_DEG, COST = [0.0, 45.0, 90.0, 135.0, 180.0], [0.0, -0.3, -0.45, 0.1, 1.5]
seeds = st.integers(0, 10_000)
few = settings(max_examples=15, deadline=None, derandomize=True)


def task(seed=0, waypoints=8, uas=2, **changes):
    """Random places in 300 m; free legs at the Euclidean distance over the speed."""
    rng = np.random.default_rng(seed)
    places = np.column_stack([rng.uniform(0.0, 300.0, (waypoints, 2)), np.full(waypoints, -20.0)])
    here, start = rng.uniform(0.0, 300.0, (2, uas, 2))
    speed = np.array([12.0, 9.0, 10.0])[:uas]
    apart = np.linalg.norm(places[:, None, :2] - places[None, :, :2], axis=2)
    records = np.zeros(uas, ROUTED_UAS_DTYPE)
    records["kind"] = records["flown_by"] = np.arange(uas)
    records["position_m"], records["home_m"] = here, start
    records["velocity_mps"] = rng.uniform(-5.0, 5.0, (uas, 2))
    records["speed_mps"], records["acceleration_mps2"] = speed, 3.0
    records["idle_s"] = np.linalg.norm(here - start, axis=1) / speed
    records["budget_s"] = 1000.0
    made = RoutingProblem(
        open_waypoints=np.arange(waypoints),
        uas=records,
        first_s=np.linalg.norm(here[:, None] - places[None, :, :2], axis=2) / speed[:, None],
        between_s=apart[None] / speed[:, None, None],
        home_s=np.linalg.norm(start[:, None] - places[None, :, :2], axis=2) / speed[:, None] + 4.0,
        turn_s=15.0 / speed[:, None] * np.ones(waypoints),
        turn_of_cosine=CUTTING,
        waypoints_m=places,
        neighbours=np.argsort(apart, axis=1, kind="stable")[:, 1:],
        weight=np.ones(waypoints),
        release_s=np.zeros(waypoints),
        forbidden=np.zeros((uas, waypoints), bool),
    )
    return made.replace(**changes)


def turn(a, b, c):
    """Cost in radii of turning at b, as the docs say."""
    inward, onward = np.subtract(b, a), np.subtract(c, b)
    length = math.hypot(*inward) * math.hypot(*onward)
    if length < 1e-9:
        return 0.0
    angle = math.degrees(math.acos(max(-1.0, min(1.0, float(inward @ onward) / length))))
    return float(np.interp(angle, TURNED_DEG, COST))


def seconds_of(task, u, route):
    """Flight time of a route, as the docstrings say, in plain Python."""
    if not len(route):
        return float(task.uas["idle_s"][u])
    places = [task.uas["position_m"][u], *task.waypoints_m[list(route), :2], task.uas["home_m"][u]]
    towards = places[1] - places[0]
    wanted = task.uas["speed_mps"][u] * towards / math.hypot(*towards)
    lost = task.uas["velocity_mps"][u] - wanted
    time = float(task.first_s[u, route[0]])
    time += float(lost @ lost) / (2.0 * task.uas["acceleration_mps2"][u] * task.uas["speed_mps"][u])
    time = max(time, task.release_s[route[0]])
    for k, w in enumerate(route):
        time += task.turn_s[u, w] * turn(*places[k : k + 3])
        if k + 1 < len(route):
            time += task.between_s[task.uas["kind"][u], w, route[k + 1]]
            time = max(time, task.release_s[route[k + 1]])
    return float(time + task.home_s[u, route[-1]])


def cost_of(task, seconds, left_out, total_weight):
    """What the search minimises, from the seconds of all UAS."""
    overtime = sum(max(s - b, 0.0) for s, b in zip(seconds, task.uas["budget_s"], strict=True))
    left_s = search_module._left_out_s(task, total_weight)[list(left_out)].sum()
    return max(0.0, *seconds) + total_weight * sum(seconds) + annealing.OVERTIME * overtime + left_s


def cheapest(task, total_weight):
    """The cost of the best order, all of which are tried; nothing is left out."""
    n = task.n_waypoints
    best_s = [{} for _ in range(task.n_uas)]
    for u, chosen in product(range(task.n_uas), product((False, True), repeat=n)):
        mine = [w for w in range(n) if chosen[w]]
        best_s[u][frozenset(mine)] = min(seconds_of(task, u, p) for p in permutations(mine))
    everything = frozenset(range(n))
    if task.n_uas == 1:
        return cost_of(task, [best_s[0][everything]], (), total_weight)
    return min(
        cost_of(task, [s, best_s[1][everything - mine]], (), total_weight)
        for mine, s in best_s[0].items()
    )


def visits(order):
    return sorted(np.concatenate([*order.routes, order.left_out]).tolist())


@few
@given(seeds, st.integers(1, 30), st.integers(1, 3))
def test_every_open_waypoint_is_visited_once_or_left_out(seed, waypoints, uas):
    rng = np.random.default_rng(seed)
    wanted = np.flatnonzero(rng.random(waypoints) < 0.7)
    tight = rng.uniform(20.0, 120.0, uas)
    found = improve_routes(
        task(seed, waypoints, uas, open_waypoints=wanted, budget_s=tight),
        empty_routes(uas),
        SearchEffort(3000),
        seed,
    )
    assert visits(found) == wanted.tolist()


@few
@given(seeds, st.integers(0, 4000), st.sampled_from([0, 3]))
def test_an_order_is_never_worse_than_the_one_it_starts_from(seed, moves, window):
    problem = task(seed, 15)
    before = improve_routes(problem, empty_routes(2), SearchEffort(0), 0)
    after = improve_routes(problem, before, SearchEffort(moves, window=window), seed)
    assert after.cost_s <= before.cost_s + 1e-9


@few
@given(seeds)
def test_the_same_arguments_give_the_same_order(seed):
    problem = task(seed, 20)
    one, two = (improve_routes(problem, empty_routes(2), SearchEffort(5000), 7) for _ in range(2))
    assert [r.tolist() for r in one.routes] == [r.tolist() for r in two.routes]
    assert one.cost_s == two.cost_s


@few
@given(seeds, st.integers(1, 3))
def test_seconds_and_cost_are_those_of_the_routes(seed, uas):
    opens = np.where(np.arange(8) % 3 == 0, 40.0, 0.0)
    problem = task(seed, 8, uas, release_s=opens)
    found = improve_routes(problem, empty_routes(uas), SearchEffort(2000), seed)
    alone = [seconds_of(problem, u, route) for u, route in enumerate(found.routes)]
    assert found.seconds == pytest.approx(alone, abs=0.2)  # turns are tabulated
    total = SearchEffort(0).total_weight
    exact = cost_of(problem, found.seconds, found.left_out, total)
    assert found.cost_s == pytest.approx(exact, abs=1e-6)


@few
@given(seeds, st.integers(1, 3), st.booleans(), st.booleans())
def test_judged_by_pieces_routes_cost_what_they_cost_as_a_whole(seed, uas, alike, late):
    made = task(seed, 12, uas, release_s=np.where(np.arange(12) % 5 == 0, 40.0 * late, 0.0))
    if alike:  # stretches change hands
        same = {"kind": np.zeros(uas, np.int64), "turn_s": np.ones((uas, 12))}
        made = made.replace(**same, between_s=made.between_s * np.linspace(0.8, 1.2, 12))
    found = improve_routes(made, empty_routes(uas), SearchEffort(4000, by_pieces=True), seed)
    again = improve_routes(made, found, SearchEffort(0), 0)
    assert visits(found) == list(range(12))
    assert found.seconds == pytest.approx(again.seconds, abs=1e-6)
    assert found.cost_s == pytest.approx(again.cost_s, abs=1e-6)


@pytest.mark.parametrize(("seed", "waypoints", "uas"), [(0, 7, 1), (1, 7, 2), (2, 6, 2)])
def test_the_search_finds_the_optimum_of_all_orders(seed, waypoints, uas):
    problem = task(seed, waypoints, uas)
    least = cheapest(problem, SOME.total_weight)
    for by_pieces in (False, True):
        effort = SearchEffort(60_000, by_pieces=by_pieces)
        found = min(improve_routes(problem, empty_routes(uas), effort, s).cost_s for s in range(3))
        assert found == pytest.approx(least, abs=0.3)


@pytest.mark.parametrize("by_pieces", [False, True])
def test_with_release_dates_and_forbidden_waypoints_the_search_finds_the_optimum(by_pieces):
    release_s = np.array([0.0, 45.0, 0.0, 30.0, 0.0, 0.0])
    forbidden = np.zeros((2, 6), bool)
    forbidden[0, [0, 2]] = forbidden[1, [5]] = True
    problem = task(11, 6, 2, release_s=release_s, forbidden=forbidden)
    far = problem.replace(  # for the enumeration, to go where one must not takes for ever
        first_s=np.where(forbidden, 1e6, problem.first_s),
        between_s=np.where(forbidden[:, None], 1e6, problem.between_s),
    )
    effort = SearchEffort(60_000, by_pieces=by_pieces)
    found = min(improve_routes(problem, empty_routes(2), effort, s).cost_s for s in range(3))
    assert found == pytest.approx(cheapest(far, SOME.total_weight), abs=0.3)


@few
@given(seeds, st.floats(25.0, 45.0))
def test_waypoints_are_left_out_rather_than_a_battery_emptied(seed, budget_s):
    angles = np.arange(8) * np.pi / 4
    ring = 120.0 * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(8)])
    apart = np.linalg.norm(ring[:, None] - ring, axis=2)
    problem = task(
        seed,
        8,
        waypoints_m=ring,
        position_m=np.zeros((2, 2)),
        home_m=np.zeros((2, 2)),
        first_s=np.full((2, 8), 10.0),
        home_s=np.full((2, 8), 14.0),
        between_s=np.stack([apart / 12.0] * 2),
        idle_s=np.zeros(2),
        velocity_mps=np.zeros((2, 2)),
        turn_s=np.zeros((2, 8)),
        neighbours=np.argsort(apart, axis=1, kind="stable")[:, 1:],
        budget_s=np.full(2, budget_s),
    )
    found = improve_routes(problem, empty_routes(2), SOME, seed)
    # so little overtime is cheaper than a waypoint; the guide's reserve is far more
    dearest_s = search_module._left_out_s(problem, SOME.total_weight).max()
    slight_s = dearest_s / annealing.OVERTIME
    assert (found.seconds <= problem.uas["budget_s"] + slight_s).all()
    assert len(found.left_out)


def test_a_waypoint_far_from_everything_is_flown_to_as_long_as_a_battery_lasts():
    alone = task(7, 1, 1)
    far = alone.replace(first_s=np.full((1, 1), 200.0), home_s=np.full((1, 1), 200.0))
    late = alone.replace(release_s=np.array([500.0]))
    for problem in (far, late):
        enough = problem.replace(budget_s=np.array([1000.0]))
        assert not len(improve_routes(enough, empty_routes(1), SOME, 0).left_out)
    small = far.replace(budget_s=np.array([300.0]))
    assert len(improve_routes(small, empty_routes(1), SOME, 0).left_out)


def test_a_uas_that_may_not_fly_gets_nothing():
    problem = task(3, 10, budget_s=np.array([1000.0, -np.inf]), idle_s=np.zeros(2))
    found = improve_routes(problem, empty_routes(2), SOME, 0)
    assert len(found.routes[1]) == 0
    assert sorted(found.routes[0]) == list(range(10))


@pytest.mark.parametrize("moves", [0, 20_000])
def test_a_lost_uass_waypoints_go_to_the_others(moves):
    problem = task(3, 10)
    before = improve_routes(problem, empty_routes(2), SOME, 0)
    assert len(before.routes[1])
    lost = problem.replace(budget_s=np.array([1000.0, -np.inf]), idle_s=np.zeros(2))
    after = improve_routes(lost, before, SearchEffort(moves), 0)
    assert sorted(after.routes[0]) == list(range(10))


@pytest.mark.parametrize("parts", [(5000,), (1, 63, 900, 10_000)])
def test_a_search_in_parts_finds_what_it_finds_at_once(parts):
    problem, effort = task(8, 20), SearchEffort(5000)
    search = OrderSearch(problem, empty_routes(2), effort, 7)
    for moves in parts:
        assert not search.is_over
        search.go_on(moves)
    assert search.is_over
    whole = improve_routes(problem, empty_routes(2), effort, 7)
    assert search.best.cost_s == whole.cost_s
    assert [r.tolist() for r in search.best.routes] == [r.tolist() for r in whole.routes]


def test_a_waypoint_that_opens_late_is_waited_for():
    problem = task(4, 1, 1)
    opens = 40.0
    late = problem.replace(release_s=np.array([opens]))
    found = improve_routes(late, empty_routes(1), SearchEffort(100), 0)
    back = late.home_s[0, 0] + late.turn_s[0, 0] * turn(
        late.uas["position_m"][0], late.waypoints_m[0, :2], late.uas["home_m"][0]
    )
    assert found.seconds[0] == pytest.approx(opens + back, abs=0.2)


def test_visited_waypoints_vanish_and_new_ones_are_inserted():
    problem = task(5, 10)
    before = improve_routes(problem.replace(open_waypoints=np.arange(8)), empty_routes(2), SOME, 0)
    now = np.array([1, 2, 4, 5, 7, 8, 9])
    after = improve_routes(problem.replace(open_waypoints=now), before, SearchEffort(0), 0)
    assert visits(after) == now.tolist()
    for old, new in zip(before.routes, after.routes, strict=True):
        assert [w for w in old if w in now] == [w for w in new if w < 8]


def test_with_nothing_open_every_uas_goes_home():
    problem = task(6, 5, open_waypoints=np.zeros(0, np.int64))
    found = improve_routes(problem, improve_routes(task(6, 5), empty_routes(2), SOME, 0), SOME, 0)
    assert visits(found) == []
    assert found.seconds == pytest.approx(problem.uas["idle_s"])


def test_one_waypoint_alone_goes_to_some_uas():
    found = improve_routes(task(7, 1), empty_routes(2), SOME, 0)
    assert isinstance(found, Routes)
    assert visits(found) == [0]
    assert not len(found.left_out)


@few
@given(seed=seeds, most=st.integers(2, 5))
def test_searching_the_beginnings_is_searching_the_whole_with_the_rests_as_they_are(seed, most):
    whole = task(seed, waypoints=14, turn_s=np.zeros((2, 14)))
    order = improve_routes(whole, empty_routes(2), SearchEffort(200), seed)
    part = RouteWindow.of(whole, order, most)
    as_it_is = improve_routes(part.problem, part.order, SearchEffort(0), 0)
    assert as_it_is.seconds == pytest.approx(order.seconds)
    assert as_it_is.cost_s == pytest.approx(order.cost_s)
    better = improve_routes(part.problem, as_it_is, SOME, seed)
    joined = part.joined(better)
    assert sorted(np.concatenate(joined.routes)) == list(range(14))
    if all(map(len, better.routes)):  # setting off for the rest at once is not in `idle_s`
        assert improve_routes(whole, joined, SearchEffort(0), 0).cost_s == pytest.approx(
            better.cost_s
        )
    for old, new in zip(order.routes, joined.routes, strict=True):
        if len(old) > most:
            assert new[len(new) - len(old) + most :].tolist() == old[most:].tolist()


def test_a_uas_whose_beginning_is_empty_flies_to_its_rest_at_once():
    whole = task(5, waypoints=14, turn_s=np.zeros((2, 14)))
    order = routes_of([np.arange(7), np.arange(7, 14)])
    part = RouteWindow.of(whole, order, 2)
    nothing = part.problem.replace(open_waypoints=np.zeros(0, int))
    seconds = improve_routes(nothing, part.order, SearchEffort(0), 0).seconds
    for u, rest in enumerate(part.rests):
        legs_s = sum(whole.between_s[whole.uas["kind"][u], a, b] for a, b in pairwise(rest))
        there_s = whole.first_s[u, rest[0]] + legs_s + whole.home_s[u, rest[-1]]
        assert seconds[u] == pytest.approx(there_s)
    ends_m = [part.problem.uas["home_m"][u].tolist() for u in range(2)]
    assert ends_m == [whole.waypoints_m[w, :2].tolist() for w in (2, 9)], "turns are towards it"


def test_what_no_battery_reaches_stays_left_out_when_beginnings_are_searched():
    neighbours = np.array([[(w + 1) % 14, (w + 2) % 14] for w in range(14)])
    whole = task(5, waypoints=14, budget_s=np.full(2, 60.0), neighbours=neighbours)
    order = improve_routes(whole, empty_routes(2), SOME, 0)
    part = RouteWindow.of(whole, order, 2)
    assert len(order.left_out)
    assert any(map(len, part.rests))
    joined = part.joined(improve_routes(part.problem, part.order, SOME, 1))
    assert sorted(np.concatenate([*joined.routes, joined.left_out])) == list(range(14))


def test_short_routes_are_searched_as_a_whole():
    whole = task(3)
    order = improve_routes(whole, empty_routes(2), SOME, 0)
    part = RouteWindow.of(whole, order, 8)
    assert part.problem is whole
    assert [r.tolist() for r in part.joined(order).routes] == [r.tolist() for r in order.routes]


@few
@given(seeds, st.booleans())
def test_no_uas_is_sent_where_it_must_not_go(seed, by_pieces):
    forbidden = np.zeros((2, 12), bool)
    forbidden[0, :4] = forbidden[1, 3:6] = True
    problem = task(seed, 12, forbidden=forbidden)
    nothing = np.zeros(0, np.int64)
    against = Routes((np.arange(12), nothing), nothing, np.zeros(2), np.inf)
    found = improve_routes(problem, against, SearchEffort(4000, by_pieces=by_pieces), seed)
    for u, route in enumerate(found.routes):
        assert not forbidden[u, route].any()
    assert found.left_out.tolist() == [3], "no UAS may go there"

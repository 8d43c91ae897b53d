"""Routes that were built become cheaper by changes, and stay routes that may be flown."""

from itertools import permutations

import numpy as np
import pytest
from uas_coverage_agents.route.clock import IN_THE_AIR, home_seconds, leg_seconds
from uas_coverage_agents.route.improvement import CHANGES, improve
from uas_coverage_agents.route.mission import MissionMaker

from uas_coverage_env import generate_scenario
from uas_coverage_env.mission import MissionBrief, first_sight


def _mission(n_uas, n_waypoints, late=(), works=None):
    scenario = generate_scenario(seed=3, n_uas=n_uas, n_waypoints=n_waypoints, n_obstacles=4)
    brief = MissionBrief.of(scenario)
    works = np.ones(n_uas, np.bool_) if works is None else np.array(works)
    return MissionMaker(brief).mission(
        first_sight(brief), works, np.isin(np.arange(n_waypoints), late)
    )


def _route_s(mission, u, route):
    """Time of a route, leg by leg."""
    place, before_m, time_s = IN_THE_AIR, mission.here_m[u], 0.0
    for w in route:
        time_s += leg_seconds(mission, u, place, before_m, w)
        before_m = mission.here_m[u] if place == IN_THE_AIR else mission.place_m[place]
        place = w
    return time_s + home_seconds(mission, u, place, before_m) if len(route) else 0.0


def _cost_s(mission, routes):
    times_s = [_route_s(mission, u, route) for u, route in enumerate(routes)]
    return max(times_s) + mission.weight * sum(times_s)


def _improved(mission, routes, changes=CHANGES, seed=0, spare_s=0.0):
    n_waypoints = len(mission.place_m)
    array, lengths = np.full((len(routes), n_waypoints), -1), np.zeros(len(routes), np.int64)
    for u, route in enumerate(routes):
        array[u, : len(route)], lengths[u] = route, len(route)
    improve(mission, changes, spare_s, np.random.default_rng(seed), array, lengths)
    return [array[u, :n].tolist() for u, n in enumerate(lengths)]


def test_a_short_route_becomes_the_best_of_all_orders():
    mission = _mission(1, 7)
    best_s = min(_cost_s(mission, [order]) for order in permutations(range(7)))
    for start in ([0, 1, 2, 3, 4, 5, 6], [6, 0, 5, 1, 4, 2, 3]):
        assert _cost_s(mission, _improved(mission, [start])) == pytest.approx(best_s)


@pytest.mark.parametrize("seed", range(5))
def test_a_fleet_shares_the_waypoints_anew_and_still_visits_each_once(seed):
    mission = _mission(3, 24)
    before = [list(range(24)), [], []]
    after = _improved(mission, before, seed=seed)
    assert sorted(w for route in after for w in route) == list(range(24))
    assert _cost_s(mission, after) < 0.7 * _cost_s(mission, before)


@pytest.mark.parametrize("changes", [0, 1, 10, 100])
def test_few_changes_never_make_a_mission_costlier(changes):
    mission = _mission(2, 16)
    before = _improved(mission, [list(range(8)), list(range(8, 16))])
    for seed in range(20):
        after = _improved(mission, before, changes, seed)
        assert _cost_s(mission, after) <= _cost_s(mission, before) + 1e-9
        assert changes or after == before


def test_what_a_moving_obstacle_covers_stays_last_in_each_route():
    mission = _mission(2, 16, late=[2, 9, 11])
    after = _improved(mission, [[0, 1, 3, 4, 5, 6, 7, 2], [8, 10, 12, 13, 14, 15, 9, 11]])
    assert sorted(w for route in after for w in route) == list(range(16))
    for route in after:
        is_late = mission.late[route]
        assert (np.diff(is_late.astype(int)) >= 0).all()


def test_a_uas_that_may_not_work_gets_nothing():
    mission = _mission(2, 12, works=[True, False])
    after = _improved(mission, [list(range(12)), []])
    assert after[1] == []


def test_no_route_becomes_longer_than_the_charge_allows():
    mission = _mission(2, 16)._replace(weight=0.0)
    before, spare_s = [list(range(16)), []], 5.0
    allowed_s = 10.0 + min(_route_s(mission, 1, [w]) for w in range(16))
    assert _route_s(mission, 1, _improved(mission, before)[1]) > allowed_s
    limited = mission._replace(budget_s=np.array([1000.0, allowed_s + spare_s]))
    after = _improved(limited, before, spare_s=spare_s)
    assert 0.0 < _route_s(mission, 1, after[1]) <= allowed_s

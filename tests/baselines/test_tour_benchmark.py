import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from uas_coverage_env.planning.routing import empty_routes
from uas_coverage_env.scenario import generate_scenario

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import tour


@pytest.fixture(scope="module")
def task():
    return tour.problem(generate_scenario(3, n_uas=2, n_waypoints=8, n_obstacles=2))


def by_hand(task, routes):
    """What flying routes costs, from the definition: legs, turns of the table, setting off."""
    seconds = []
    for u, route in enumerate(routes):
        between = task.between_s[task.kind[u]]
        time_s = task.first_s[u, route[0]] + task.home_s[u, route[-1]]
        time_s += sum(between[a, b] for a, b in pairwise(route))
        way_m = np.vstack([task.position_m[u], task.waypoints_m[route, :2], task.start_m[u]])
        steps_m = np.diff(way_m, axis=0)
        for k, w in enumerate(route):
            before, after = steps_m[k], steps_m[k + 1]
            cosine = before @ after / np.linalg.norm(before) / np.linalg.norm(after)
            angle_deg = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
            radii = np.interp(angle_deg, [0, 45, 90, 135, 180], [0, -0.3, -0.45, 0.1, 1.5])
            time_s += task.turn_s[u, w] * radii
        # from rest to full speed costs half of speed over acceleration
        seconds.append(time_s + 0.5 * task.speed_mps[u] / task.acceleration_mps2[u])
    return np.array(seconds)


def test_the_judge_adds_legs_turns_and_setting_off_and_weighs_the_longest_flight(task):
    routes = tuple(np.array(route) for route in ([0, 3, 1, 5], [2, 4, 7, 6]))
    judged = tour.judged(task, routes)
    seconds = by_hand(task, routes)
    np.testing.assert_allclose(judged.seconds, seconds, atol=0.05)  # turns are tabulated
    assert judged.cost_s == pytest.approx(seconds.max() + 0.4 * seconds.sum(), abs=0.1)


def test_the_judge_charges_for_what_is_left_out_and_keeps_it_out(task):
    routes = tuple(np.array(route) for route in ([0, 3, 1, 5], [2, 4, 7]))
    judged = tour.judged(task, routes)
    np.testing.assert_array_equal(judged.left_out, [6])
    seconds = by_hand(task, routes)
    there_s = float((task.first_s[:, 6] + task.home_s[:, 6] - task.idle_s).min())
    left_out = 120.0 * task.weight[6] + 1.4 * max(there_s, 0.0)
    assert judged.cost_s == pytest.approx(seconds.max() + 0.4 * seconds.sum() + left_out, abs=0.1)


def test_the_judge_forbids_a_route_that_the_battery_does_not_last_for(task):
    routes = tuple(np.array(route) for route in ([0, 3, 1, 5], [2, 4, 7, 6]))
    weak = replace(task, budget_s=np.array([np.inf, 10.0]))
    assert tour.judged(weak, routes).cost_s > tour.judged(task, routes).cost_s + 1000.0


def test_a_short_annealing_is_no_worse_than_putting_waypoints_in_where_they_cost_least(task):
    inserted = tour.improve_routes(task, empty_routes(task.n_uas), tour.SearchEffort(0), 0)
    assert tour.annealed(task, 0.1).cost_s <= inserted.cost_s

"""The benchmark beside routing libraries: what they are given is what our search is given."""

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import routing_peers


@pytest.mark.parametrize(("uas", "waypoints"), [(1, 12), (2, 10)])
def test_along_the_arcs_of_the_libraries_our_orders_cost_what_our_search_says(uas, waypoints):
    problem = routing_peers.problem_of(uas, waypoints, 1)
    problem = problem.replace(turn_s=np.zeros_like(problem.turn_s))
    found = routing_peers.own(problem, 0.6, 0.01, 0)
    seconds = []
    for u, route in enumerate(found.routes):
        places = [waypoints + u, *route, waypoints + u] if route else []
        arcs_s = routing_peers._arcs_s(problem, u)
        seconds.append(sum(arcs_s[a, b] for a, b in pairwise(places)))
    assert sorted(w for route in found.routes for w in route) == list(range(waypoints))
    cost = max(seconds) + 0.6 * sum(seconds)
    assert found.trace[:, 1].min() == pytest.approx(cost, abs=1e-6)


def test_more_waypoints_than_a_battery_lasts_for_are_a_problem_all_the_same():
    problem = routing_peers.problem_of(1, 60, 1)
    assert problem.n_uas == 1
    assert problem.n_waypoints == 60
    assert problem.first_s.shape == (1, 60)

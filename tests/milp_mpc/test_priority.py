"""What a waypoint saves of the tree that connects what is open, against its definition."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import cdist
from uas_coverage_baselines.milp_mpc.model.priority import seconds_saved

from uas_coverage_env.scenario import load_scenario


def by_definition(places, speed_mps):
    """The tree of all, less the tree of all but one; solved anew for each."""

    def tree_s(rest):
        # scipy takes zero, and what is nearly so, for no edge
        between = np.maximum(cdist(rest[:, :2], rest[:, :2]) / speed_mps, 1e-6)
        return float(minimum_spanning_tree(between).sum()) if len(rest) > 1 else 0.0

    whole = tree_s(places)
    saved = [whole - tree_s(np.delete(places, w, axis=0)) for w in range(len(places))]
    return np.maximum(saved, 0.0)


def test_a_waypoint_at_the_fringe_saves_more_of_the_way_than_one_in_the_middle():
    row = np.array([(10.0 * k, 0.0, -5.0) for k in (0, 1, 2, 3, 10)])
    saved = seconds_saved(row, 10.0, np.arange(5))
    assert saved == pytest.approx([1.0, 0.0, 0.0, 0.0, 7.0])


@pytest.mark.parametrize("places", [[], [(1.0, 2.0, -5.0)], [(1.0, 2.0, -5.0), (1.0, 2.0, -15.0)]])
def test_a_tree_of_few_waypoints_saves_nothing_and_raises_nothing(places):
    places = np.array(places).reshape(-1, 3)
    saved = seconds_saved(places, 10.0, np.arange(len(places)))
    assert saved.tolist() == [0.0] * len(places)


def test_the_villages_waypoints_save_what_the_definition_says():
    places = np.array([w.position_m for w in load_scenario("village").waypoints], float)
    saved = seconds_saved(places, 12.0, np.arange(len(places)))
    assert saved == pytest.approx(by_definition(places, 12.0), abs=1e-9)
    assert saved.max() > 1.0


# whole numbers, so that many distances tie and some waypoints stand above each other
coordinate = st.integers(0, 9).map(lambda tens: 10.0 * tens)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(places=st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=2, max_size=30))
def test_any_waypoints_save_what_the_definition_says(places):
    places = np.array(places)
    expected = by_definition(places, 10.0)
    assert seconds_saved(places, 10.0, np.arange(len(places))) == pytest.approx(expected, abs=1e-5)


def test_what_some_of_a_thousand_save_is_what_they_save_when_all_are_asked():
    places = np.random.default_rng(0).uniform(0.0, 900.0, (1000, 3))
    rows = np.array([977, 3, 500, 4])
    every = seconds_saved(places, 12.0, np.arange(1000))
    assert seconds_saved(places, 12.0, rows).tolist() == every[rows].tolist()

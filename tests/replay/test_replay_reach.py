"""The area from which home can still be reached, beside the way home of `mission.Range`."""

import numpy as np
import pytest

from uas_coverage_env.mission import MissionBrief, Range
from uas_coverage_env.replay.reach_data import GRID, reach
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.vehicle.layout import DOD, N_STATES


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("village")


@pytest.fixture(scope="module")
def found(scenario):
    return reach(scenario)


def test_the_grid_spans_the_fence_at_the_height_of_the_highest_waypoint(scenario, found):
    corners_m = scenario.fence.vertices_m
    assert found.needed_soc.shape == (len(scenario.uas), GRID, GRID)
    for axis, values_m in enumerate((found.north_m, found.east_m)):
        assert values_m[0] == corners_m[:, axis].min()
        assert values_m[-1] == pytest.approx(corners_m[:, axis].max())
    assert found.height_m == max(-waypoint.position_m[2] for waypoint in scenario.waypoints)


def test_a_uas_that_arrives_with_what_is_needed_has_enough_for_home(scenario, found):
    range_ = Range(MissionBrief.of(scenario))
    rng = np.random.default_rng(0)
    x = np.zeros(N_STATES)
    for _ in range(60):
        i, row, column = (int(rng.integers(n)) for n in found.needed_soc.shape)
        x[:3] = (found.north_m[row], found.east_m[column], -found.height_m)
        x[DOD] = 1.0 - found.needed_soc[i, row, column]
        # the charge is that of a battery nearly empty, which gives no more than one that is full
        assert 0.0 <= range_.spare_dod(i, x) < 0.02


def test_a_flight_there_takes_no_more_than_estimated(scenario, found):
    range_ = Range(MissionBrief.of(scenario))
    x = np.zeros(N_STATES)
    # a flight home of the same length takes as long as one out, and is estimated with its landing
    for i, uas in enumerate(scenario.uas):
        x[DOD] = uas.dod_max
        home_m = np.array(uas.start_m)
        costs = []
        for way_m in (50.0, 150.0):
            x[:3] = home_m - (way_m, 0.0, 0.0)
            costs.append(range_.home(i, x).dod)
        per_m = (costs[1] - costs[0]) / 100.0
        assert found.per_m[i] >= per_m
        assert found.fixed[i] > 0.0

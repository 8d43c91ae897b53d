"""What is stated of a mission's wind and vehicles: bounds, and nothing of what is drawn."""

import itertools

import pytest

from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Uncertainty, Wind, load_scenario, with_disturbances
from uas_coverage_env.scenario.checks import out_of_reach
from uas_coverage_env.scenario.conditions import conditions_of
from uas_coverage_env.scenario.levels import DISTURBANCE_LEVELS


def wind(mean_mps, **more):
    return Wind(mean_mps=mean_mps, from_deg=0.0, **more)


@pytest.mark.parametrize("level", DISTURBANCE_LEVELS)
def test_all_winds_of_a_level_are_stated_alike_and_so_planners_know_none_of_them(level):
    field = load_scenario("open_field")
    drawn = [with_disturbances(field, level, seed) for seed in range(20)]
    assert len({scenario.wind.mean_mps for scenario in drawn}) > 10
    stated = drawn[0].conditions
    assert stated is not None
    assert all(scenario.conditions == stated for scenario in drawn)
    assert stated.mean_mps == DISTURBANCE_LEVELS[level].mean_mps[1]
    assert stated.uncertainty == DISTURBANCE_LEVELS[level].uncertainty
    told = [MissionBrief.of(scenario).model_dump(exclude={"name"}) for scenario in drawn]
    assert all(each == told[0] for each in told)


def test_a_stronger_level_states_more():
    field = load_scenario("open_field")
    stated = [with_disturbances(field, level, 0).conditions for level in DISTURBANCE_LEVELS]
    for weak, strong in itertools.pairwise(stated):
        assert weak.mean_mps < strong.mean_mps
        assert weak.unknown_mps < strong.unknown_mps
        assert 0.5 < strong.charge_share < weak.charge_share < 1.0


@pytest.mark.parametrize(("mean_mps", "stated"), [(2.0, 4.0), (7.0, 7.0), (10.1, 15.0)])
def test_a_wind_is_stated_by_the_weakest_bound_that_holds(mean_mps, stated):
    conditions = conditions_of(wind(mean_mps), None)
    assert conditions.mean_mps == stated
    assert conditions.unknown_mps == 0.0  # it blows steadily, and is found out
    assert conditions.charge_share == 1.0


def test_gusts_are_stated_by_their_peak_and_nothing_by_nothing():
    gusts = ({"at_s": 5.0, "lasts_s": 4.0, "peak_mps": 6.0, "from_deg": 0.0},)
    assert conditions_of(wind(2.0, gusts=gusts), None).unknown_mps == pytest.approx(3.9)
    assert conditions_of(None, None) is None
    assert conditions_of(wind(0.0), Uncertainty()) is None
    assert conditions_of(None, Uncertainty(mass=0.1)).unknown_mps == 0.0
    assert MissionBrief.of(load_scenario("open_field")).conditions is None


def test_a_waypoint_in_a_narrow_place_is_out_of_reach_with_more_room_asked_for():
    field = load_scenario("open_field")
    low, high = field.fence.vertices_m.min(axis=0), field.fence.vertices_m.max(axis=0)
    beside = field.waypoints[0].model_copy(
        update={"position_m": (low[0] + 5.0, *(0.5 * (low + high))[1:]), "radius_m": 2.0}
    )
    narrow = field.model_copy(update={"waypoints": (*field.waypoints, beside)})
    last = len(field.waypoints)
    assert out_of_reach(narrow, 0.0) == []
    assert last not in out_of_reach(narrow, 5.0)
    assert last in out_of_reach(narrow, 8.0)

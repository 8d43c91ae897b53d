"""Families of missions: one of them by name and seed, and what ranges may be."""

import pytest

from uas_coverage_env import load_scenario, uas_coverage_v0
from uas_coverage_env.scenario import GeneratedScenarios


def test_one_mission_of_a_family_is_flown_by_its_name_and_seed():
    assert uas_coverage_v0.parallel_env(scenario="open-field:7").scenario == load_scenario(
        "open-field:7"
    )
    many = uas_coverage_v0.parallel_env(scenario="generated")
    many.reset(options={"scenario": "generated:7"})
    assert many.scenario.waypoints == load_scenario("generated:7").waypoints


@pytest.mark.parametrize(
    "wrong", [{"n_uas": (3, 1)}, {"n_obstacles": 4}, {"n_waypoints": (1.0, 2)}]
)
def test_ranges_are_two_whole_numbers(wrong):
    with pytest.raises(ValueError, match="least and most"):
        GeneratedScenarios(**wrong)

"""The disturbances that a scenario asks for."""

from uas_coverage_env.disturbances.wind import constant_wind
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world.disturbance import Disturbance, checked_disturbances


def disturbances_of(scenario: Scenario) -> tuple[Disturbance, ...]:
    """What acts in a scenario; empty where nothing does.

    Raises:
        ValueError: The table of another package makes no disturbance, or two have one name.
    """
    found = [table.disturbance() for _, table in scenario.disturbances]
    wind = scenario.wind
    if wind is not None and (wind.mean_mps != 0.0 or wind.up_mps != 0.0):
        found.insert(0, constant_wind(wind.mean_mps, wind.from_deg, wind.up_mps))
    return checked_disturbances(found)

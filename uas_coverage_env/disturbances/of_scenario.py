"""The disturbances that a scenario asks for."""

from uas_coverage_env.disturbances.wind import constant_wind
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world.disturbance import Disturbance


def disturbances_of(scenario: Scenario) -> tuple[Disturbance, ...]:
    """What acts in a scenario; empty in still air."""
    wind = scenario.wind
    if wind is None or (wind.mean_mps == 0.0 and wind.up_mps == 0.0):
        return ()
    return (constant_wind(wind.mean_mps, wind.from_deg, wind.up_mps),)

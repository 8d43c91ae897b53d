"""Missions with something that moves."""

from uas_coverage_env.scenario import Scenario


def with_balloon(scenario: Scenario, start_m, velocity_mps) -> Scenario:
    """The scenario with something that moves, always at the same velocity."""
    balloon = {
        **{"name": "balloon", "radius_m": 4.0, "height_m": 8.0, "safe_distance_m": 3.0},
        "start_m": start_m,
        "schedule": [{"from_s": 0.0, "velocity_mps": velocity_mps}],
    }
    data = scenario.model_dump(by_alias=True) | {"moving_obstacles": [balloon]}
    return Scenario.model_validate(data)

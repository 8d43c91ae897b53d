"""Missions without obstacles, for the tests of the bounds."""

from small_worlds import box, waypoint

from uas_coverage_env.scenario import Scenario


def plain(starts_m, waypoints_m, radius_m=12.0, soc_0=1.0, **changes):
    """A square of 500 m with a ceiling at 50 m."""
    data = {
        "schema": 1,
        "name": "plain",
        "dt_s": 1.0,
        "max_steps": 600,
        "landing_distance_m": 2.0,
        "landing_speed_mps": 0.5,
        "uas_safe_distance_m": 5.0,
        "geofence": {
            "margin_m": 0.5,
            "vertices_m": box("fence", (0.0, 0.0, -50.0), (500.0, 500.0, 0.0))["vertices_m"],
        },
        "obstacles": (),
        "moving_obstacles": (),
        "waypoints": tuple(waypoint(tuple(place), radius_m) for place in waypoints_m),
        "uas": tuple(
            {
                "name": f"uas_{i + 1}",
                "vehicle": "s500_v2",
                "start_m": start_m,
                "soc_0": soc_0,
                "radius_m": 0.36,
                "dod_max": 0.75,
            }
            for i, start_m in enumerate(starts_m)
        ),
    }
    return Scenario.model_validate(data | changes)

"""Small missions with waypoints that are hard to reach, and walls."""

from itertools import product

from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario

TOWER = ((90.0, 90.0, -30.0), (110.0, 110.0, 0.0))


def mission(*waypoints, obstacles=(), dt_s=1.0):
    """A field of 200 m with a ceiling at 50 m; waypoints are (position, radius)."""

    def corners(low, high):
        return list(product(*zip(low, high, strict=True)))

    data = {
        "schema": 1,
        "name": "hard",
        "dt_s": dt_s,
        "max_steps": 1200,
        "landing_distance_m": 2.0,
        "landing_speed_mps": 0.5,
        "uas_safe_distance_m": 5.0,
        "geofence": {"margin_m": 0.5, "vertices_m": corners((0.0, 0.0, -50.0), (200.0, 200.0, 0))},
        "obstacles": [
            {"name": f"tower_{row}", "safe_distance_m": 3.0, "vertices_m": corners(*box)}
            for row, box in enumerate(obstacles)
        ],
        "uas": [
            {
                "name": "uas_1",
                "vehicle": "s500_v2",
                "start_m": (20.0, 20.0, -1.0),
                "soc_0": 1.0,
                "radius_m": 0.36,
                "dod_max": 0.75,
            }
        ],
        "waypoints": [
            {"position_m": position, "radius_m": radius, "weight": 1.0}
            for position, radius in waypoints
        ],
    }
    return MissionBrief.of(parse(data, Scenario, "hard"))

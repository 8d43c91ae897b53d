"""Small missions for the tests of the world."""

import itertools

from uas_coverage_env.scenario import Scenario


def box(name, low, high, safe_distance_m=2.0):
    """A box-shaped obstacle between two corners."""
    corners = tuple(itertools.product(*zip(low, high, strict=True)))
    return {"name": name, "safe_distance_m": safe_distance_m, "vertices_m": corners}


def mover(start_m, *schedule, radius_m=4.0, height_m=6.0, safe_distance_m=3.0, name="mover"):
    """A moving obstacle; `schedule` is pairs of (from_s, velocity)."""
    return {
        "name": name,
        "radius_m": radius_m,
        "height_m": height_m,
        "safe_distance_m": safe_distance_m,
        "start_m": start_m,
        "schedule": tuple({"from_s": s, "velocity_mps": v} for s, v in schedule),
    }


def waypoint(position_m, radius_m=10.0, weight=1.0):
    """A waypoint."""
    return {"position_m": position_m, "radius_m": radius_m, "weight": weight}


def meadow(
    starts_m=((100.0, 100.0, -1.0),),
    *,
    obstacles=(),
    moving_obstacles=(),
    waypoints=(),
    soc_0=1.0,
    dod_max=0.75,
    max_steps=300,
    dt_s=1.0,
    min_height_m=0.0,
):
    """A square of 200 m with a ceiling at 50 m, and what is put into it."""
    return Scenario.model_validate(
        {
            "schema": 1,
            "name": "meadow",
            "dt_s": dt_s,
            "max_steps": max_steps,
            "landing_distance_m": 2.0,
            "landing_speed_mps": 0.5,
            "uas_safe_distance_m": 5.0,
            "min_height_m": min_height_m,
            "geofence": {
                "margin_m": 0.5,
                "vertices_m": box("fence", (0.0, 0.0, -50.0), (200.0, 200.0, 0.0))["vertices_m"],
            },
            "obstacles": tuple(obstacles),
            "moving_obstacles": tuple(moving_obstacles),
            "waypoints": tuple(waypoints) or (waypoint((190.0, 190.0, -40.0), 5.0),),
            "uas": tuple(
                {
                    "name": f"uas_{i + 1}",
                    "vehicle": "s500_v2",
                    "start_m": start_m,
                    "soc_0": soc_0,
                    "radius_m": 0.36,
                    "dod_max": dod_max,
                }
                for i, start_m in enumerate(starts_m)
            ),
        }
    )

"""Short missions whose scenes change, for batches and GPUs."""

from practice_grounds import box, practice_ground

from uas_coverage_env.scenario import Scenario

STEPS = 16
ZONE_M = box((95.0, 140.0, -40.0), (115.0, 160.0, 0.0))
EVENTS = (
    {"kind": "waypoint_added", "at_s": 2.0, "position_m": (130.0, 100.0, -10.0), "radius_m": 8.0},
    {"kind": "waypoint_dropped", "at_s": 3.0, "waypoint": 1},
    {"kind": "obstacle_added", "rate_per_h": 1500.0, "name": "crane", "safe_distance_m": 2.0,
     "vertices_m": box((70.0, 20.0, -30.0), (80.0, 30.0, 0.0))},
    {"kind": "no_fly_zone", "at_s": 4.0, "name": "zone", "safe_distance_m": 2.0,
     "vertices_m": ZONE_M},
    {"kind": "moving_obstacle_added", "at_s": 5.0, "name": "kite", "radius_m": 3.0,
     "height_m": 5.0, "safe_distance_m": 2.0, "position_m": (20.0, 180.0, -20.0),
     "velocity_mps": (1.0, 0.0, 0.0)},
    {"kind": "moving_obstacle_turns", "at_s": 6.0, "moving_obstacle": "balloon_0",
     "velocity_mps": (0.0, -2.0, 0.0)},
    {"kind": "home_closed", "rate_per_h": 900.0, "alternative_m": (90.0, 112.0, -10.0)},
    {"kind": "uas_lost", "rate_per_h": 200.0},
    {"kind": "radio_lost", "at_s": 5.0, "for_s": 4.0, "then": "hover"},
    {"kind": "planner_lost", "at_s": 9.0, "then": "return"},
    {"kind": "gnss_lost", "at_s": 3.0, "for_s": 5.0, "drift_mps": 1.0},
    {"kind": "late_start", "at_s": 3.0, "uas": "uas_1"},
    {"kind": "motor_degraded", "at_s": 5.0, "thrust_share": 0.9, "power_factor": 1.3},
    {"kind": "charge_lost", "rate_per_h": 300.0, "share": 0.1},
)  # fmt: skip
AGAIN = {"waypoints": (
    {"position_m": (112.0, 100.0, -10.0), "radius_m": 8.0, "weight": 1.0,
     "again_after_s": (2.0, 3.0)},
    {"position_m": (140.0, 100.0, -10.0), "radius_m": 8.0, "weight": 1.0,
     "again_after_s": (4.0,)},
)}  # fmt: skip


def mission(*events, n_uas=2, **more):
    """A short mission in which something happens."""
    ground = practice_ground(n_uas=n_uas, n_moving=1, max_steps=STEPS)
    data = ground.model_dump(by_alias=True) | {"events": events, **more}
    return Scenario.model_validate(data)


EVERYTHING = mission(*EVENTS, relaunch=True, **AGAIN)

"""A small scenario for the tests of environments and pictures, as bare or as full as asked for."""

from uas_coverage_env.scenario import (
    Geofence,
    MovingObstacle,
    Obstacle,
    Scenario,
    ScheduledVelocity,
    Sensor,
    Uas,
    Waypoint,
)


def box(low, high):
    """The eight corners of a box."""
    return tuple(
        (x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])
    )


def practice_ground(
    *,
    n_uas: int = 2,
    waypoints_m=((60.0, 100.0, -10.0), (140.0, 100.0, -10.0), (100.0, 150.0, -10.0)),
    weights=None,
    tower: bool = False,
    n_moving: int = 0,
    vehicles=("s500_v2",),
    soc_0: float = 1.0,
    max_steps: int = 60,
    size_m: float = 200.0,
) -> Scenario:
    """A field of 200 m by 200 m by 40 m; UAS start in its middle, 20 m apart, 10 m up."""
    weights = weights or [1.0] * len(waypoints_m)
    obstacles = ()
    if tower:
        corners = box((95.0, 60.0, -30.0), (105.0, 70.0, 0.0))
        obstacles = (Obstacle(name="tower", safe_distance_m=2.0, vertices_m=corners),)
    moving = tuple(
        MovingObstacle(
            name=f"balloon_{m}",
            radius_m=4.0,
            height_m=6.0,
            safe_distance_m=5.0,
            start_m=(20.0 + 25.0 * m, 160.0, -20.0),
            schedule=(ScheduledVelocity(from_s=0.0, velocity_mps=(0.5, 0.0, 0.0)),),
        )
        for m in range(n_moving)
    )
    fleet = tuple(
        Uas(
            name=f"uas_{i + 1}",
            vehicle=vehicles[i % len(vehicles)],
            start_m=(100.0 + 20.0 * (i - (n_uas - 1) / 2), 100.0, -10.0),
            soc_0=soc_0,
            radius_m=0.4,
            dod_max=0.75,
        )
        for i in range(n_uas)
    )
    points = tuple(
        Waypoint(position_m=position, radius_m=8.0, weight=weight)
        for position, weight in zip(waypoints_m, weights, strict=True)
    )
    return Scenario(
        schema=1,
        name="practice",
        dt_s=1.0,
        max_steps=max_steps,
        landing_distance_m=2.0,
        landing_speed_mps=0.5,
        uas_safe_distance_m=3.0,
        geofence=Geofence(margin_m=0.5, vertices_m=box((0.0, 0.0, -40.0), (size_m, size_m, 0.0))),
        obstacles=obstacles,
        moving_obstacles=moving,
        uas=fleet,
        waypoints=points,
    )


def with_roles(scenario: Scenario) -> Scenario:
    """The same, every second waypoint for what the last UAS carries, which looks where it flies."""
    fleet = list(scenario.uas)
    role = {"sensors": (Sensor(name="thermal"),), "heading": "course"}
    fleet[-1] = fleet[-1].model_copy(update=role)
    asked = {"sensor": "thermal", "heights_m": (5.0, 15.0), "max_speed_mps": 4.0}
    waypoints = [
        waypoint.model_copy(update=asked if w % 2 == 0 else {})
        for w, waypoint in enumerate(scenario.waypoints)
    ]
    return scenario.model_copy(update={"uas": tuple(fleet), "waypoints": tuple(waypoints)})

"""Missions in which walls or no-fly zones close off a waypoint, and others are open."""

from small_worlds import box, meadow, waypoint

HOME = (20.0, 20.0, -1.0)
OPEN = ((60.0, 30.0, -10.0), (30.0, 150.0, -10.0))
INSIDE = (130.0, 130.0, -10.0)


def ring(top_m=50.0, gap_m=0.0, half_m=25.0, kind="no_fly", name="zone"):
    """Four walls around `INSIDE`, one with a gap; 4 m thick, 2 m of safe distance."""
    north, east, down = INSIDE[0], INSIDE[1], -top_m
    out = half_m + 4.0
    walls = {
        "south": ((north - out, east - out), (north - half_m, east + out)),
        "north": ((north + half_m, east - out), (north + out, east + out)),
        "west": ((north - half_m, east - out), (north + half_m, east - half_m)),
        "east": ((north - half_m, east + half_m), (north + half_m - gap_m, east + out)),
    }
    return [
        box(f"{name}_{side}", (*low, down), (*high, 0.0)) | {"kind": kind}
        for side, (low, high) in walls.items()
    ]


def yard(obstacles=None, radius_m=5.0, **fields):
    """Two open waypoints, and between them in number one inside a ring."""
    places = [
        waypoint(OPEN[0], 8.0),
        waypoint(INSIDE, radius_m),
        waypoint(OPEN[1], 8.0),
    ]
    obstacles = ring() if obstacles is None else obstacles
    return meadow((HOME,), obstacles=obstacles, waypoints=places, **{"max_steps": 400} | fields)

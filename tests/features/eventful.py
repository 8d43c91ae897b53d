"""Small missions in which something happens."""

from small_worlds import box, meadow, waypoint

from uas_coverage_env import World
from uas_coverage_env.world import Velocity

STARTS_M = ((20.0, 20.0, -1.0), (180.0, 20.0, -1.0))
WAYPOINTS = tuple(
    waypoint((north_m, east_m, -20.0), 8.0)
    for north_m in (40.0, 100.0, 160.0)
    for east_m in (40.0, 100.0, 160.0)
)


def field(*events, sensing=None, **more):
    """Two UAS, nine waypoints, and what happens."""
    given = {"waypoints": WAYPOINTS, "starts_m": STARTS_M, **more}
    scenario = meadow(given.pop("starts_m"), **given)
    return scenario.model_copy(update={"events": events, "sensing": sensing})


def event(kind, at_s=10.0, **fields):
    """A table `[[events]]`."""
    return {"kind": kind, "at_s": at_s, **fields}


def corners_m(low, high):
    """Of a box, for `vertices_m`."""
    return box("any", low, high)["vertices_m"]


def after(world, n_steps, command=None):
    """The world some steps later, every UAS flying the same command."""
    for _ in range(n_steps):
        world.step(dict.fromkeys(world.active, command or Velocity(2.0, 0.0, 20.0)))
    return world


def hovering(*events, **more):
    """A world in which UAS begin in the air."""
    starts_m = ((40.0, 40.0, -20.0), (160.0, 40.0, -20.0))
    far = (waypoint((190.0, 190.0, -40.0), 5.0),)
    return World(field(*events, **{"starts_m": starts_m, "waypoints": far, **more}))

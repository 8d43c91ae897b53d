"""Small missions, and their flights, for the tests of `trajectory`."""

import numpy as np
from small_worlds import box, meadow, waypoint
from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.flight_model import reduced_state
from uas_coverage_baselines.trajectory.retiming import draft, finished
from uas_coverage_baselines.trajectory.work import done

from uas_coverage_env.mission import MissionBrief, first_sight

FIELD = (
    waypoint((40.0, 120.0, -20.0)),
    waypoint((90.0, 170.0, -14.0)),
    waypoint((160.0, 150.0, -25.0)),
    waypoint((170.0, 60.0, -12.0)),
    waypoint((60.0, 40.0, -18.0)),
)
TOWER = box("tower", (110.0, 110.0, -45.0), (140.0, 140.0, 0.0))
HOUSE = box("house", (60.0, 70.0, -9.0), (100.0, 95.0, 0.0))


def field(**changes):
    """A field of five waypoints with a tower and a house."""
    known = {"obstacles": (TOWER, HOUSE), "waypoints": FIELD}
    return meadow(**(known | changes))


def fleet_of(scenario, margin_m=0.3):
    """The fleet of a scenario and its first sight."""
    brief = MissionBrief.of(scenario)
    return Fleet(brief, margin_m), first_sight(brief)


def start_of(swarm, uas=0):
    return reduced_state(swarm.x[uas])


def every_waypoint(scenario):
    return np.arange(len(scenario.waypoints))


def quickest(fleet, start, route, budget):
    """The quickest flight of a fleet's first UAS along a route."""
    program = fleet.programs[0]
    begun = done(draft(program, fleet.terrain, 0, start, route, budget))
    return done(finished(program, start, route, begun))

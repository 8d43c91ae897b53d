"""A plan that simulated autopilots are streamed, over loopback and in time that they drive."""

from functools import cache

import numpy as np
import pytest
from simulated_vehicle import (
    DrivenClock,
    SimulatedVehicle,
)
from small_worlds import box, meadow, waypoint

pytest.importorskip("pyproj")

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.operations import LocalFrame
from uas_coverage_env.operations.stream import StreamOptions, stream_flight
from uas_coverage_env.operations.stream.timeline import timeline_of
from uas_coverage_env.scenario import Execution, Place

HERE = Place(latitude_deg=47.0, longitude_deg=8.0)
FRAME = LocalFrame(HERE)
STARTS_M = (60.0, 60.0, -1.0), (60.0, 120.0, -1.0)


@cache
def plan_of_two():
    """A plan past a wall, of two UAS."""
    waypoints = [waypoint((160.0, east, -20.0)) for east in (60.0, 120.0)]
    by = Execution(flown_by="autopilot", speed_mps=9.0)
    wall = box("wall", (80.0, 150.0, -40.0), (199.0, 154.0, 0.0))
    scenario = meadow(STARTS_M, waypoints=waypoints, obstacles=[wall]).model_copy(
        update={"place": HERE, "execution": by}
    )
    return rollout(scenario, load_planner("lawnmower"))


class Loopback:
    def __init__(
        self,
        flight,
        *,
        stop_s=np.inf,
        kinds=(SimulatedVehicle, SimulatedVehicle),
        vehicles=({}, {}),
        **options,
    ):
        self.vehicles = [
            kind(FRAME, start_m, **how)
            for kind, start_m, how in zip(kinds, STARTS_M, vehicles, strict=True)
        ]
        self.flight, self.said = flight, []
        self.clock, self.options = DrivenClock(self.vehicles, stop_s), StreamOptions(**options)

    def fly(self, then_s=0.0):
        """Fly, and let vehicles fly on alone for a while after the stream has ended."""
        addresses = {f"uas_{n + 1}": one.address for n, one in enumerate(self.vehicles)}
        try:
            return stream_flight(self.flight, HERE, addresses, self.options, self.clock, self.tell)
        finally:
            self.ended_s = self.clock.now_s()
            for _ in range(round(10.0 * then_s)):
                self.clock.wait(0.1)
            for vehicle in self.vehicles:
                vehicle.close()

    def tell(self, line):
        self.said.append((self.clock.now_s(), line))

    def says(self, text):
        """When a line with a text was said first."""
        return next((time_s for time_s, line in self.said if text in line), None)


def off_m(vehicle, flight, uas, before_s=np.inf):
    """How far the vehicle was from its path above 4 m, at most."""
    plan = timeline_of(flight, uas)
    path = np.array([plan.place_m(t) for t in np.arange(plan.first_s, plan.last_s, 0.05)])
    flown = np.array(vehicle.path)
    flown = flown[(flown[:, 3] < -4.0) & (flown[:, 0] < before_s), 1:]
    return max(np.linalg.norm(path - place, axis=1).min() for place in flown)


def apart_m(loop):
    """Least distance of the two in the air."""
    one, other = (np.array(vehicle.path)[:, 1:] for vehicle in loop.vehicles)
    up = (one[:, 2] < -2.0) & (other[:, 2] < -2.0)
    return np.linalg.norm(one[up] - other[up], axis=1).min()


def is_home(vehicle, uas):
    away_m = np.linalg.norm(vehicle.place_m - (*STARTS_M[uas][:2], 0.0))
    return not vehicle.armed and away_m < 3.0

"""A mission of a few seconds and a planner that flies it by list."""

import tomllib

import pytest

from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world import GoTo

YARD = """
schema = 1
name = "yard"
dt_s = 1.0
max_steps = 80
landing_distance_m = 2.0
landing_speed_mps = 0.5
uas_safe_distance_m = 3.0
geofence.margin_m = 0.5
geofence.vertices_m = [
  [0, 0, 0], [100, 0, 0], [100, 120, 0], [0, 120, 0],
  [0, 0, -40], [100, 0, -40], [100, 120, -40], [0, 120, -40],
]
waypoints = [
  { position_m = [20, 30, -4], radius_m = 6, weight = 1 },
  { position_m = [50, 30, -10], radius_m = 8, weight = 2 },
  { position_m = [45, 90, -8], radius_m = 8, weight = 1 },
]

[[obstacles]]
name = "shed"
safe_distance_m = 1.0
vertices_m = [
  [80, 50, 0], [90, 50, 0], [90, 70, 0], [80, 70, 0],
  [80, 50, -6], [90, 50, -6], [90, 70, -6], [80, 70, -6],
]

[[moving_obstacles]]
name = "kite"
radius_m = 2.0
height_m = 4.0
safe_distance_m = 3.0
start_m = [95, 10, -30]
schedule = [{ from_s = 0, velocity_mps = [0, 0.5, 0] }]

[[uas]]
name = "left"
vehicle = "s500_v2"
start_m = [20, 30, -1]
soc_0 = 1.0
radius_m = 0.36
dod_max = 0.75

[[uas]]
name = "right"
vehicle = "s500_v2"
start_m = [20, 90, -1]
soc_0 = 0.8
radius_m = 0.36
dod_max = 0.75
"""


class Listed:
    """Flies each UAS through its own list of waypoints, then home."""

    def __init__(self, **routes):
        self.routes = routes

    def reset(self, scenario, seed):
        self.seen = []

    def act(self, swarm):
        self.seen.append(swarm.step)
        return {name: GoTo(self._next(name, swarm)) for name in swarm.active}

    def _next(self, name, swarm):
        return next((i for i in self.routes.get(name, ()) if swarm.uncovered[i]), None)


@pytest.fixture(scope="session")
def yard() -> Scenario:
    return parse(tomllib.loads(YARD), Scenario, "yard")


@pytest.fixture
def listed():
    return Listed(left=[1], right=[2])


@pytest.fixture(scope="session")
def flight(yard):
    """The yard flown once; nobody changes it, as it is frozen."""
    from uas_coverage_env.flight import rollout

    return rollout(yard, Listed(left=[1], right=[2]), seed=3)

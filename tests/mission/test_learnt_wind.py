"""What a planner finds out of the wind from the states that it is told."""

import numpy as np
from small_worlds import meadow, waypoint

from uas_coverage_env import MissionBrief, World
from uas_coverage_env.mission.learnt_wind import MEAN_HEIGHT_M, LearntWind
from uas_coverage_env.scenario import Wind
from uas_coverage_env.vehicle.layout import Z
from uas_coverage_env.world import Velocity

FIELD = meadow(((100.0, 100.0, -30.0),), waypoints=(waypoint((150.0, 100.0, -30.0)),))


def learnt(wind, steps=20, height_m=30.0):
    """The wind that is learnt in so many steps, and that of the world's inner loop."""
    scenario = FIELD.model_copy(update={"wind": wind})
    world, learnt = World(scenario), LearntWind(MissionBrief.of(scenario))
    learnt.see(world.swarm_state())
    for _ in range(steps):
        world.step({"uas_1": Velocity(0.5, -0.5, height_m)})
        learnt.see(world.swarm_state())
    return learnt, world


def test_it_is_the_wind_that_the_inner_loop_finds_out():
    turbulent = Wind(mean_mps=5.0, from_deg=200.0, turbulence=1.0)
    known, world = learnt(turbulent)
    np.testing.assert_allclose(known.wind_mps, world.state.uas["belief"][:, :2], atol=1e-6)
    assert np.hypot(*known.wind_mps[0]) > 3.0


def test_the_mean_wind_of_a_fleet_is_that_at_one_height():
    shear = Wind(mean_mps=5.0, from_deg=270.0, reference_height_m=20.0, roughness_m=0.05)
    high, world = learnt(shear, steps=40)
    assert -world.state.x[0, Z] > 25.0
    low, world = learnt(shear, steps=40, height_m=5.0)
    assert -world.state.x[0, Z] < 8.0
    assert shear.reference_height_m == MEAN_HEIGHT_M
    for known in (high, low):
        np.testing.assert_allclose(known.mean_mps, (0.0, 5.0), atol=0.4)
    assert high.wind_mps[0, 1] - low.wind_mps[0, 1] > 1.0

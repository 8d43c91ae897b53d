"""The world takes over from a plan in mid-manoeuvre, as where home moves: no limit is exceeded."""

import numpy as np
import pytest
from small_worlds import meadow, waypoint

from uas_coverage_env.flight import rollout
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.world import GoTo, Wrench

S500 = load_vehicle("s500_v2")


class TurnsHard:
    """Torques on both axes for a step, as a plan may; then whatever the world does."""

    def __init__(self, roll, pitch):
        inertia = S500.airframe.inertia_kgm2
        self.torques = inertia[0] * roll, inertia[1] * pitch

    def reset(self, brief, seed):
        pass

    def act(self, swarm):
        if swarm.step == 0:
            return {name: Wrench(0.0, *self.torques, 0.0) for name in swarm.active}
        return {name: GoTo(0) for name in swarm.active}


def field(**more):
    scenario = meadow(
        ((100.0, 100.0, -20.0),), waypoints=[waypoint((180.0, 180.0, -20.0), 5.0)], max_steps=40
    )
    return Scenario.model_validate(scenario.model_dump(by_alias=True) | more)


CLOSED = {
    "kind": "home_closed",
    "at_s": 1.0,
    "uas": "uas_1",
    "alternative_m": (20.0, 20.0, -20.0),
}


@pytest.mark.parametrize("roll", [0.35, -0.35])
@pytest.mark.parametrize("pitch", [0.35, -0.35])
@pytest.mark.parametrize("events", [(), (CLOSED,)], ids=["planner hands over", "home moves"])
def test_no_tilt_beyond_the_limit_is_flown_where_the_world_takes_over(roll, pitch, events):
    flight = rollout(field(events=events), TurnsHard(roll, pitch))
    # it was in mid-manoeuvre: left alone, the tilt would be far beyond its limit a step later
    later = flight.x[1, 0, 6:8] + flight.x[1, 0, 9:11]
    assert np.linalg.norm(later) > 1.5 * S500.limits.tilt_max_rad
    assert flight.violations == ()
    assert np.linalg.norm(flight.x[:, 0, 6:8], axis=1).max() <= 1.01 * S500.limits.tilt_max_rad

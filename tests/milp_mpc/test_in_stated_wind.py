"""Where wind is stated, `milp-mpc` flies its order under the world's guidance."""

from itertools import pairwise

import pytest
from small_worlds import meadow, waypoint

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.scenario import Wind
from uas_coverage_env.world import GoTo

PLACES_M = ((150.0, 100.0, -12.0), (150.0, 150.0, -12.0), (100.0, 150.0, -12.0))
STARTS_M = ((100.0, 100.0, -1.0), (20.0, 20.0, -1.0))
WIND = Wind(mean_mps=3.0, from_deg=240.0, turbulence=1.0, reference_height_m=20.0, roughness_m=0.05)


@pytest.fixture(scope="module")
def mission():
    """The flight, and what was commanded of each UAS at each sample."""
    field = meadow(STARTS_M, waypoints=[waypoint(place, 5.0) for place in PLACES_M])
    planner, commanded = load_planner("milp-mpc", {"threads": 1}), []
    act = planner.act
    planner.act = lambda swarm: commanded.append(act(swarm)) or commanded[-1]
    return rollout(field.model_copy(update={"wind": WIND}), planner, seed=2), commanded


def test_it_covers_all_and_comes_home_by_commands_of_places_alone(mission):
    flight, commanded = mission
    assert accomplished(flight)
    assert all(isinstance(one, GoTo) for commands in commanded for one in commands.values())


def test_each_waypoint_is_flown_to_once_along_the_shortest_way(mission):
    _, commanded = mission
    near, far = (
        [commands[name].waypoint for commands in commanded if name in commands]
        for name in ("uas_1", "uas_2")
    )
    order = [near[0], *(now for before, now in pairwise(near) if now != before)]
    assert order in ([0, 1, 2, None], [2, 1, 0, None])
    assert set(far) <= {None}

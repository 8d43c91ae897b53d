"""Which UAS the rule of return mode calls home, as planners apply it that fly home themselves."""

import dataclasses

import numpy as np
import pytest
from small_worlds import meadow, waypoint

from uas_coverage_env import MissionBrief, World
from uas_coverage_env.mission import Recall, WorldView, first_sight
from uas_coverage_env.scenario.air import Gust, Wind
from uas_coverage_env.vehicle import DOD
from uas_coverage_env.world import LANDED, Velocity

STARTS_M = ((20.0, 20.0, -1.0), (60.0, 20.0, -1.0))


@pytest.fixture
def seen():
    """Called for a moment, what the rule answers; of two UAS at home."""
    brief = MissionBrief.of(meadow(STARTS_M))
    view, recall, first = WorldView(brief), Recall(brief), first_sight(brief)

    def ask(dod=0.1, **changes):
        x = first.x.copy()
        x[0, DOD] = dod
        swarm = dataclasses.replace(first, x=x, **changes)
        view.update(swarm)
        return recall.update(swarm, view).tolist()

    return ask


def test_a_uas_is_called_home_when_its_charge_is_needed_for_the_way(seen):
    assert seen(0.1) == [False, False]
    assert seen(0.74) == [True, False]


def test_a_uas_that_was_called_home_is_until_it_lands(seen):
    seen(0.74)
    assert seen(0.1) == [True, False]


def test_a_uas_that_landed_and_takes_off_with_a_fresh_pack_works_again(seen):
    seen(0.74)
    assert seen(0.74, status=np.array([LANDED, 0], np.int8)) == [False, False]
    assert seen(0.1) == [False, False]


def test_a_uas_that_the_world_calls_home_is_called(seen):
    assert seen(0.1, returning=np.array([False, True])) == [False, True]


def test_a_uas_that_the_world_called_for_a_while_works_again(seen):
    seen(0.1, returning=np.array([False, True]))
    assert seen(0.1) == [False, False]


def test_all_are_called_when_nothing_is_left_to_cover(seen):
    assert seen(0.1, uncovered=np.array([False])) == [True, True]


def calls(wind, dod, steps=60):
    """Whether the rule calls a UAS at each sample, that hovers far downwind of home."""
    far = meadow(((20.0, 100.0, -1.0),), waypoints=(waypoint((190.0, 100.0, -20.0), 3.0),))
    world = World(far.model_copy(update={"wind": wind, "max_steps": 2000}))
    world.state.x[0, :3] = 170.0, 100.0, -20.0
    world.state.departed[0] = True
    brief = MissionBrief.of(world.scenario)
    view, recall = WorldView(brief), Recall(brief)
    result = []
    for _ in range(steps):
        world.state.x[0, DOD] = dod
        swarm = world.swarm_state()
        view.update(swarm)
        result.append(bool(recall.update(swarm, view)[0]))
        world.step({"uas_1": Velocity(0.0, 0.0, 20.0)})
    return result


def test_a_uas_is_called_earlier_where_it_has_to_fly_home_against_the_wind():
    against, with_it = (Wind(mean_mps=9.0, from_deg=from_deg) for from_deg in (180.0, 0.0))
    assert any(calls(against, 0.68))
    assert not any(calls(with_it, 0.68))
    assert not any(calls(None, 0.68))


def test_a_uas_that_a_gust_has_called_works_again_when_it_is_over():
    gust = Gust(at_s=20.0, lasts_s=10.0, peak_mps=6.0, from_deg=180.0)
    samples = calls(Wind(mean_mps=6.0, from_deg=180.0, gusts=(gust,)), 0.3)
    assert any(samples[20:35])
    assert not any(samples[:20] + samples[50:])


def test_in_wind_a_uas_that_lacks_charge_is_called_until_it_lands():
    samples = calls(Wind(mean_mps=6.0, from_deg=180.0), 0.72)
    assert samples[-1]
    assert samples == sorted(samples)

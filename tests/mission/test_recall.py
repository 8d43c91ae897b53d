"""Which UAS the rule of return mode calls home, as planners apply it that fly home themselves."""

import dataclasses

import numpy as np
import pytest
from small_worlds import meadow

from uas_coverage_env import MissionBrief
from uas_coverage_env.mission import LearntWind, Recall, WorldView, first_sight
from uas_coverage_env.vehicle import DOD
from uas_coverage_env.world import CONSUMPTION, LANDED
from uas_coverage_env.world.state import WIND

STARTS_M = ((20.0, 20.0, -1.0), (60.0, 20.0, -1.0))


@pytest.fixture
def seen():
    """Called for a moment, what the rule answers; of two UAS at home."""
    brief = MissionBrief.of(meadow(STARTS_M))
    view, recall, first = WorldView(brief), Recall(2), first_sight(brief)

    def ask(dod=0.1, learnt=None, **changes):
        x = first.x.copy()
        x[0, DOD] = dod
        swarm = dataclasses.replace(first, x=x, **changes)
        view.update(swarm)
        return recall.update(swarm, view, learnt).tolist()

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


def called_from_dod(north_mps=0.0, consumption=0.0):
    """Depth of discharge from which on a UAS 140 m north of home is called in what it learnt."""
    brief = MissionBrief.of(meadow(STARTS_M))
    view, first, learnt = WorldView(brief), first_sight(brief), LearntWind(brief)
    learnt.belief[:, WIND] = north_mps
    learnt.belief[:, CONSUMPTION] = consumption
    for dod in np.arange(0.6, 0.75, 5e-4):
        x = first.x.copy()
        x[0, 0] += 140.0
        x[0, DOD] = dod
        swarm = dataclasses.replace(first, x=x)
        view.update(swarm)
        if Recall(2).update(swarm, view, learnt)[0]:
            return dod
    return 1.0


def test_in_a_learnt_headwind_a_uas_is_called_the_earlier_the_stronger_it_is():
    calm, light, strong = map(called_from_dod, (0.0, 3.0, 8.0))
    assert strong + 0.01 < light < calm


def test_a_uas_that_is_seen_to_draw_more_charge_is_called_earlier():
    assert called_from_dod(consumption=0.3) + 0.005 < called_from_dod() == called_from_dod(0, -0.2)


def test_a_learnt_wind_does_not_keep_a_uas_out_that_has_nothing_to_cover(seen):
    learnt = LearntWind(MissionBrief.of(meadow(STARTS_M)))
    assert seen(0.1, learnt) == [False, False]
    assert seen(0.1, learnt, uncovered=np.array([False])) == [True, True]

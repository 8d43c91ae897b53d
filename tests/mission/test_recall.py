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


@pytest.fixture
def far():
    """Called for a charge and what was learnt, whether a UAS 140 m north of home is called."""
    brief = MissionBrief.of(meadow(STARTS_M))
    view, first, learnt = WorldView(brief), first_sight(brief), LearntWind(brief)

    def ask(recall, dod, north_mps=0.0, consumption=0.0):
        x = first.x.copy()
        x[0, 0] += 140.0
        x[0, DOD] = dod
        swarm = dataclasses.replace(first, x=x)
        view.update(swarm)
        learnt.belief[:, WIND] = north_mps
        learnt.belief[:, CONSUMPTION] = consumption
        return bool(recall.update(swarm, view, learnt)[0])

    return ask


@pytest.mark.parametrize("learnt", [{"north_mps": 8.0}, {"consumption": 0.4}])
def test_in_a_headwind_and_where_more_charge_is_drawn_a_uas_is_called_earlier(far, learnt):
    dods = np.arange(0.6, 0.75, 5e-4)
    calm, called = (
        next(dod for dod in dods if far(Recall(2), dod, **what)) for what in ({}, learnt)
    )
    assert called + 0.005 < calm


def test_less_charge_drawn_than_believed_is_not_relied_on(far):
    for dod in np.arange(0.6, 0.75, 5e-3):
        assert far(Recall(2), dod) == far(Recall(2), dod, consumption=-0.2)


def test_a_call_in_a_gust_ends_with_it_where_charge_is_ample(far):
    recall = Recall(2)
    assert [far(recall, 0.3, wind_mps) for wind_mps in (0.0, 12.0, 0.0)] == [False, True, False]


def test_a_call_for_lack_of_charge_does_not_end_when_a_little_less_is_needed(far):
    recall = Recall(2)
    assert [far(recall, dod, 8.0) for dod in (0.6, 0.72, 0.66)] == [False, True, True]

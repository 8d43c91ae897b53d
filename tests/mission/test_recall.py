"""Which UAS the rule of return mode calls home, as planners apply it that fly home themselves."""

import dataclasses

import numpy as np
import pytest
from small_worlds import meadow

from uas_coverage_env import MissionBrief
from uas_coverage_env.entities.state import LANDED
from uas_coverage_env.mission import WorldView, first_sight
from uas_coverage_env.mission.recall import Recall
from uas_coverage_env.vehicle.layout import DOD

STARTS_M = ((20.0, 20.0, -1.0), (60.0, 20.0, -1.0))


@pytest.fixture
def seen():
    """Called for a moment, what the rule answers; of two UAS at home."""
    brief = MissionBrief.of(meadow(STARTS_M))
    view, recall, first = WorldView(brief), Recall(2), first_sight(brief)

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

"""By which rule waypoints change hands when UAS take no commands."""

import dataclasses

import numpy as np
import pytest
from small_worlds import meadow

from uas_coverage_env import MissionBrief
from uas_coverage_env.entities.state import FLYING, LANDED, LOST
from uas_coverage_env.mission import first_sight
from uas_coverage_env.planning.around.handover import SILENT_S, Handover, without


@pytest.fixture
def brief():
    return MissionBrief.of(meadow(((20.0, 20.0, -1.0), (60.0, 20.0, -1.0)), dt_s=0.5))


@pytest.fixture
def swarm(brief):
    return first_sight(brief)


def heard(swarm, step, *responds):
    return dataclasses.replace(swarm, step=step, responds=np.array(responds))


def steps_of_work(handover, swarm, until):
    """How many samples a UAS that is silent from sample 10 on still works."""
    return (
        sum(handover.workers(heard(swarm, step, step < 10, True))[0] for step in range(until)) - 10
    )


def test_a_uas_that_is_silent_for_a_while_works_no_more(brief, swarm):
    assert steps_of_work(Handover(brief), swarm, 60) == SILENT_S / brief.dt_s - 1


def test_a_uas_works_again_as_soon_as_it_takes_commands(brief, swarm):
    handover = Handover(brief)
    steps_of_work(handover, swarm, 60)
    assert handover.workers(heard(swarm, 60, True, True)).all()


def test_a_short_gap_hands_nothing_over(brief, swarm):
    handover = Handover(brief)
    for step in range(100):
        assert handover.workers(heard(swarm, step, step % 8 == 0, True)).all()


def test_where_none_takes_commands_all_work_on(brief, swarm):
    handover = Handover(brief)
    for step in range(60):
        assert handover.workers(heard(swarm, step, False, False)).all()


def test_a_uas_that_does_not_fly_does_not_work(brief, swarm):
    handover = Handover(brief)
    for status in (LANDED, LOST):
        gone = dataclasses.replace(swarm, status=np.array([status, FLYING]))
        assert handover.workers(gone).tolist() == [False, True]


def test_a_state_without_some_uas_has_them_landed_and_nothing_else_changed(swarm):
    rest = without(swarm, np.array([True, False]))
    assert rest.status.tolist() == [LANDED, FLYING]
    assert rest.active == ("uas_2",)
    assert rest.x is swarm.x
    assert without(swarm, np.array([False, False])) is swarm

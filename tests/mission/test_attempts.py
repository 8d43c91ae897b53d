"""Standstill before a target: hard after a while, left for later, given up in the end."""

import dataclasses

import numpy as np
import pytest
from hard_missions import TOWER, mission

from uas_coverage_env.entities.commands import HOME
from uas_coverage_env.mission import first_sight
from uas_coverage_env.mission.approach import with_free_aims
from uas_coverage_env.mission.attempts import PATIENCE_S, Attempts


@pytest.fixture
def brief():
    return mission(((60.0, 20.0, -10.0), 5.0), ((20.0, 90.0, -10.0), 5.0))


def stood(attempts, swarm, seconds, target, blocked=None, dt_s=1.0):
    """Hover for a while on the way to a target; the sample after it."""
    for _ in range(round(seconds / dt_s)):
        attempts.update(swarm, {"uas_1": target}, blocked)
        swarm = dataclasses.replace(swarm, step=swarm.step + 1)
    return swarm


def at(swarm, x):
    moved = swarm.x.copy()
    moved[0, 0], moved[0, 2] = x, -10.0
    return dataclasses.replace(swarm, x=moved)


@pytest.mark.parametrize("target", [0, HOME])
@pytest.mark.parametrize("dt_s", [0.5, 1.0])
def test_a_target_that_comes_no_nearer_is_hard_after_the_patience_is_used_up(dt_s, target):
    brief = mission(((60.0, 20.0, -10.0), 5.0), dt_s=dt_s)
    attempts, swarm = Attempts(brief), first_sight(brief)
    swarm = stood(attempts, swarm, PATIENCE_S, target, dt_s=dt_s)
    assert not attempts.is_hard(0, target)
    stood(attempts, swarm, 3.0 + dt_s, target, dt_s=dt_s)
    assert attempts.is_hard(0, target)


def test_a_uas_that_comes_nearer_however_slowly_is_at_no_standstill(brief):
    attempts, swarm = Attempts(brief), first_sight(brief)
    for step in range(200):
        attempts.update(at(swarm, 20.0 + 0.15 * step), {"uas_1": 0})
        swarm = dataclasses.replace(swarm, step=step + 1)
    assert not attempts.is_hard(0, 0)


def test_a_detour_is_no_standstill_though_it_leads_away():
    wall = ((0.0, 40.0, -50.0), (150.0, 44.0, 0.0))
    brief = mission(((20.0, 80.0, -10.0), 5.0), obstacles=[wall])
    attempts, swarm = Attempts(brief), first_sight(brief)
    for step in range(130):
        attempts.update(at(swarm, 20.0 + step), {"uas_1": 0})
        swarm = dataclasses.replace(swarm, step=step + 1)
    assert not attempts.is_hard(0, 0)


def test_waiting_for_what_moves_or_flying_home_on_return_mode_takes_no_patience(brief):
    attempts, swarm = Attempts(brief), first_sight(brief)
    swarm = stood(attempts, swarm, 100.0, 0, blocked=np.array([True, False]))
    called = dataclasses.replace(swarm, returning=np.array([True]))
    called = stood(attempts, called, 100.0, 0)
    assert not attempts.is_hard(0, 0)


def test_a_hard_waypoint_is_left_until_the_others_are_covered_and_given_up_in_the_end(brief):
    attempts, swarm = Attempts(brief), first_sight(brief)
    both, first = np.array([True, True]), np.array([True, False])
    swarm = stood(attempts, swarm, PATIENCE_S + 6.0, 0)
    assert attempts.is_hard(0, 0)
    assert attempts.wanted(both) is both
    swarm = stood(attempts, swarm, PATIENCE_S + 6.0, 0)
    assert attempts.wanted(both).tolist() == [False, True]
    assert attempts.wanted(first).tolist() == [True, False]
    stood(attempts, swarm, PATIENCE_S + 6.0, 0)
    assert not attempts.wanted(first).any()
    assert attempts.wanted(both).tolist() == [False, True]


def test_aims_are_centres_where_these_are_free_and_else_the_free_side_of_the_waypoint():
    brief = mission(
        ((60.0, 60.0, -20.0), 5.0),
        ((60.0, 60.0, -49.8), 2.0),
        ((100.0, 87.5, -10.0), 3.0),
        obstacles=[TOWER],
    )
    free, high, foot = (np.array(w.position_m) for w in with_free_aims(brief).waypoints)
    assert free.tolist() == [60.0, 60.0, -20.0]
    assert high == pytest.approx([60.0, 60.0, -48.5])
    assert foot == pytest.approx([100.0, 90.0 - 0.36 - 3.0 - 1.0, -10.0])

"""Places that are asked for again: which of them to plan for, before they are."""

import numpy as np
from small_worlds import meadow, waypoint

from uas_coverage_env import World
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.around.repeats import Repeats, asked_in_s, open_now, steps_until_open
from uas_coverage_env.scenario.packs import Sorties
from uas_coverage_env.world import GoTo, Velocity

START_M = (20.0, 20.0, -10.0)
PLACES_M = ((30.0, 20.0, -10.0), (44.0, 20.0, -10.0), (150.0, 20.0, -10.0))
HOVERS = Velocity(0.0, 0.0, 10.0)


def mission(*gaps_s, packs=0):
    """A UAS and a waypoint for each of these, asked for again after so long."""
    places = [
        waypoint(place_m, 4.0) | {"again_after_s": gaps}
        for place_m, gaps in zip(PLACES_M, gaps_s, strict=False)
    ]
    sorties = Sorties(packs=packs, swap_s=20.0, together=False) if packs else None
    changes = {"relaunch": not packs, "sorties": sorties}
    return meadow((START_M,), waypoints=places, max_steps=600).model_copy(update=changes)


class Told:
    """A world, and what a planner is told of it by `Repeats` at each sample."""

    def __init__(self, scenario):
        self.world = World(scenario)
        self.repeats = Repeats.of(MissionBrief.of(scenario))
        self.revisions, self.told = 0, None
        self.see()

    def see(self, is_idle=False):
        if self.world.revisions != self.revisions:
            self.revisions = self.world.revisions
            assert self.repeats.goes_on(MissionBrief.of(self.world.known))
        self.told = self.repeats.seen(self.world.swarm_state(), is_idle)

    def step(self, command, is_idle=False):
        self.world.step({"uas_1": command})
        self.see(is_idle)

    def cover(self, place):
        while self.told.uncovered[place]:
            self.step(self.repeats.addressed({"uas_1": GoTo(place)})["uas_1"])


def test_a_mission_without_repeats_has_none():
    assert Repeats.of(MissionBrief.of(mission((), ()))) is None
    assert not len(World(mission((), ())).swarm_state().again_s)


def test_planners_are_told_how_long_it_is_until_a_waypoint_is_asked_for_again():
    world = World(mission((30.0,), ()))
    assert np.isinf(world.swarm_state().again_s).all()
    while world.state.uncovered[0]:
        world.step({"uas_1": GoTo(0)})
    for left_s in range(30, 0, -1):
        assert world.swarm_state().again_s.tolist() == [left_s, np.inf]
        world.step({"uas_1": HOVERS})
    assert world.swarm_state().again_s.tolist() == [np.inf, np.inf, np.inf]


def test_a_place_stays_the_same_however_often_it_is_asked_for():
    told = Told(mission((12.0, 12.0), ()))
    for n_waypoints in (2, 3, 4):
        assert len(told.world.known.waypoints) == n_waypoints
        assert len(told.told.uncovered) == 2
        told.cover(0)
        assert not told.told.uncovered[0]
        for _ in range(12):
            told.step(HOVERS)
    commands = {"uas_1": GoTo(0), "uas_2": GoTo(1), "uas_3": GoTo(None), "uas_4": HOVERS}
    assert told.repeats.addressed(commands) == {**commands, "uas_1": GoTo(3)}
    assert told.world.state.uncovered.tolist() == [False, True, False, False]


def test_what_opens_soon_is_planned_for_once_a_uas_has_nothing_else_to_visit():
    told = Told(mission((20.0,)))
    told.cover(0)
    told.step(HOVERS)
    assert not told.told.uncovered.any()
    told.step(HOVERS, is_idle=True)
    assert told.told.uncovered.tolist() == [True]
    # it opens in 18 s, and can be covered a step later
    assert asked_in_s(told.told).tolist() == [19.0]
    assert steps_until_open(told.told, 1.0).tolist() == [19]
    assert not open_now(told.told).uncovered.any()
    for _ in range(18):
        told.step(HOVERS)
    assert asked_in_s(told.told).tolist() == [0.0]
    assert told.world.state.uncovered.tolist() == [False, True]


def test_what_opens_long_after_is_left_for_later():
    told = Told(mission((70.0,)))
    told.cover(0)
    told.step(HOVERS, is_idle=True)
    assert not told.told.uncovered.any()


def test_a_place_that_opens_brings_along_all_that_open_soon_after():
    told = Told(mission((40.0,), (60.0,), (400.0,)))
    for place in range(3):
        told.cover(place)
    while len(told.world.known.waypoints) == 3:
        told.step(HOVERS)
    assert told.told.uncovered.tolist() == [True, True, False]
    in_s = asked_in_s(told.told)
    assert in_s[0] == 0.0 < in_s[1] <= 31.0


def test_a_uas_whose_swap_takes_longer_waits_longer_in_the_air():
    waits = []
    for packs in (0, 2):
        told = Told(mission((45.0,), packs=packs))
        told.cover(0)
        told.step(HOVERS, is_idle=True)
        waits.append(bool(told.told.uncovered[0]))
    assert waits == [False, True]


def test_another_scene_is_another_mission():
    brief = MissionBrief.of(mission((30.0,), ()))
    repeats = Repeats(brief)
    other = MissionBrief.of(mission((30.0,), (5.0,)))
    assert repeats.goes_on(brief)
    assert not repeats.goes_on(other)

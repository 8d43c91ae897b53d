"""What is done round every planner: one of some lines has it, too."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from small_worlds import meadow, waypoint

from uas_coverage_env import MissionBrief, rollout
from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.flight.metrics import accomplished, coverage
from uas_coverage_env.mission import WorldView, first_sight
from uas_coverage_env.planning.around.around import Around
from uas_coverage_env.planning.around.handover import SILENT_S
from uas_coverage_env.scenario import Execution, Scenario
from uas_coverage_env.world import GoTo, Velocity

STARTS_M = ((100.0, 100.0, -1.0), (120.0, 100.0, -1.0))
PLACES = [waypoint((60.0, 60.0, -15.0), 6.0), waypoint((150.0, 60.0, -15.0), 6.0)]


class InTurn:
    """Sends every UAS to the first open waypoint, and keeps what it was shown."""

    def __init__(self):
        self.resets, self.briefs, self.shown = 0, [], []

    def reset(self, brief, seed):
        self.resets += 1
        self.briefs.append(brief)

    def act(self, swarm) -> Any:
        self.shown.append(swarm)
        open_ = np.flatnonzero(swarm.uncovered)
        return {name: GoTo(int(open_[0]) if len(open_) else None) for name in swarm.active}


class Stubborn(InTurn):
    """Sends the second UAS on, too, whatever it is shown."""

    def act(self, swarm):
        return {"uas_1": GoTo(0), "uas_2": GoTo(1)}


class LooksAhead(InTurn):
    """Asks for what opens soon whenever there is nothing else."""

    def is_idle(self, swarm):
        return True


class Hovers(InTurn):
    """Stays where it is, by velocities of its own."""

    def act(self, swarm) -> Any:
        return {name: Velocity(0.0, 0.0, 10.0) for name in swarm.active}


def silent(swarm, *uas):
    """The sample after the first of these UAS have been silent for long."""
    responds = np.isin(np.arange(len(swarm.status)), uas, invert=True)
    return dataclasses.replace(swarm, responds=responds, step=int(SILENT_S))


@pytest.fixture
def pair():
    planner = InTurn()
    around, brief = Around(planner), MissionBrief.of(meadow(STARTS_M, waypoints=PLACES))
    around.reset(brief, 0)
    return planner, around, first_sight(brief)


def test_where_nothing_is_asked_for_the_planner_sees_and_flies_what_there_is(pair):
    planner, around, swarm = pair
    assert around.act(swarm) == {"uas_1": GoTo(0), "uas_2": GoTo(0)}
    assert planner.shown == [swarm]


def test_a_uas_that_takes_no_commands_is_sent_home_whatever_the_planner_says(pair):
    around, swarm = Around(Stubborn()), pair[2]
    around.reset(MissionBrief.of(meadow(STARTS_M, waypoints=PLACES)), 0)
    assert around.act(silent(swarm, 1)) == {"uas_1": GoTo(0), "uas_2": GoTo(None)}


def test_a_uas_that_takes_no_commands_is_shown_as_landed_and_away_and_sent_home(pair):
    planner, around, swarm = pair
    commands = around.act(silent(swarm, 1))
    shown = planner.shown[-1]
    assert shown.status.tolist() == [FLYING, LANDED]
    assert shown.away.tolist() == [False, True]
    assert commands == {"uas_1": GoTo(0), "uas_2": GoTo(None)}


def test_what_the_kernels_see_of_a_uas_that_is_away_is_that_it_flies(pair):
    planner, around, swarm = pair
    around.act(silent(swarm, 1))
    view = WorldView(planner.briefs[0])
    view.update(planner.shown[-1])
    assert view.state.uas["status"].tolist() == [FLYING, FLYING]


def test_where_none_takes_commands_all_are_planned_for(pair):
    planner, around, swarm = pair
    around.act(silent(swarm, 0, 1))
    assert planner.shown[-1].active == ("uas_1", "uas_2")


def test_a_reset_in_flight_does_not_forget_who_was_silent(pair):
    planner, around, swarm = pair
    around.act(silent(swarm, 1))
    around.reset(planner.briefs[0], 0)
    later = silent(swarm, 1)
    around.act(dataclasses.replace(later, step=later.step + 1))
    assert planner.shown[-1].status.tolist() == [FLYING, LANDED]


def test_the_waypoints_of_a_uas_without_its_radio_are_covered_by_the_other():
    quiet = {"kind": "radio_lost", "uas": "uas_1", "at_s": 2.0, "for_s": 200.0, "then": "hover"}
    data = meadow(STARTS_M, waypoints=PLACES).model_dump(by_alias=True) | {"events": (quiet,)}
    flight = rollout(Scenario.model_validate(data), InTurn(), return_mode=False)
    assert coverage(flight) == 1.0


def repeating(*gaps_s):
    again = PLACES[0] | {"again_after_s": gaps_s}
    return meadow(waypoints=[again]).model_copy(update={"relaunch": True})


def test_a_waypoint_that_is_asked_for_again_is_one_place_for_a_planner_without_a_reset():
    planner = InTurn()
    flight = rollout(repeating(25.0, 25.0), planner)
    assert accomplished(flight)
    assert len(flight.scenario.waypoints) == 1
    assert flight.covered[-1] == 3
    assert planner.resets == 1
    assert all(len(swarm.uncovered) == 1 for swarm in planner.shown)


def test_only_a_planner_that_looks_ahead_is_shown_what_opens_later():
    for planner, looks in ((InTurn(), False), (LooksAhead(), True)):
        rollout(repeating(12.0), planner, max_steps=60)
        later = [s for s in planner.shown if (s.uncovered & (s.again_s > 0.0)).any()]
        assert bool(later) == looks


def test_what_a_planner_gives_up_is_named_as_the_waypoint_that_it_is_now():
    scenario, planner = repeating(5.0), Hovers()
    again = scenario.waypoints[0].again()
    now = scenario.model_copy(update={"waypoints": (*scenario.waypoints, again)})
    around = Around(planner)
    around.reset(MissionBrief.of(now), 0)
    planner.given_up = {0: "too far"}
    assert around.given_up == {1: "too far"}


def by_autopilot():
    scenario = meadow(STARTS_M, waypoints=PLACES)
    return scenario.model_copy(update={"execution": Execution(flown_by="autopilot")})


def test_a_planner_that_names_waypoints_is_flown_by_legs_where_an_autopilot_flies():
    flight = rollout(by_autopilot(), InTurn())
    assert accomplished(flight)
    assert {decision.flown_by for decision in flight.decisions} == {("legs",)}


def test_a_planner_with_routes_is_flown_along_them_whatever_it_commands():
    class Routed(InTurn):
        goes_to = True

        def __init__(self):
            super().__init__()
            self.routes = [[1], []]

        def act(self, swarm):
            self.routes = [[1] if swarm.uncovered[1] else [], []]
            return {name: GoTo(0) for name in swarm.active}

    flight = rollout(by_autopilot(), Routed())
    assert flight.covered[-1] == 1
    assert coverage(flight) == 0.5


def test_velocities_of_a_planner_are_flown_as_they_are_where_an_autopilot_flies():
    alone = rollout(by_autopilot(), Hovers(), max_steps=8)
    free = rollout(meadow(STARTS_M, waypoints=PLACES), Hovers(), max_steps=8, safety_filter=True)
    assert (alone.x == free.x).all()

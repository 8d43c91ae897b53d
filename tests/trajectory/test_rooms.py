"""`trajectory` between walls: below lintels in space, and at short samples."""

from functools import cache

import numpy as np
import pytest
from small_fleets import fleet_of, start_of
from uas_coverage_baselines.margins import margins_in
from uas_coverage_baselines.trajectory.first_guess import Speeds, first_flight, guess_path
from uas_coverage_baselines.trajectory.fleet import Moment, put_off
from uas_coverage_baselines.trajectory.mission_plan import Effort
from uas_coverage_baselines.trajectory.options import TrajectoryOptions
from uas_coverage_baselines.trajectory.space import Body, separating_rows, spare_fixed_m
from uas_coverage_baselines.trajectory.work import done

from uas_coverage_env import load_planner, load_scenario, rollout
from uas_coverage_env.mission import MissionBrief

ABOVE_DOOR = "north_east_above_door_1"
DOOR_M = np.array([11.675, 14.0])
"""Between the room of the first UAS and the next."""
THROUGH = np.array([11, 9])
"""Waypoints on both sides of it; the rack stands beside the way."""


def office():
    """The shipped office in space, without its person."""
    return load_scenario("indoor").model_copy(update={"moving_obstacles": (), "planar": None})


@cache
def office_in_space():
    """Its fleet, first sight, and the row of the lintel above the door."""
    scenario = office()
    fleet, swarm = fleet_of(scenario, margins_in(MissionBrief.of(scenario), None, None).fixed_m)
    names = [obstacle.name for obstacle in scenario.obstacles]
    return fleet, swarm, names.index(ABOVE_DOOR)


def below_the_door(z):
    """Places through the door, a step of some 0.25 m each."""
    along = np.linspace(-1.0, 1.0, 9)
    return np.column_stack([np.full(9, DOOR_M[0]), DOOR_M[1] + along, np.full(9, z)])


def test_an_office_in_space_is_covered_below_its_lintels():
    flight = rollout(office(), load_planner("trajectory", {"idle_work": 0}))
    assert flight.figures["coverage"] == 1.0
    assert flight.figures["all_home"]
    assert not flight.figures["violations"]
    assert flight.figures["breaches"] == flight.figures["fallbacks"] == 0
    assert flight.figures["min_soc_share"] > 0.3


def test_a_path_below_a_lintel_is_clear_and_one_through_it_is_not():
    fleet, _, _ = office_in_space()
    space = fleet.programs[0].space
    assert spare_fixed_m(space, below_the_door(-1.2)) >= 0.0
    assert spare_fixed_m(space, below_the_door(-1.95)) < 0.0


def test_the_lintel_holds_down_what_flies_through_its_door():
    fleet, _, lintel = office_in_space()
    space = fleet.programs[0].space
    stages, normals, bounds = separating_rows(space, below_the_door(-1.2))
    under_m = -space.high_m[lintel, 2] - space.keep_m[lintel]
    holds = (normals[:, 2] < -0.99) & np.isclose(bounds, under_m, atol=1e-3)
    assert set(stages[holds]) >= {4, 5}


def test_a_guess_stays_below_the_lintel_beside_what_it_passes_over():
    fleet, _, lintel = office_in_space()
    program = fleet.programs[0]
    space = program.space
    speeds = Speeds(1.0, 0.8, 0.5)
    high_m = np.array([11.5, 14.6, -2.3])  # where it is before the door is above the lintel
    guess = guess_path(program, fleet.terrain, 0, high_m, THROUGH[1:], speeds)
    near = np.hypot(*(guess.path_m[:, :2] - DOOR_M).T) < 0.2
    assert near.any()
    assert (-guess.path_m[near, 2] <= -space.high_m[lintel, 2] - space.keep_m[lintel]).all()


def test_the_first_flight_through_a_door_needs_one_guess():
    fleet, swarm, _ = office_in_space()
    program = fleet.program(0, {}, ())
    flight = done(first_flight(program, fleet.terrain, 0, start_of(swarm), THROUGH))
    assert flight.is_clear
    assert program.solved <= 4
    assert (-flight.path_m[:, 2]).max() < 2.0


def test_what_stands_below_a_flight_drives_it_through_no_ceiling():
    scenario = office()
    table = tuple(o for o in scenario.obstacles if o.name == "table")
    scenario = scenario.model_copy(update={"obstacles": table, "doors_m": ()})
    fleet, swarm = fleet_of(scenario, margins_in(MissionBrief.of(scenario), None, None).fixed_m)
    program = fleet.program(1, {}, ())
    flight = done(first_flight(program, fleet.terrain, 1, start_of(swarm, 1), np.array([0, 1])))
    assert flight.is_clear
    assert program.solved == 1


def test_flights_keep_to_the_rooms_of_their_ways():
    scenario = load_scenario("indoor:1").model_copy(update={"moving_obstacles": ()})
    fleet, swarm = fleet_of(scenario, margins_in(MissionBrief.of(scenario), None, None).fixed_m)
    program = fleet.program(1, {}, ())
    route = np.array([1, 7, 3, 9, 2, 8, 5, 4, 10])
    flight = done(first_flight(program, fleet.terrain, 1, start_of(swarm, 1), route))
    assert flight.is_clear


def test_what_is_looked_for_at_first_ends_after_the_work_that_is_given():
    fleet, swarm, _ = office_in_space()
    wall = Body(np.tile([DOOR_M[0], DOOR_M[1], -1.2], (3000, 1)), 1.0, 5.0)  # the door is blocked
    program = fleet.program(0, {}, [wall])
    flight = done(first_flight(program, fleet.terrain, 0, start_of(swarm), THROUGH, 500.0))
    assert not flight.is_clear
    assert program.solved <= 12


def test_a_known_flight_is_put_off_until_what_is_in_its_way_has_passed():
    fleet, swarm, _ = office_in_space()
    program, start = fleet.program(0, {}, ()), start_of(swarm)
    known = done(first_flight(program, fleet.terrain, 0, start, THROUGH))
    at = int(np.flatnonzero(np.hypot(*(known.path_m[:, :2] - DOOR_M).T) < 0.5)[0])
    stands = Body(np.tile([DOOR_M[0], DOOR_M[1], -1.2], (at + 12, 1)), 0.6, 5.0)
    beside = fleet.program(0, {}, [stands])
    assert at - 5 < beside.first_meeting(known.path_m) <= at
    later = done(put_off(beside, start, THROUGH, known))
    assert later.is_clear
    assert later.steps > known.steps
    assert beside.spare_from_bodies_m(later.path_m) >= -0.02
    assert beside.first_meeting(later.path_m + np.array([100.0, 0.0, 0.0])) == later.steps


def moment():
    swarm = office_in_space()[1]
    free = np.zeros(len(swarm.uncovered), np.int64)
    return Moment(swarm.x, np.ones(2, np.bool_), swarm.uncovered, free, 0.0)


@pytest.mark.parametrize("dt_s", [1.0, 2.0])
def test_from_samples_of_a_second_on_plans_have_the_effort_that_is_asked_for(dt_s):
    options = TrajectoryOptions()
    effort = Effort.of(options, moment(), 0.6, dt_s, first=False)
    assert (effort.programs, effort.moves) == (options.programs, options.moves)
    assert effort.first_steps == np.inf
    assert not effort.bends


def test_shorter_samples_have_less_in_proportion_but_not_nothing():
    options = TrajectoryOptions()
    effort = Effort.of(options, moment(), 0.6, 0.2, first=False)
    assert effort.programs == 0.2 * options.programs
    assert effort.moves == 0.2 * options.moves
    assert effort.bends
    assert not Effort.of(options, moment(), 0.6, 0.2, first=True).bends
    assert Effort.of(options, moment(), 0.6, 0.02, first=False).programs == 20
    few = options.model_copy(update={"programs": 5})
    assert Effort.of(few, moment(), 0.6, 0.2, first=False).programs == 5

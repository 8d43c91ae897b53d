"""A waypoint that is blocked for an unknown time: which UAS waits for it, and until when."""

import numpy as np
import pytest
from hand_made import straight
from small_fleets import fleet_of
from small_worlds import meadow, mover, waypoint
from uas_coverage_baselines.trajectory import Trajectory, TrajectoryOptions
from uas_coverage_baselines.trajectory.fleet import Moment
from uas_coverage_baselines.trajectory.mission_plan import Planned
from uas_coverage_baselines.trajectory.program import PlannedFlight
from uas_coverage_baselines.trajectory.waiting import (
    Waiting,
    choose_waiting,
    opens_again,
    opens_first,
)

from uas_coverage_env import Scenario, rollout
from uas_coverage_env.flight.metrics import accomplished, home
from uas_coverage_env.mission import Range
from uas_coverage_env.planning.routing import SearchEffort, empty_routes, improve_routes
from uas_coverage_env.vehicle.layout import DOD

STARTS = ((20.0, 20.0, -1.0), (180.0, 180.0, -1.0))
PLACES = (
    (20.0, 90.0, -20.0),
    (60.0, 110.0, -14.0),
    (100.0, 60.0, -12.0),
    (60.0, 20.0, -18.0),
    (170.0, 140.0, -10.0),
)
PARKED_ON = 4


def parked(until_s):
    """A field of which one waypoint is blocked until then, near the start of the second UAS."""
    leaves = (until_s, (0.0, 0.0, -3.0)), (until_s + 5.0, (0.0, 12.0, 0.0))
    where = PLACES[PARKED_ON]
    return mover(where, (0.0, (0.0, 0.0, 0.0)), *leaves, radius_m=6.0, safe_distance_m=12.0)


def blocked_field(until_s, socs, max_steps=300, dt_s=1.0):
    places = tuple(waypoint(place) for place in PLACES)
    made = meadow(
        STARTS[-len(socs) :], waypoints=places, moving_obstacles=(parked(until_s),)
    ).model_dump(by_alias=True)
    made["max_steps"], made["dt_s"] = max_steps, dt_s
    for uas, soc in zip(made["uas"], socs, strict=True):
        uas["soc_0"] = soc
    return Scenario.model_validate(made)


def flown(scenario):
    effort = {"orders": 1, "moves": 20_000, "programs": 40, "weight_energy": 0.0, "idle_work": 0}
    return rollout(scenario, Trajectory(TrajectoryOptions(**effort)))


def at_first(socs, max_steps=300, dt_s=1.0):
    """A fleet with so much charge, and its mission before take-off."""
    fleet, swarm = fleet_of(blocked_field(60.0, socs, max_steps, dt_s))
    any_time, n_uas = np.zeros(5, np.int64), len(socs)
    return fleet, Moment(swarm.x, np.ones(n_uas, bool), np.ones(5, bool), any_time, swarm.time_s)


def waiting(socs, max_steps=300, dt_s=1.0):
    fleet, moment = at_first(socs, max_steps, dt_s)
    return choose_waiting(fleet, Range(fleet.brief), moment, np.arange(5) == PARKED_ON)


def can_wait_s(uas, soc):
    """How long a UAS can wait at what is blocked, by its charge, and what a second of that is."""
    fleet, moment = at_first((soc, soc))
    x = moment.x[uas].copy()
    x[:3] = PLACES[PARKED_ON]
    home = Range(fleet.brief).home(uas, x)
    per_s = float(fleet.arena.uas[uas].dod_per_s)
    return (0.75 - x[DOD]) / per_s - home.time_s - home.time_margin_s, per_s


def charge_to_wait(uas, seconds):
    """The charge with which a UAS can wait so long; its way home has its margin from the charge."""
    soc = 0.5
    for _ in range(4):
        can_s, per_s = can_wait_s(uas, soc)
        soc += (seconds - can_s) * per_s
    return soc


def test_what_opens_when_most_are_home_is_covered_by_the_one_that_could_wait_longest():
    """The UAS that is nearest to it has charge for a minute, and the other one comes home early."""
    flight = flown(blocked_field(60.0, (1.0, 0.31)))
    assert accomplished(flight)
    assert flight.violations == ()
    assert flight.breaches == 0


@pytest.mark.parametrize(("until_s", "covers"), [(40.0, True), (250.0, False)])
def test_a_uas_alone_waits_as_long_as_its_charge_lasts_and_comes_home(until_s, covers):
    flight = flown(blocked_field(until_s, (0.36,)))
    assert accomplished(flight) == covers
    assert home(flight).all()
    assert flight.x[-1, 0, DOD] <= 0.75
    assert flight.breaches == 0
    if not covers:
        assert flight.steps > 90, "it waits before it gives up"
        assert flight.covered[-1] == len(PLACES) - 1


def test_the_uas_that_can_wait_longest_waits():
    one = waiting((1.0, 0.4))
    assert one.forbidden[:, PARKED_ON].tolist() == [False, True]
    assert not one.forbidden[:, :PARKED_ON].any()
    other = waiting((0.4, 1.0))
    assert other.forbidden[:, PARKED_ON].tolist() == [True, False]


def test_a_uas_that_can_wait_until_the_mission_ends_may_wait_wherever_its_home_is():
    both = waiting((1.0, 0.8), max_steps=120)
    assert not both.forbidden.any()
    assert 60 < both.latest[PARKED_ON] < 120


def test_no_uas_waits_where_the_charge_lasts_for_the_way_home_only():
    given_up = waiting((0.28, 0.27))
    assert given_up.latest[PARKED_ON] < 0


@pytest.mark.parametrize("dt_s", [1.0, 0.5])
def test_what_is_blocked_is_visited_before_the_one_that_waits_has_to_fly_home(dt_s):
    socs = charge_to_wait(0, 150.0), charge_to_wait(1, 60.0)
    assert waiting(socs, max_steps=2000, dt_s=dt_s).latest[PARKED_ON] == round(150.0 / dt_s)


def test_the_end_of_the_mission_ends_all_waiting():
    soc = charge_to_wait(0, 150.0)
    way_s = (0.75 - (1.0 - soc)) / can_wait_s(0, soc)[1] - 150.0
    ends = waiting((soc, 0.3), max_steps=100)
    assert ends.latest[PARKED_ON] == pytest.approx(100.0 - way_s, abs=1.0)


@pytest.mark.parametrize(("less_s", "may"), [(9.9, True), (10.1, False)])
def test_a_uas_that_can_wait_nearly_as_long_as_another_may_wait_too(less_s, may):
    socs = charge_to_wait(0, 100.0 - less_s), charge_to_wait(1, 100.0)
    assert waiting(socs).forbidden[:, PARKED_ON].tolist() == [not may, False]


@pytest.mark.parametrize(("can_s", "waits"), [(11.9, False), (12.1, True)])
def test_what_the_last_one_could_wait_for_only_seconds_is_given_up(can_s, waits):
    socs = charge_to_wait(0, can_s), charge_to_wait(1, 5.0)
    assert (waiting(socs).latest[PARKED_ON] >= 0) == waits


def test_a_uas_that_may_not_work_or_cannot_cover_does_not_wait():
    fleet, moment = at_first((1.0, 1.0))
    moment.may_work[0] = False
    one = choose_waiting(fleet, Range(fleet.brief), moment, np.arange(5) == PARKED_ON)
    assert one.forbidden[:, PARKED_ON].tolist() == [True, False]


def planned_to(route, visits, steps=20):
    """A UAS that is to visit waypoints at some steps, flown from step 0 on."""
    nothing = np.zeros((steps + 1, 10)), np.zeros((steps, 3)), np.zeros((steps, 10))
    flight = PlannedFlight(np.array(visits), *nothing, 0.0, np.zeros(len(route)))
    return Planned(np.array(route), flight, straight((0.0, 0.0, -10.0), (1.0, 0.0, 0.0), steps))


def test_a_waypoint_is_left_to_others_once_those_that_could_wait_for_it_have_nothing_to_do():
    # the second UAS could wait for waypoint 2, the first may not
    one = Waiting(np.array([[False, False, True], [False, False, False]]), np.array([-1, -1, 50]))
    still_open = np.ones(3, bool)
    both = {0: planned_to([0], [12]), 1: planned_to([1], [8])}
    assert not one.is_left_to_others(both, 7, still_open)
    assert one.is_left_to_others(both, 8, still_open), "its last visit is behind it"
    assert one.is_left_to_others({0: both[0]}, 7, still_open)
    assert one.is_left_to_others({}, 7, still_open), "all fly home"
    assert not one.is_left_to_others(both, 8, np.array([True, True, False])), "it is covered"
    gone = one._replace(latest=np.array([-1, -1, -1]))
    assert not gone.is_left_to_others(both, 8, still_open), "nothing is waited for any more"
    anyone = one._replace(forbidden=np.zeros((2, 3), bool))
    assert not anyone.is_left_to_others(both, 8, still_open)


@pytest.mark.parametrize(
    ("left_steps", "dt_s", "steps"),
    [((100, 60), 1.0, 60), ((200, 120), 0.5, 120), ((20, 10), 1.0, 26), ((), 0.5, 52)],
)
def test_later_a_visit_is_planned_for_three_quarters_of_what_is_left(left_steps, dt_s, steps):
    assert opens_again(left_steps, dt_s) == steps


@pytest.mark.parametrize("dt_s", [1.0, 0.5])
def test_at_first_a_visit_is_planned_for_the_end_of_all_other_work(dt_s):
    fleet, moment = at_first((1.0,), dt_s=dt_s)
    blocked = np.arange(5) == PARKED_ON
    others = Moment(moment.x, moment.may_work, ~blocked, moment.earliest, 0.0)
    problem = fleet.problem(others)
    order = improve_routes(problem, empty_routes(1), SearchEffort(2000), 1)
    mean_s = float(order.seconds.mean())
    assert mean_s > 31.0
    steps = opens_first(fleet, moment, blocked, 2000, 1)
    assert steps == round(0.85 * mean_s / dt_s)
    nothing_else = opens_first(fleet, moment, np.ones(5, bool), 2000, 1)
    assert nothing_else == round(26.0 / dt_s)

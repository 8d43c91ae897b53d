"""What the paper tells of its flight, found in flights that are known."""

import dataclasses

import pytest
from told_flights import COVERING, FORESTS, HELIPAD, OTHERS, SCENARIO, as_told, flight
from uas_coverage_baselines.reproduction.events import EVENTS, Story
from uas_coverage_baselines.reproduction.published import paper_named

from uas_coverage_env.mission import MissionBrief, WorldView


def asked(name, some):
    return EVENTS[name](Story(some))


def test_whatever_the_paper_tells_is_looked_for():
    assert {told.name for told in paper_named("gasche2025").events} == set(EVENTS)


@pytest.mark.parametrize("name", EVENTS)
def test_a_flight_that_goes_as_the_text_tells_has_all_its_events(name):
    event = asked(name, as_told())
    assert event.happened, event.detail


def test_the_waypoint_behind_the_helicopter_is_the_only_one_that_is_blocked_at_first():
    blocked = WorldView(MissionBrief.of(SCENARIO)).blocked()
    assert list(blocked.nonzero()[0]) == [HELIPAD]


def everything(first, later):
    """UAS 1 covers some waypoints and then the others, a step each."""
    return {(0, 5 + k): w for k, w in enumerate([*first, *later])}


def test_forests_that_come_last_are_not_first():
    late = flight(everything([*OTHERS, HELIPAD], FORESTS))
    assert not asked("forests_first", late).happened
    early = asked("forests_first", flight(everything(FORESTS, [*OTHERS, HELIPAD])))
    assert early.happened
    assert early.time_s == pytest.approx(5 + (len(FORESTS) - 1) / 2)


def test_a_waypoint_that_is_left_out_says_no():
    some = flight(everything(FORESTS, OTHERS))
    assert not asked("forests_first", some).happened
    assert not asked("behind_helicopter_last", some).happened


def test_the_helicopters_waypoint_in_the_middle_is_not_the_last():
    some = flight(everything([*FORESTS, HELIPAD], OTHERS))
    event = asked("behind_helicopter_last", some)
    assert not event.happened
    assert event.time_s == 5 + len(FORESTS)


def test_the_threshold_is_passed_when_the_charge_says_so():
    vehicle_threshold = Story(as_told()).threshold
    per_step = (vehicle_threshold - 0.567) / 60.5
    event = asked("tired_past_threshold", flight({}, dod_per_step=per_step))
    assert event.happened
    assert event.time_s == 61
    slowly = asked("tired_past_threshold", flight({}, dod_per_step=per_step / 2))
    assert not slowly.happened
    assert slowly.time_s == 121


def test_a_uas_in_the_west_or_home_by_then_is_not_in_the_east():
    assert not asked("tired_in_the_east", flight({(1, 70): 21})).happened
    assert asked("tired_in_the_east", flight({(1, 70): 33})).happened
    assert not asked("tired_in_the_east", flight({(1, 60): 33}, steps=(220, 66))).happened


def test_only_what_the_tired_one_covers_in_return_mode_counts():
    assert asked("tired_covers_on_its_way_home", flight({(1, 80): 33})).time_s == 80
    assert not asked("tired_covers_on_its_way_home", flight({(1, 60): 33})).happened
    assert not asked("tired_covers_on_its_way_home", flight({(0, 80): 33})).happened
    again = {(0, 60): 33, (1, 80): 33}  # covered before by the other one
    assert not asked("tired_covers_on_its_way_home", flight(again)).happened


def test_a_flight_without_return_mode_has_no_way_home():
    some = flight({(1, 80): 33})
    mode = some.mode.copy()
    mode[:147, 1] = COVERING
    event = asked("tired_covers_on_its_way_home", dataclasses.replace(some, mode=mode))
    assert not event.happened


@pytest.mark.parametrize(
    ("steps", "happens"), [((220, 147), True), ((140, 147), False), ((220, 170), False)]
)
def test_home_first_and_in_time(steps, happens):
    event = asked("tired_home_first", flight({}, steps=steps))
    assert event.happened == happens
    assert event.time_s == steps[1]

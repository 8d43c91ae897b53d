"""What is flown is verified: alone, beside another course, and with the brakes put on."""

from dataclasses import replace

import numpy as np
import pytest
from hand_made import course_along, flight_of, hover, straight
from small_fleets import fleet_of
from small_worlds import box, meadow
from uas_coverage_baselines.trajectory.course import (
    are_apart,
    course_of,
    hover_inputs,
    trouble_alone,
)

from uas_coverage_env.planning.backup.course import braked
from uas_coverage_env.vehicle import layout as S

KEEP_M = 2 * 0.36 + 5.0  # of two UAS in the meadow
START = (60.0, 60.0, -20.0)
AWAY = (60.0, 100.0, -20.0)
HOVERED = 4
BEYOND, TOO_NEAR = "beyond a limit of the vehicle", "too near to an obstacle or the fence"


def at(place_m, velocity_mps=(0.0, 0.0, 0.0), dod=0.1):
    x = np.zeros(S.N_STATES)
    x[:3], x[S.VX : S.VZ + 1], x[S.DOD] = place_m, velocity_mps, dod
    return x


@pytest.fixture(scope="module")
def pair():
    """A fleet of two over a meadow."""
    return fleet_of(meadow((START, AWAY)))[0]


@pytest.fixture
def alone():
    """A fleet of one that hovers at its home, and its flight there, which ends at once."""
    fleet, _ = fleet_of(meadow((START,)))
    return fleet, at(START), flight_of([(0.0, 0.0, 0.0)] * HOVERED)


def with_landing(fleet, **changes):
    """The fleet with another rule of landing."""
    program = fleet.programs[0]
    fleet.programs = [replace(program, landing=replace(program.landing, **changes))]
    return fleet


# a flight alone


def test_nothing_is_wrong_with_a_hover_at_home(alone):
    fleet, x, flight = alone
    assert trouble_alone(fleet, 0, x, flight) is None
    course = course_of(fleet, 0, 7, x, flight)
    assert (course.begin, course.end, course.lands) == (7, 7 + HOVERED, True)
    np.testing.assert_array_equal(course.x[0], x)
    assert np.abs(course.x[-1, :3] - START).max() < 0.2


def test_a_flight_that_is_no_number_is_not_flown(alone):
    fleet, x, flight = alone
    flight.u[1, 2] = np.nan
    assert trouble_alone(fleet, 0, x, flight) == "not finite"


def test_a_flight_beyond_a_limit_is_not_flown_unless_it_begins_beyond_it(alone):
    fleet, x, flight = alone
    limit_mps = float(fleet.arena.vehicles[0].v_xy_max_mps)
    flight.u[:, 0] = 3.0
    assert trouble_alone(fleet, 0, x, flight) == BEYOND
    pushed = at(START, (1.05 * limit_mps, 0.0, 0.0))
    assert trouble_alone(fleet, 0, pushed, flight) == "does not come home"


@pytest.mark.parametrize(("share", "says"), [(0.9995, None), (1.0005, None), (1.01, BEYOND)])
def test_limits_are_used_in_full_and_no_more_than_rounding_beyond(alone, share, says):
    fleet, x, flight = alone
    with_landing(fleet, distance_m=50.0, speed_mps=50.0)
    flight.u[0, 2] = -1.0
    pushed_mps = course_of(fleet, 0, 0, x, flight).x[1, S.VZ]
    flight.u[0, 2] = -share * float(fleet.arena.vehicles[0].v_down_max_mps) / pushed_mps
    assert trouble_alone(fleet, 0, x, flight) == says


@pytest.mark.parametrize(("gap_m", "says"), [(-0.01, TOO_NEAR), (0.01, None)])
def test_a_flight_keeps_the_distance_of_the_rules_to_its_last_segment(gap_m, says):
    wall_m = 63.0 + 0.36 + 2.0 + gap_m
    wall = box("wall", (wall_m, 40.0, -45.0), (wall_m + 5.0, 80.0, 0.0))
    fleet, _ = fleet_of(meadow((START,), obstacles=(wall,)))
    with_landing(fleet, distance_m=50.0, speed_mps=50.0)
    north, x = flight_of([(0.0, 0.0, 0.0)] * 3), at(START, (1.2, 0.0, 0.0))
    x[0] += 63.0 - course_of(fleet, 0, 0, x, north).x[-1, 0]  # ends where the wall is near
    assert trouble_alone(fleet, 0, x, north) == says


@pytest.mark.parametrize(("gap_m", "says"), [(-0.01, TOO_NEAR), (0.01, None)])
def test_a_flight_keeps_the_fences_margin_until_it_has_landed(alone, gap_m, says):
    fleet, x, flight = alone
    with_landing(fleet, distance_m=500.0, speed_mps=50.0)
    x[:3], x[S.VX] = (190.0, 60.0, -20.0), 1.2
    before_last_m = course_of(fleet, 0, 0, x, flight).x[-2, 0]
    x[0] += 200.0 - 0.5 - gap_m - before_last_m
    assert trouble_alone(fleet, 0, x, flight) == says


@pytest.mark.parametrize(("beyond_m", "says"), [(-1e-3, "does not come home"), (1e-3, None)])
def test_a_flight_ends_within_the_landing_distance(alone, beyond_m, says):
    fleet, x, flight = alone
    x[1] += 3.0
    x[S.VX : S.VZ + 1] = (0.6, -0.5, 0.4)  # the sample before is elsewhere
    end_m = course_of(fleet, 0, 0, x, flight).x[-1, :3]
    known = {"distance_m": np.linalg.norm(end_m - START) + beyond_m, "speed_mps": 5.0}
    assert trouble_alone(with_landing(fleet, **known), 0, x, flight) == says


@pytest.mark.parametrize(("beyond_mps", "says"), [(-1e-3, "does not land"), (1e-3, None)])
def test_a_flight_ends_at_the_speed_of_landing(alone, beyond_mps, says):
    fleet, x, flight = alone
    x[S.VX : S.VZ + 1] = (0.6, -0.5, 0.4)
    speed_mps = np.linalg.norm(course_of(fleet, 0, 0, x, flight).x[-1, S.VX : S.VZ + 1])
    known = {"distance_m": 50.0, "speed_mps": speed_mps + beyond_mps}
    assert trouble_alone(with_landing(fleet, **known), 0, x, flight) == says


@pytest.mark.parametrize(("beyond", "says"), [(-1e-5, "the battery does not last"), (1e-5, None)])
def test_a_flight_leaves_a_reserve_in_the_battery(alone, beyond, says):
    fleet, x, flight = alone
    dod_max = course_of(fleet, 0, 0, x, flight).x[-1, S.DOD] + 2e-3 + beyond
    uas = fleet.brief.uas[0].model_copy(update={"dod_max": dod_max})
    fleet.brief = fleet.brief.model_copy(update={"uas": (uas,)})
    assert trouble_alone(fleet, 0, x, flight) == says


# two courses


@pytest.mark.parametrize(("gap_m", "apart"), [(-1e-4, False), (1e-4, True)])
@pytest.mark.parametrize("way", [(1.0, 0.0, 0.0), (0.0, 0.6, 0.8), (0.0, 0.0, 1.0)])
def test_two_courses_keep_the_radii_and_the_safe_distance_apart(pair, way, gap_m, apart):
    level, up = np.hypot(way[0], way[1]), abs(way[2])
    end_m = np.array(START) + np.array(way) * (KEEP_M + gap_m) / max(level, up)
    start_m = end_m + 10.0 * np.array(way)
    coming = course_along([start_m, 0.5 * (start_m + end_m), end_m], lands=False)
    assert are_apart(pair, 0, 1, hover(START), coming) == apart
    assert are_apart(pair, 1, 0, coming, hover(START)) == apart


def test_two_courses_that_cross_between_samples_are_seen(pair):
    north = straight((40.0, 60.0, -20.0), (8.0, 0.0, 0.0), 5)
    west = straight((64.0, 84.0, -20.0), (0.0, -8.0, 0.0), 5)  # 8 m short, then 8 m beyond
    at_samples = np.abs(north.x[:, :3] - west.x[:, :3])
    assert (np.hypot(at_samples[:, 0], at_samples[:, 1]) > KEEP_M).sum() >= 4
    assert not are_apart(pair, 0, 1, north, west)
    later = replace(west, x=np.vstack([west.x[:1]] * 4 + [west.x[1:]]), u=np.zeros((8, 5)))
    assert are_apart(pair, 0, 1, north, later)


def test_two_that_are_too_near_now_must_come_no_nearer(pair):
    here = hover(START, 3)
    for step_m, apart in ((0.0, True), (5.0, True), (-0.002, False)):
        other = straight(np.add(START, (3.0, 0.0, 0.0)), (step_m, 0.0, 0.0), 3, lands=False)
        assert are_apart(pair, 0, 1, here, other) == apart
        above = straight(np.array(START) - (0.0, 0.0, 4.0), (0.0, 0.0, -step_m), 3, lands=False)
        assert are_apart(pair, 0, 1, above, here) == apart


def test_a_short_hover_is_in_the_way_of_a_long_course_and_a_landed_uas_is_not(pair):
    passing = straight((20.0, 60.0, -20.0), (5.0, 0.0, 0.0), 12)
    assert not are_apart(pair, 0, 1, hover(START, 1), passing)
    assert not are_apart(pair, 0, 1, passing, hover(START, 1))
    assert are_apart(pair, 0, 1, hover(START, 1, lands=True), passing)


# a hover


def test_what_holds_a_hover_is_the_first_of_braking(pair):
    x = at(START, (5.0, -2.0, 1.0))
    here = course_along([START])
    here.x[0] = x
    stop = braked(pair.arena.vehicles[0], here, 0, 14)
    np.testing.assert_array_equal(hover_inputs(pair, 0, x), stop.u[0])

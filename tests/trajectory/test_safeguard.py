"""There is something safe to fly at every decision: each UAS can come home, and all keep apart."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from guarded_fleets import MARGIN_M, PLACES, Charge, Guarded, braked_for, moved
from hand_made import NOTHING, course_along, hover, moving, states_along, straight
from small_worlds import box
from uas_coverage_baselines.trajectory.course import are_apart
from uas_coverage_baselines.trajectory.safeguard import Seen

from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.geometry.segments import segment_clearance
from uas_coverage_env.mission import Range, first_sight
from uas_coverage_env.vehicle import layout as S

KEEP_M = 0.36 + 3.0 + MARGIN_M  # of a UAS from what stands, but counts as moving
BRAKING = 14
SPEED_MPS = 6.0


def northward(u, steps=8, **known):
    """A course from the place of a UAS to the north."""
    return straight(PLACES[u], (SPEED_MPS, 0.0, 0.0), steps, **known)


def eastward(u, steps=12, **known):
    return straight(PLACES[u], (0.0, SPEED_MPS, 0.0), steps, **known)


def westward(u, steps=12, **known):
    return straight(PLACES[u], (0.0, -SPEED_MPS, 0.0), steps, **known)


# all apart


def test_courses_that_keep_apart_are_all_flown():
    guarded = Guarded(3)
    wanted = {u: northward(u) for u in range(3)}
    chosen = guarded.chosen(wanted)
    assert chosen == {u: (wanted[u], True) for u in range(3)}
    assert guarded.guard.backups == wanted


@pytest.mark.parametrize("first", [0, 1])
def test_of_two_courses_that_meet_only_the_first_is_flown(first):
    guarded = Guarded(2)
    courses = {0: eastward(0), 1: westward(1)}
    wanted = {u: courses[u] for u in (first, 1 - first)}
    assert guarded.chosen(wanted) == {first: (courses[first], True)}


def test_where_two_of_three_courses_meet_the_third_is_flown():
    guarded = Guarded(3)
    wanted = {0: eastward(0, 7), 1: westward(1, 7), 2: northward(2)}
    assert guarded.chosen(wanted).keys() == {0, 2}


def test_a_uas_whose_course_is_in_the_way_goes_on_with_what_it_has():
    guarded = Guarded(2)
    guarded.has({1: hover(PLACES[1], 20)})
    chosen = guarded.chosen({0: northward(0), 1: westward(1)})
    assert chosen[1][1]  # clear of the other, which is gone by then
    guarded.has({1: hover(PLACES[1], 20)})
    held = guarded.guard.backups[1]
    chosen = guarded.chosen({0: eastward(0, 5), 1: westward(1)})
    assert chosen[0][1]
    assert not chosen[1][1]
    np.testing.assert_array_equal(chosen[1][0].x, held.x)


def test_a_course_is_not_flown_through_the_backup_of_another():
    guarded = Guarded(2)
    guarded.has({1: hover(PLACES[1], 20)})
    chosen = guarded.chosen({0: eastward(0)}, x1=states_along([PLACES[1]])[0])
    assert {u: as_planned for u, (_, as_planned) in chosen.items()} == {1: False}


def test_a_course_that_waits_for_another_to_leave_is_flown_in_the_same_decision():
    guarded = Guarded(2)
    guarded.has({1: hover(PLACES[1], 40)})
    # through the place of the second, which sets off in time
    wanted = {0: eastward(0), 1: northward(1, 12)}
    assert are_apart(guarded.fleet, 0, 1, wanted[0], wanted[1])
    assert guarded.chosen(wanted) == {u: (course, True) for u, course in wanted.items()}
    # and where a third is in the way, of which nothing else can be flown
    guarded = Guarded(3)
    guarded.has({1: hover(PLACES[1], 40), 2: hover(PLACES[2], 40)})
    wanted = {0: eastward(0, 20), 1: northward(1, 12)}
    still = states_along([PLACES[2]])[0]
    assert {u for u, (_, new) in guarded.chosen(wanted, x2=still).items() if new} == {1}


def test_a_course_taken_second_keeps_clear_of_those_taken_first():
    guarded = Guarded(3)
    guarded.has({u: hover(PLACES[u], 40) for u in range(3)})
    wanted = {0: eastward(0), 1: northward(1), 2: westward(2)}
    chosen = guarded.chosen(wanted)
    flown = [course for course, _ in chosen.values()]
    assert sum(as_planned for _, as_planned in chosen.values()) == 2
    for i in range(3):
        for j in range(i):
            assert are_apart(guarded.fleet, i, j, flown[i], flown[j])


def test_a_uas_that_does_not_fly_is_left_out():
    guarded = Guarded(2)
    swarm = guarded.swarm
    status = np.array([FLYING, LANDED], swarm.status.dtype)
    chosen = guarded.guard.chosen(replace(swarm, status=status), {}, NOTHING)
    assert chosen.keys() == {0}
    assert guarded.guard.backups.keys() == {0}


def test_a_uas_that_lands_where_it_is_is_in_the_way_for_one_step_only():
    guarded = Guarded(2)
    late = straight(PLACES[0], (0.0, 4.0, 0.0), 14)
    chosen = guarded.chosen({0: late}, staying=[1])
    assert chosen[0] == (late, True)
    landing, as_planned = chosen[1]
    assert (landing.lands, len(landing.u), as_planned) == (True, 1, False)
    np.testing.assert_array_equal(landing.x[:, :3], [PLACES[1]] * 2)
    beside = straight(np.array(PLACES[1]) - (0.0, 5.9, 0.0), (0.0, SPEED_MPS, 0.0), 3)
    assert 0 not in guarded.chosen({0: beside}, staying=[1])


# what is left of a backup holds


def test_after_a_step_what_is_left_of_the_backup_is_flown():
    guarded = Guarded(1)
    course = northward(0)
    guarded.has({0: course})
    for step in (1, 2, 5):
        (flown, as_planned) = guarded.chosen({}, step=step, x0=course.x[step])[0]
        assert not as_planned
        assert flown.begin == step
        np.testing.assert_array_equal(flown.x, course.x[step:])
        np.testing.assert_array_equal(flown.u, course.u[step:])


def test_a_backup_that_begins_elsewhere_is_not_flown():
    guarded = Guarded(1)
    course = northward(0)
    guarded.has({0: course})
    elsewhere = course.x[1].copy()
    elsewhere[1] += 0.01
    (flown, _) = guarded.chosen({}, step=1, x0=elsewhere)[0]
    np.testing.assert_array_equal(flown.x[0], elsewhere)
    assert len(flown.u) == BRAKING
    assert np.linalg.norm(flown.x[-1, S.VX : S.VZ + 1]) < 0.05


def test_a_backup_that_something_has_come_to_cross_is_not_flown():
    guarded = Guarded(1)
    course = northward(0, 12)
    guarded.has({0: course})
    far, near = (moving(((100.0, 60.0 + off_m, -20.0), (0.0, 0.0, 0.0))) for off_m in (9.0, 7.0))
    assert guarded.chosen({}, far, 1, x0=course.x[1])[0][0].u.shape[0] == 11
    guarded.has({0: course})
    stop, _ = guarded.chosen({}, near, 1, x0=course.x[1])[0]
    np.testing.assert_array_equal(stop.x, braked_for(guarded.fleet, course.rest(1), 0).x)


def test_a_hover_at_the_end_of_a_backup_holds_until_something_comes():
    guarded = Guarded(1)
    over = hover(PLACES[0], 1).rest(5)
    guarded.has({0: over})
    assert len(guarded.chosen({}, step=9, x0=over.x[0])[0][0].u) == 0
    coming = moving(((40.0, 75.0, -20.0), (0.0, -9.0, 0.0)))
    guarded.has({0: over})
    assert not guarded.chosen({}, coming, step=9, x0=over.x[0])


def test_what_passes_over_the_place_of_a_landed_uas_does_no_harm():
    guarded = Guarded(1)
    landed = hover(PLACES[0], 2, lands=True).rest(2)
    guarded.has({0: landed})
    beside = moving(((40.0, 66.0, -20.0), (0.0, -9.0, 0.0)))
    chosen = guarded.chosen({}, beside, step=2, x0=landed.x[0])
    assert chosen[0][0].lands


class Spared:
    """What moves, which leaves a path so much to spare."""

    def __init__(self, spare):
        self.spare = spare

    def spare_m(self, path_m, radius_m, margin_m):
        assert (radius_m, margin_m) == (0.36, MARGIN_M)
        return self.spare


def test_what_is_kept_in_full_is_enough():
    places = np.array([(199.4, 60.0, -20.0), (199.5, 60.0, -20.0)])  # to the margin of the fence
    course, over = course_along(places, lands=False), course_along(np.add(places, (1e-6, 0.0, 0.0)))
    fleet = Guarded(1).fleet
    for spare_m, clear in ((0.0, True), (-1e-9, False)):
        seen = Seen(fleet, Spared(spare_m), MARGIN_M, Charge())
        assert seen.is_clear(0, course) == clear
        assert seen.may_stop(0, course, 0) == clear
        assert not seen.may_stop(0, over, 0)
    for spare, comes_home in ((0.0, True), (-1e-9, False)):
        seen = Seen(fleet, NOTHING, MARGIN_M, Charge(lambda x, spare=spare: spare))
        assert seen.comes_home(0, places[0]) == comes_home


# stopping at once


def reach_m(guarded, x):
    """How far north braking from a state leads."""
    here = replace(hover(PLACES[0], 0), x=x[None])
    return float(braked_for(guarded.fleet, here, 0).x[:, 0].max())


@pytest.mark.parametrize(("gap_m", "stops"), [(-0.05, False), (0.05, True)])
def test_a_uas_with_nothing_to_fly_brakes_where_that_is_clear_of_what_stands(gap_m, stops):
    x = moved((8.0, 0.0, 0.0))
    wall_m = reach_m(Guarded(1), x) + 2.36 + gap_m
    wall = box("wall", (wall_m, 20.0, -45.0), (wall_m + 10.0, 100.0, 0.0))
    guarded = Guarded(1, obstacles=(wall,))
    chosen = guarded.chosen({}, x0=x)
    assert (0 in chosen) == stops
    assert guarded.guard.backups.keys() == chosen.keys()


@pytest.mark.parametrize(("gap_m", "stops"), [(-0.05, False), (0.05, True)])
def test_a_uas_with_nothing_to_fly_brakes_where_it_stays_within_the_fence_s_margin(gap_m, stops):
    guarded, x = Guarded(1), moved((8.0, 0.0, 0.0))
    x[0] += 200.0 - 0.5 - gap_m - reach_m(guarded, x)
    assert (0 in guarded.chosen({}, x0=x)) == stops


@pytest.mark.parametrize(("gap_m", "stops"), [(-0.05, False), (0.05, True)])
def test_a_uas_with_nothing_to_fly_brakes_where_that_is_clear_of_what_moves(gap_m, stops):
    guarded, x = Guarded(1), moved((8.0, 0.0, 0.0))
    parked_m = reach_m(guarded, x) + 4.0 + KEEP_M + gap_m
    parked = moving(((parked_m, 60.0, -20.0), (0.0, 0.0, 0.0)))
    assert (0 in guarded.chosen({}, parked, x0=x)) == stops


def test_a_uas_that_has_a_course_does_not_stop_for_want_of_a_backup():
    guarded = Guarded(2)
    wanted = {0: eastward(0), 1: northward(1, 2)}  # the second hovers in the first's way, landed
    assert guarded.chosen(wanted) == {u: (course, True) for u, course in wanted.items()}
    blocked = moving(((52.0, 60.0, -20.0), (0.0, 0.0, 0.0)))
    assert not Guarded(1).chosen({0: northward(0)}, blocked)


# a course that comes near to what moves is followed for a while, then braked


def parked_at(north_m):
    return moving(((north_m, 60.0, -20.0), (0.0, 0.0, 0.0)))


def stops_m(guarded, course):
    """(N,) the farthest north that following a course for 1..N steps and braking leads."""
    n = len(course.u)
    return np.array(
        [braked_for(guarded.fleet, course, k).x[:, 0].max() for k in range(1, n + 1)], float
    )


def test_a_course_clear_of_what_moves_is_flown_to_its_end():
    guarded = Guarded(1)
    course = northward(0, 10)
    for off_m, whole in ((8.2, False), (8.5, True)):
        beyond = parked_at(course.x[-1, 0] + off_m)
        flown, as_planned = guarded.chosen({0: course}, beyond)[0]
        assert as_planned
        assert (flown is course) == whole


def test_of_a_course_that_meets_something_the_longest_part_is_followed_that_is_clear():
    guarded = Guarded(1)
    course = northward(0, 16)
    wall_m = 110.0
    flown, as_planned = guarded.chosen({0: course}, parked_at(wall_m + 4.0 + KEEP_M))[0]
    clear = stops_m(guarded, course) <= wall_m
    followed = int(np.flatnonzero(clear).max()) + 1
    assert as_planned
    assert 1 < followed < 16
    expected = braked_for(guarded.fleet, course, followed)
    np.testing.assert_array_equal(flown.x, expected.x)
    assert not flown.lands


def test_a_course_is_followed_for_half_a_minute_at_most():
    guarded = Guarded(1)
    course = straight(PLACES[0], (2.0, 0.0, 0.0), 45)
    flown, _ = guarded.chosen({0: course}, parked_at(course.x[-1, 0] + 4.0))[0]
    assert len(flown.u) == 30 + BRAKING
    short = straight(PLACES[0], (2.0, 0.0, 0.0), 20)
    meets = parked_at(short.x[20, 0] + 4.0 + KEEP_M + 5.0)  # braking is what leads too near
    flown, _ = guarded.chosen({0: short}, meets)[0]
    assert len(flown.u) <= 20 + BRAKING


def test_a_course_that_cannot_be_followed_for_a_step_is_not_flown():
    guarded = Guarded(1)
    course = northward(0, 10)
    assert not guarded.chosen({0: course}, parked_at(course.x[1, 0] + 4.0 + KEEP_M - 1.0))
    assert not guarded.chosen({0: course.rest(10)}, x0=course.x[0])


@pytest.mark.parametrize(("has_wall", "followed"), [(False, 8), (True, 7)])
def test_a_course_is_not_left_where_braking_would_hit_what_stands(has_wall, followed):
    north = np.array(PLACES[0]) + np.outer(np.arange(9), (SPEED_MPS, 0.0, 0.0))
    corner_m = north[-1]
    east = corner_m + np.outer(np.arange(1, 9), (0.0, SPEED_MPS, 0.0))
    course = course_along(np.vstack([north, east]))
    low_m, high_m = (np.add(corner_m, off) for off in ((6.0, -20.0, -9.0), (9.0, 60.0, 20.0)))
    wall = box("wall", low_m, high_m)
    guarded = Guarded(1, obstacles=(wall,) if has_wall else ())
    parked = moving((np.add(corner_m, (0.0, 12.4, 0.0)), (0.0, 0.0, 0.0)))
    flown, _ = guarded.chosen({0: course}, parked)[0]
    assert len(flown.u) == followed + BRAKING
    if has_wall:
        hull = guarded.fleet.brief.hulls[0]
        beyond = braked_for(guarded.fleet, course, followed + 1)
        for trial, keeps in ((flown, True), (beyond, False)):
            assert (clearance_m(hull, trial.x[:, :3]) >= 2.36) == keeps


def clearance_m(hull, path_m):
    return min(
        segment_clearance(hull.normals, hull.offsets_m, 0, hull.n_faces, *p, *q)
        for p, q in pairwise(path_m)
    )


# comes home


@pytest.mark.parametrize(("spare", "follows"), [(0.0, True), (-1e-9, False)])
def test_a_braked_course_is_flown_where_its_hover_leaves_charge_for_the_way_home(spare, follows):
    guarded = Guarded(1, Charge(lambda x: spare))
    course = northward(0, 16)
    chosen = guarded.chosen({0: course}, parked_at(130.0))
    assert (0 in chosen) == follows
    hovers = np.array([x for _, x in guarded.way_home.asked])
    assert {uas for uas, _ in guarded.way_home.asked} == {0}
    assert np.linalg.norm(hovers[:, S.VX : S.VZ + 1], axis=1).max() < 0.05


def test_a_course_is_left_in_time_to_come_home():
    turns_back_m = 75.0
    guarded = Guarded(1, Charge(lambda x: turns_back_m - x[0]))
    course = northward(0, 16)
    flown, _ = guarded.chosen({0: course}, parked_at(130.0))[0]
    clear = stops_m(guarded, course) <= turns_back_m
    assert len(flown.u) == int(np.flatnonzero(clear).max()) + 1 + BRAKING


def test_a_course_that_lands_is_not_asked_for_charge_once_more():
    guarded = Guarded(1, Charge(lambda x: -1.0))
    course = northward(0)
    assert guarded.chosen({0: course})[0] == (course, True)
    assert not guarded.way_home.asked


@pytest.mark.parametrize(("dod", "follows"), [(0.3, True), (0.735, False)])
def test_with_a_battery_that_only_just_lands_no_course_is_braked_on(dod, follows):
    # it flies home in seven steps, and would hover in front of what has come between
    home_m, start_m = np.array(PLACES[0]), np.add(PLACES[0], (42.0, 0.0, 0.0))
    guarded = Guarded(1)
    guarded = Guarded(1, Range(guarded.fleet.brief))
    course = straight(start_m, (-SPEED_MPS, 0.0, 0.0), 7, dod=dod)
    assert np.linalg.norm(course.x[-1, :3] - home_m) < 1e-9
    between = parked_at(home_m[0] - 4.0)
    held = hover(start_m, 5, dod=dod)
    guarded.has({0: held})
    flown, as_planned = guarded.chosen({0: course}, between)[0]
    assert as_planned == follows
    assert flown.lands is False


def test_the_first_sight_of_a_mission_holds_what_a_guard_needs():
    guarded = Guarded(2)
    swarm = first_sight(guarded.fleet.brief)
    chosen = guarded.guard.chosen(swarm, {}, NOTHING)
    assert [np.abs(c.x[:, :3] - c.x[0, :3]).max() < 0.1 for c, _ in chosen.values()] == [True] * 2

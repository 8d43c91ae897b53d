"""A course and what is left of it, and how it is left: by braking to a hover."""

import numpy as np
import pytest
from backup_worlds import straight, supervisor_of

from uas_coverage_env.planning.backup.course import are_apart, braked
from uas_coverage_env.vehicle import compile_vehicle, load_vehicle
from uas_coverage_env.vehicle import layout as S

START = (60.0, 60.0, -20.0)


def test_the_rest_of_a_course_begins_later_and_ends_when_it_ends():
    course = straight(START, (2.0, 0.0, 0.0), 5, begin=3)
    rest = course.rest(5)
    assert (rest.begin, rest.end, rest.lands) == (5, 8, True)
    np.testing.assert_array_equal(rest.x, course.x[2:])
    np.testing.assert_array_equal(rest.u, course.u[2:])
    over = course.rest(11)
    assert (over.begin, len(over.u), len(over.x)) == (11, 0, 1)
    np.testing.assert_array_equal(over.x[0], course.x[-1])


@pytest.mark.parametrize("state", range(S.N_STATES))
def test_a_uas_flies_its_course_where_every_state_but_its_batterys_is_as_planned(state):
    course = straight(START, (2.0, 0.0, 0.0), 5)
    for off, flies in ((2e-6, state >= S.DOD), (-2e-6, state >= S.DOD), (5e-7, True)):
        x = course.x[0].copy()
        x[state] += off
        assert course.begins_at(x) == flies


def test_a_hover_is_held_and_a_uas_that_has_landed_is_gone():
    for lands in (False, True):
        course = straight(START, (2.0, 0.0, 0.0), 3, lands=lands)
        path_m = course.path_m(6)
        assert len(path_m) == (4 if lands else 7)
        np.testing.assert_array_equal(path_m[:4], course.x[:, :3])
        np.testing.assert_array_equal(path_m[4:], np.tile(course.x[-1, :3], (len(path_m) - 4, 1)))
        assert len(course.path_m(2)) == 3
        assert len(course.path_m(3)) == 4


@pytest.mark.parametrize(("dt_s", "steps"), [(1.0, 14), (0.8, 18), (0.5, 28)])
def test_a_course_is_followed_for_some_steps_and_then_braked_to_a_hover(dt_s, steps):
    vehicle = compile_vehicle(load_vehicle("s500_v2"), dt_s)[()]
    assert supervisor_of(dt_s=dt_s).braking_steps == steps
    course = straight(START, (6.0, 0.0, 0.0), 9, begin=4)
    for followed in (0, 1, 5, 9):
        trial = braked(vehicle, course, followed, steps)
        assert (trial.begin, trial.lands, len(trial.u)) == (4, False, followed + steps)
        np.testing.assert_array_equal(trial.x[: followed + 1], course.x[: followed + 1])
        np.testing.assert_array_equal(trial.u[:followed], course.u[:followed])
        assert np.linalg.norm(trial.x[-1, S.VX : S.VZ + 1]) < 0.05
        assert (trial.x[-1, 0] > course.x[followed, 0] + 3.0) == (followed > 0)


@pytest.mark.parametrize(("keep_m", "apart"), [(9.999, True), (10.001, False)])
def test_two_courses_are_apart_by_what_is_to_be_kept(keep_m, apart):
    coming = straight((60.0, 80.0, -20.0), (0.0, -2.0, 0.0), 5)
    assert are_apart(straight(START, (0.0, 0.0, 0.0), 5), coming, keep_m) == apart

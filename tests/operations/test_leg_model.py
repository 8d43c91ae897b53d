"""The model of how an autopilot flies a file is held against flights of a real one."""

import math
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

pytest.importorskip("pyproj")

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from recorded_flights import NAMES as FLIGHTS
from recorded_flights import modelled, recorded

from uas_coverage_env.operations.path_geometry import cut_path, distances_m
from uas_coverage_env.planning.execution.leg_model import DT_S, Autopilot, follow

EXAMPLES = settings(max_examples=40, deadline=None, derandomize=True)


@pytest.mark.parametrize("name", FLIGHTS)
def test_recorded_flights_take_as_long_as_the_model_says(name):
    assert len(FLIGHTS) == 4
    times_s, _ = recorded(name)
    assert modelled(name)[0].duration_s == pytest.approx(times_s[-1], rel=0.02)


@pytest.mark.parametrize("name", FLIGHTS)
def test_a_recorded_flight_passes_each_place_at_the_time_of_the_model(name):
    followed, _ = modelled(name)
    times_s, places_m = recorded(name)
    at_that_time = [np.interp(times_s, followed.times_s, p) for p in followed.places_m.T]
    off_m = np.linalg.norm(np.transpose(at_that_time) - places_m, axis=1)
    assert np.median(off_m) < 10.0
    # the path itself is met much better than the time
    to_path_m = [np.linalg.norm(followed.places_m - place, axis=1).min() for place in places_m]
    assert np.percentile(to_path_m, 95) < 1.5


CORNERS = st.lists(
    st.tuples(st.floats(-80, 80), st.floats(-80, 80), st.floats(-60, -5)), min_size=2, max_size=8
)


@EXAMPLES
@given(CORNERS, st.floats(0.5, 10.0), st.booleans())
def test_the_model_keeps_to_its_limits_and_the_vehicle_where_it_was(corners, speed, stop):
    by = Autopilot()
    n = len(corners) - 1
    followed = follow(corners, [speed] * n, [1.0 * stop] * n, by)
    steps_m = np.diff(followed.places_m, axis=0)
    # two legs at once in a turn: each within its own speed
    assert np.linalg.norm(steps_m, axis=1).max() <= 2.0 * DT_S * by.speed_mps
    assert np.abs(steps_m[:, 2]).max() <= 2.0 * DT_S * by.up_mps + 1e-9
    assert followed.places_m[0].tolist() == [*corners[0][:2], 0.0]
    assert followed.places_m[-1] == pytest.approx([*corners[-1][:2], 0.0], abs=0.2)
    assert len(followed.corner_s) == len(corners)
    assert (np.diff(followed.corner_s) >= 0.0).all()


@EXAMPLES
@given(CORNERS, st.floats(0.5, 10.0))
def test_a_vehicle_that_stops_at_corners_is_on_the_legs_and_reaches_them(corners, speed):
    n = len(corners) - 1
    followed = follow(corners, [speed] * n, [1.0] * n, Autopilot())
    for time_s, corner in zip(followed.corner_s, corners, strict=True):
        place = followed.places_m[round(time_s / DT_S)]
        assert np.linalg.norm(place - corner) < 0.1
    off_m = np.full(len(followed.places_m), np.inf)
    ground = (*corners[0][:2], 0.0), (*corners[-1][:2], 0.0)
    for a, b in pairwise([ground[0], *corners, ground[1]]):
        a, way = np.array(a), np.subtract(b, a)
        share = np.clip((followed.places_m - a) @ way / max(way @ way, 1e-12), 0.0, 1.0)
        away = np.linalg.norm(followed.places_m - a - share[:, None] * way, axis=1)
        off_m = np.minimum(off_m, away)
    assert off_m.max() < 1e-6


def test_a_corner_is_cut_by_no_more_than_the_waypoint_radius():
    corners = [(0.0, 0.0, -20.0), (100.0, 0.0, -20.0), (100.0, 100.0, -20.0)]
    for corner_m in (1.0, 2.0, 5.0):
        followed = follow(corners, [10.0] * 2, [0.0] * 2, Autopilot(corner_m=corner_m))
        nearest_m = np.linalg.norm(followed.places_m - np.array(corners[1]), axis=1).min()
        assert 0.1 < nearest_m <= 1.05 * corner_m


@EXAMPLES
@given(CORNERS, st.floats(0.5, 10.0), st.floats(1.0, 5.0))
def test_a_vehicle_that_does_not_stop_is_inside_the_corners_that_were_checked(
    corners, speed, corner_m
):
    assume(all(math.dist(a, b) > 1.0 for a, b in pairwise(corners)))
    n = len(corners) - 1
    followed = follow(corners, [speed] * n, [0.0] * n, Autopilot(corner_m=corner_m))
    first, last = (round(s / DT_S) for s in followed.corner_s[[0, -1]])
    path = cut_path(np.array(corners), [False] * n, corner_m)
    around = [*pairwise(np.array(corners)), *pairwise(path)]
    places = followed.places_m[first : last + 1]
    # between the legs and their cuts; half the depth of a cut is the farthest from both
    off_m = np.min([distances_m(places, a, b) for a, b in around], axis=0)
    assert off_m.max() <= 0.55 * corner_m


def test_short_legs_are_slow_and_a_stop_takes_time():
    straight = [(10.0 * k, 0.0, -20.0) for k in range(11)]
    ends = [straight[0], straight[-1]]
    few, many = (
        follow(c, [10.0] * (len(c) - 1), [0.0] * (len(c) - 1), Autopilot()).duration_s
        for c in (ends, straight)
    )
    stopping = follow(straight, [10.0] * 10, [1.0] * 10, Autopilot()).duration_s
    assert few + 10.0 < many < stopping - 10.0

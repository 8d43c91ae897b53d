"""How fast plan time may pass, for plans of any course."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_worlds import box, meadow

pytest.importorskip("pyproj")

from uas_coverage_env.operations.stream.surroundings import SwarmSurroundings, stopping_place_m
from uas_coverage_env.operations.stream.time_scaling import SHARE, STEP_S, Pace
from uas_coverage_env.operations.stream.timeline import Timeline
from uas_coverage_env.operations.stream.vehicle_limits import Limits

WALL = box("wall", (0.0, 100.0, -45.0), (199.0, 104.0, 0.0))
LIMITS = Limits()


def plan_of(speeds, turns):
    """A level plan of one second steps: speeds [m/s] and turns [rad] from the one before."""
    headings = np.cumsum(turns)
    velocities = np.column_stack([np.cos(headings), np.sin(headings), 0.0 * headings])
    velocities = velocities * np.array(speeds)[:, None]
    velocities[[0, -1]] = 0.0
    steps = 0.5 * (velocities[:-1] + velocities[1:])
    places = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    return Timeline(np.arange(len(speeds), dtype=float), places, velocities)


def pace_of(plan, limits=LIMITS, *, may_hurry=True):
    middle_m = np.array([100.0, 150.0, -20.0]) - plan.places_m[0]
    moved = Timeline(plan.times_s, plan.places_m + middle_m, plan.velocities_mps)
    around = SwarmSurroundings(meadow(), ["uas_1"])
    return Pace({"uas_1": moved}, {"uas_1": limits}, around, 1.5, may_hurry)


courses = st.lists(
    st.tuples(st.floats(0.0, 14.0), st.floats(-0.6, 0.6)), min_size=5, max_size=30
).map(lambda legs: plan_of(*zip(*legs, strict=True)))


@settings(max_examples=40, deadline=None)
@given(courses)
def test_a_vehicle_is_never_asked_for_more_speed_or_acceleration_than_it_has(plan):
    pace = pace_of(plan)
    # as it is flown: time by time, with the rate of then
    time_s, plan_s, places = 0.0, plan.first_s, []
    while plan_s < plan.last_s and time_s < 2_000.0:
        rate = pace.at(plan_s)
        assert rate * np.hypot(*plan.velocity_mps(plan_s)[:2]) < LIMITS.speed_mps + 0.1
        places.append(rate * plan.velocity_mps(plan_s))
        plan_s += rate * 0.1
        time_s += 0.1
    assert plan_s >= plan.last_s
    assert time_s < 2_000.0
    changes = np.linalg.norm(np.diff(places, axis=0), axis=1) / 0.1
    if len(changes) > 10:  # over a second: a plan's acceleration jumps at its samples
        mean = np.convolve(changes, np.full(10, 0.1), "valid")
        assert mean.max() < 1.15 * LIMITS.acceleration_mps2 + 0.2


@settings(max_examples=40, deadline=None)
@given(courses)
def test_time_passes_no_faster_than_time_where_it_may_not(plan):
    pace = pace_of(plan, may_hurry=False)
    rates = [pace.at(plan_s) for plan_s in np.arange(plan.first_s, plan.last_s, STEP_S)]
    assert max(rates) <= 1.0
    assert pace.late_s() >= 0.0


@settings(max_examples=40, deadline=None)
@given(
    st.floats(3.0, 10.0), st.floats(0.6, math.pi - 0.6), st.floats(20.0, 80.0), st.floats(2.0, 8.0)
)
def test_a_vehicle_whose_link_is_cut_anywhere_stops_clear_of_a_wall(speed, angle, before_m, near_m):
    # towards a wall, then away from it: it comes as near as asked, slowing down late
    east = 100.0 - near_m - 0.36
    seconds = max(int(before_m / speed), 3)
    there = np.linspace(-before_m, 0.0, seconds + 1)
    way = np.concatenate([there, there[::-1][1:]])
    velocities = np.gradient(way)
    velocities[[0, -1]] = 0.0
    along = np.array([math.cos(angle), math.sin(angle), 0.0])
    places = np.array([100.0, east, -20.0]) + way[:, None] * along
    places[:, 0] = np.clip(places[:, 0], 20.0, 180.0)
    plan = Timeline(np.arange(len(way), dtype=float), places, velocities[:, None] * along)
    around = SwarmSurroundings(meadow(((100.0, 60.0, -1.0),), obstacles=[WALL]), ["uas_1"])
    pace = Pace({"uas_1": plan}, {"uas_1": LIMITS}, around, 1.5, may_hurry=True)
    for plan_s in np.arange(plan.first_s, plan.last_s, 0.2):
        place_m = plan.place_m(plan_s)
        if around.room_m("uas_1", place_m, place_m) <= 0.3:
            continue  # its own curve leads there
        velocity_mps = pace.at(plan_s) * plan.velocity_mps(plan_s)
        end_m = stopping_place_m(place_m, velocity_mps, LIMITS)
        # down to the least rate, at which it all but stands
        slowest = pace.at(plan_s) <= 0.06
        assert around.room_m("uas_1", place_m, end_m) > -0.2 or slowest


def test_all_slow_down_where_one_that_stops_would_be_in_the_way_of_another():
    # the second follows the first 15 m behind, at 10 m/s
    times = np.arange(14.0)
    along = np.concatenate([[0.0, 5.0], 5.0 + 10.0 * np.arange(1.0, 11.0), [110.0, 110.0]])
    speeds = np.concatenate([[0.0], np.full(11, 10.0), [0.0, 0.0]])
    plans = {
        name: Timeline(
            times,
            np.column_stack([30.0 + ahead + along, np.full(14, 60.0), np.full(14, -20.0)]),
            np.column_stack([speeds, np.zeros(14), np.zeros(14)]),
        )
        for name, ahead in (("uas_1", 15.0), ("uas_2", 0.0))
    }
    starts = (60.0, 60.0, -1.0), (30.0, 60.0, -1.0)
    around = SwarmSurroundings(meadow(starts), ["uas_1", "uas_2"])
    both = Pace(plans, dict.fromkeys(plans, LIMITS), around, 1.5, may_hurry=False)
    alone = Pace({"uas_1": plans["uas_1"]}, {"uas_1": LIMITS}, around, 1.5, may_hurry=False)
    assert both.slowed["others"] > 0
    assert both.late_s() > alone.late_s() + 3.0


def test_rates_fall_and_rise_no_faster_than_vehicles_can_brake_and_accelerate():
    plan = plan_of([0.0] + [10.0] * 20 + [0.0], [0.0] * 22)
    pace = pace_of(plan)
    fall, rise = pace.change(10.0, 1.0)
    assert fall == pytest.approx(-SHARE * LIMITS.acceleration_mps2 / 10.0)
    assert rise == pytest.approx(SHARE * LIMITS.acceleration_mps2 / 10.0)

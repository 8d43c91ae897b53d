"""What was flown is what comes back: from arming to landing, at the rate of the log."""

import json

import numpy as np
import pytest

pytest.importorskip("pyproj")

from flown_flights import FAR_M, FLIES_S, WAYPOINTS_M, judged, logged, places_m, said

from uas_coverage_env import Flight
from uas_coverage_env.flight import covered_at
from uas_coverage_env.flight.metrics import energy_Wh
from uas_coverage_env.flight.record import LANDED, LOST
from uas_coverage_env.operations.logs.logged import Said, Span

N = len(WAYPOINTS_M)
LONG_S = FLIES_S + 4.0


def times_of(rate_hz=10.0, ends_s=LONG_S, begins_s=0.0):
    return np.arange(round((ends_s - begins_s) * rate_hz) + 1) / rate_hz + begins_s


def test_a_waypoint_that_is_passed_between_two_samples_of_the_plan_is_covered():
    times_s = times_of(10.0)
    made = judged(logged(times_s, places_m(times_s, 2.37), armed=(Span(0.0, LONG_S),)))
    assert made.flight.covered[-1] == N
    assert made.flight.scenario.dt_s == 1.0
    at = covered_at(made.flight)
    assert (np.diff(at) > 0).all()
    # the way there takes 8 s up and 12 m/s: in the sample that follows
    wanted_s = 2.37 + 8.0 + (np.array(WAYPOINTS_M)[:, 0] - 5.1) / 12.0
    assert np.abs(at - wanted_s).max() <= 1.1


def test_what_only_a_straight_line_between_two_positions_touches_is_not_covered():
    far = np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 20.0), (60.0, 0.0, 20.0), (0.0, 0.0, 20.0),
                    (0.0, 0.0, 0.0)])  # fmt: skip
    made = judged(logged([0.0, 5.0, 10.0, 15.0, 20.0], far, armed=(Span(0.0, 20.0),)))
    assert made.flight.covered[-1] == 0
    assert not made.flight.of_log.unknown  # it is no gap, as the log is as slow as that


WALL = {
    "name": "wall",
    "safe_distance_m": 1.0,
    "vertices_m": [(n, e, d) for n in (99.0, 101.0) for e in (-9.0, 9.0) for d in (-40.0, 0.0)],
}


def test_a_contact_between_two_samples_of_the_plan_is_one():
    pole = WALL | {
        "vertices_m": [(n, e, d) for n in (99, 101) for e in (2.5, 4.5) for d in (-40, 0)]
    }
    times_s = times_of(10.0)
    flown_m = places_m(times_s, 2.0)
    beside = (np.abs(flown_m[:, 0] - 100.0) < 4.0) & (times_s < 30.0)
    flown_m[beside, 1] = 3.5  # it swerves, for less than a second
    made = judged(logged(times_s, flown_m, armed=(Span(0.0, LONG_S),)), obstacles=[pole])
    assert [v.kind for v in made.flight.violations] == ["obstacle"]
    rare = times_s % 1.0 == 0.0
    slow = judged(logged(times_s[rare], flown_m[rare], armed=(Span(0.0, 60.0),)), obstacles=[pole])
    assert not slow.flight.violations


@pytest.mark.parametrize("armed", [True, False])
def test_a_hover_in_the_landing_sphere_before_it_goes_is_no_landing(armed):
    times_s = times_of(4.0, LONG_S + 20.0)
    flown_m = places_m(times_s, 20.0)
    hovers = (times_s > 3.0) & (times_s < 21.2)
    flown_m[hovers, 2] = 3.0 + 0.01 * np.sin(times_s[hovers])  # within 2 m of 1 m, or just not
    spans = (Span(1.0, LONG_S + 19.0),) if armed else None
    made = judged(logged(times_s, flown_m, armed=spans))
    assert made.flight.covered[-1] == N
    assert (made.flight.mode[-1] == LANDED).all()
    assert made.flight.steps > FLIES_S


def test_a_flight_begins_when_it_is_armed_whatever_it_seems_to_do_on_the_ground():
    times_s = times_of(2.0, 200.0 + LONG_S)
    flown_m = places_m(times_s, 201.0)
    ground = times_s < 200.0
    flown_m[ground, 0] += np.linspace(-8.0, 0.0, ground.sum())
    flown_m[ground, 2] += np.linspace(3.5, 0.0, ground.sum())
    log = logged(times_s, flown_m, armed=(Span(200.0, 200.0 + FLIES_S + 2.0),))
    made = judged(log)
    assert made.flight.covered[-1] == N
    assert made.flight.steps == pytest.approx(FLIES_S + 2.0, abs=2.0)
    assert (made.flight.mode[-1] == LANDED).all()
    # nothing is used before
    assert made.flight.soc[0, 0] == 1.0
    assert energy_Wh(made.flight)[0] < 10.0


def test_what_is_armed_and_stays_on_the_ground_is_no_flight():
    times_s = times_of(2.0, 40.0 + LONG_S)
    flown_m = places_m(times_s, 41.0)
    flown_m[times_s < 30.0, 2] += 0.4
    spans = (Span(5.0, 25.0), Span(40.0, 40.0 + FLIES_S + 2.0))
    made = judged(logged(times_s, flown_m, armed=spans))
    assert made.flight.covered[-1] == N


def two_flights():
    times_s = times_of(4.0, 300.0)
    flown_m = places_m(times_s, 11.0)
    second = times_s > 150.0
    flown_m[second] = places_m(times_s[second], 201.0)
    flown_m[second, 2] *= 2.0
    spans = (Span(10.0, 11.0 + FLIES_S), Span(200.0, 201.0 + FLIES_S))
    return logged(times_s + 1.7e9, flown_m, armed=tuple(
        Span(1.7e9 + a, 1.7e9 + b) for a, b, _ in spans
    ))  # fmt: skip


def test_several_flights_of_a_log_are_listed_and_one_is_chosen():
    both = r"1 \(22:13:30 UTC, 5\d s, up to 20 m\), 2 \(22:16:40 UTC, 5\d s, up to 40 m\)"
    with pytest.raises(ValueError, match=rf"holds 2 flights: {both}; choose with --flight N"):
        judged(two_flights())
    with pytest.raises(ValueError, match=r"has no flight 3; it holds 1 \("):
        judged(two_flights(), {"uas_1": 3})
    assert judged(two_flights(), {"uas_1": 1}).flight.covered[-1] == N
    higher = judged(two_flights(), {"uas_1": 2}).flight
    assert higher.covered[-1] == 0
    assert higher.x[:, 0, 2].min() == pytest.approx(-40.0)


def test_it_has_landed_when_its_autopilot_says_so_not_when_it_disarms():
    times_s = times_of(4.0, LONG_S + 60.0)
    log = logged(
        times_s,
        places_m(times_s, 1.0),
        armed=(Span(0.0, LONG_S + 50.0),),
        in_air=(Span(1.5, FLIES_S + 1.0),),
    )
    assert judged(log).flight.steps == pytest.approx(FLIES_S + 1.0, abs=1.5)


def test_one_that_is_disarmed_elsewhere_has_not_come_home():
    times_s = times_of(4.0)
    flown_m = places_m(times_s, 1.0)
    flown_m[times_s > 30.0] = flown_m[times_s <= 30.0][-1]
    flown_m[times_s > 45.0, 2] = 0.0
    made = judged(logged(times_s, flown_m, armed=(Span(0.5, 50.0),)))
    assert made.flight.mode[-1, 0] != LANDED
    assert "it lands away from home, 49.0 s after take-off" in said(made)


@pytest.mark.parametrize(("beside_m", "home"), [(8.0, True), (40.0, False)])
def test_one_put_down_beside_its_start_comes_home_to_where_it_took_off(beside_m, home):
    times_s = times_of(4.0)
    made = judged(
        logged(times_s, places_m(times_s, 1.0, -beside_m), armed=(Span(0.0, FLIES_S + 1.0),))
    )
    assert (made.flight.mode[-1, 0] == LANDED) == home
    assert f"it takes off {beside_m:.1f} m from its start" in said(made)


def test_the_last_metres_to_the_ground_are_no_breach_of_the_fence():
    made = judged(whole())
    assert made.flight.scenario.fence is not None
    assert made.flight.scenario.geofence.margin_m > 0.0
    assert made.flight.breaches == 0


def without(log, from_s, to_s):
    return log.at((log.time_s <= from_s) | (log.time_s >= to_s))


def whole(rate_hz=10.0, begins_s=2.0, clock_s=0.0, **more):
    times_s = times_of(rate_hz)
    spans = (Span(clock_s, clock_s + begins_s + FLIES_S),)
    return logged(times_s + clock_s, places_m(times_s, begins_s), armed=spans, **more)


def test_nothing_is_judged_in_a_gap():
    # the wall stands where a straight line over the gap leads through it
    made = judged(without(whole(clock_s=1.7e9), 1.7e9 + 16.0, 1.7e9 + 22.0), obstacles=[WALL])
    first = next(v for v in made.flight.violations)
    assert first.time_s > 22.0  # on its way back
    made = judged(without(whole(clock_s=1.7e9), 1.7e9 + 16.0, 1.7e9 + 34.0), obstacles=[WALL])
    assert not made.flight.violations
    assert "nothing was logged for 18.0 s, 13.9 s after take-off" in said(made)
    missing = [north for north, _, _ in WAYPOINTS_M if north > (16.0 - 10.0) * 12.0 + 6.0]
    assert made.flight.covered[-1] == N - len(missing)
    (gap,) = made.flight.of_log.unknown
    assert (gap.from_s, gap.to_s) == pytest.approx((16.0, 34.0))
    known = made.flight.known[:, 0]
    assert not known[17:34].any()
    assert known[:17].all()
    assert known[34:].all()


def test_positions_that_jump_and_come_back_are_named_and_cost_nothing():
    times_s = times_of(10.0)
    flown_m = places_m(times_s, 2.0)
    wrong = (times_s > 17.0) & (times_s < 27.0)
    flown_m[wrong, 1] -= 150.0  # outside of the fence
    log = logged(times_s, flown_m, armed=(Span(0.0, FLIES_S + 2.0),))
    silent = judged(log)  # it jumps there and back
    assert not silent.flight.violations
    assert (
        "its position jumps by 150 m 15.0 s after take-off and comes back 24.9 s after take-off: "
        "taken for a GPS glitch" in said(silent)
    )
    made = silent
    assert (made.flight.mode[-1] == LANDED).all()
    assert [one.why for one in made.flight.of_log.unknown] == ["GPS glitch"]
    passed_s = np.array([one.time_s for one in made.flight.of_log.passes])
    assert not ((passed_s > 16.9) & (passed_s < 27.0)).any()
    assert np.abs(made.flight.x[:, 0, 1]).max() < 1.0


def test_a_glitch_that_the_autopilot_tells_is_named_and_no_contact_of_it_counts():
    log = whole(glitches=(Span(15.0, 35.0),))
    made = judged(log, obstacles=[WALL])  # it flies through it twice, by its own estimate
    assert not made.flight.violations
    assert made.flight.covered[-1] == N
    assert (
        "uas_1: position estimated by its autopilot, which says GPS glitch from 12.9 s after "
        "take-off until 32.9 s after take-off: contacts are not judged then" in said(made)
    )
    assert judged(whole(), obstacles=[WALL]).flight.violations


def test_positions_that_jump_for_good_are_judged_as_they_are_and_named():
    times_s = times_of(10.0)
    flown_m = places_m(times_s, 2.0)
    flown_m[times_s > 30.0, 1] -= 20.0
    made = judged(logged(times_s, flown_m, armed=(Span(0.0, FLIES_S + 2.0),)))
    assert "its position jumps by 20 m 28.0 s after take-off, for good" in said(made)
    assert made.flight.covered[-1] == N
    assert not made.flight.of_log.unknown


def test_single_wrong_positions_are_passed_over():
    times_s = times_of(10.0)
    flown_m = places_m(times_s, 2.0)
    flown_m[::50] += (5_000.0, 0.0, 0.0)
    flown_m[-1] += (0.0, 5_000.0, 0.0)
    made = judged(logged(times_s, flown_m, armed=(Span(0.0, FLIES_S + 2.0),)))
    assert not made.flight.violations
    assert made.flight.covered[-1] == N
    assert "taken for a GPS glitch" in said(made)


def test_a_log_that_breaks_off_ends_the_flight_of_its_uas_and_no_other():
    clock_s = 1_795_771_380.0
    logs = {}
    for name, east_m, ends_s in (("uas_1", 0.0, 22.0), ("uas_2", 40.0, LONG_S)):
        times_s = times_of(10.0, ends_s)
        open_ = ends_s < LONG_S
        span = Span(clock_s, clock_s + min(ends_s, 2.0 + FLIES_S), open_)
        flown_m = places_m(times_s, 2.0, east_m)
        current_A = np.full(len(times_s), 20.0)
        logs[name] = logged(
            clock_s + times_s, flown_m, name, armed=(span,), current_A=current_A,
            used_Ah=current_A * times_s / 3_600.0, voltage_V=np.full(len(times_s), 15.0),
        )  # fmt: skip
    made = judged(logs)
    flight = made.flight
    assert "uas_1: its log ends away from home, 19.9 s after take-off, 144 m" in said(made)
    assert "1795771" not in said(made)
    assert flight.last_sample.tolist() == [22, pytest.approx(2.0 + FLIES_S, abs=1)]
    assert not flight.violations
    assert (flight.mode[-1] == [LOST, LANDED]).all()
    assert energy_Wh(flight)[0] == pytest.approx(15.0 * 20.0 * 22.0 / 3_600.0)
    used = (1.0 - flight.soc[-1, 0]) * flight.scenario.vehicles[0].battery.capacity_Ah
    assert used == pytest.approx(20.0 * 22.0 / 3_600.0)


def test_a_log_that_breaks_off_alone_leaves_a_flight_that_can_be_resumed():
    times_s = times_of(10.0, 22.4)
    made = judged(logged(times_s, places_m(times_s, 2.0), armed=(Span(0.0, 22.4, True),)))
    assert made.flight.ended == "stopped"
    assert made.flight.steps == 22
    assert made.flight.mode[-1, 0] < LANDED


@pytest.mark.parametrize("offset_m", [-6.0, 9.0])
def test_an_offset_of_the_height_is_taken_off_and_said(offset_m):
    times_s = times_of(10.0)
    flown_m = places_m(times_s, 2.0)
    flown_m[:, 2] += offset_m
    made = judged(logged(times_s, flown_m, armed=(Span(0.0, FLIES_S + 2.0),)))
    assert made.flight.covered[-1] == N
    assert (made.flight.mode[-1] == LANDED).all()
    (height,) = [one for one in made.flight.of_log.estimates if one.what == "height"]
    assert ("high" if offset_m > 0 else "low") in height.how
    wanted = "8.0 m (too high)" if offset_m > 0 else "6.0 m (too low)"  # it stands on the ground
    assert f"uas_1: height estimated from take-off: an offset of {wanted}" in said(made)


def test_what_is_estimated_stands_in_the_summary_and_is_read_back(tmp_path):
    log = without(whole(), 16.0, 30.0)
    flight = judged({"uas_1": log, "uas_2": whole_of_second()}).flight
    flight.save(tmp_path / "flown")
    summary = json.loads((tmp_path / "flown" / "summary.json").read_text())
    assert [(one["uas"], one["what"]) for one in summary["estimated"]] == [
        (uas, what) for uas in ("uas_1", "uas_2") for what in ("charge", "current", "voltage")
    ]
    (gap,) = summary["not_known"]
    assert gap == {"uas": "uas_1", "from_s": 16.0, "to_s": 30.0, "why": "nothing was logged"}
    again = Flight.load(tmp_path / "flown")
    assert again == flight
    assert (covered_at(again) == covered_at(flight)).all()
    assert (tmp_path / "flown" / "passes.csv").read_text().startswith("t_s,uas,x_m,y_m,z_m,vx_mps")


def whole_of_second():
    times_s = times_of(10.0)
    return logged(times_s, places_m(times_s, 2.0, 40.0), "uas_2", armed=(Span(0.0, LONG_S),))


def test_a_measured_voltage_stays_what_was_measured():
    times_s = times_of(10.0)
    volts = 14.0 - 0.02 * times_s
    made = judged(logged(times_s, places_m(times_s, 2.0), armed=(Span(0.0, FLIES_S + 2.0),),
                         voltage_V=volts))  # fmt: skip
    flight = made.flight
    last = flight.last_sample[0]
    assert flight.voltage_V[: last + 1, 0] == pytest.approx(14.0 - 0.02 * np.arange(last + 1))
    assert {one.what for one in flight.of_log.estimates} == {"charge", "current"}


def test_a_current_and_a_counter_that_contradict_each_other_are_named():
    times_s = times_of(10.0)
    made = judged(logged(times_s, places_m(times_s, 2.0), armed=(Span(0.0, FLIES_S + 2.0),),
                         used_Ah=0.01 * times_s, current_A=np.full(len(times_s), 3.0)))  # fmt: skip
    assert "its current makes 0.05 A h, its counter says 0.6" in said(made)


def test_a_share_in_whole_percent_makes_no_current_in_jolts():
    times_s = times_of(10.0)
    soc = np.floor(100.0 - times_s) / 100.0
    flight = judged(logged(times_s, places_m(times_s, 2.0), armed=(Span(0.0, FLIES_S + 2.0),),
                           soc=soc)).flight  # fmt: skip
    drawn_A = flight.current_A[2:50, 0]
    assert drawn_A.max() < 1.1 * drawn_A.min()


def test_failsafes_are_told_with_their_time():
    made = judged(whole(said=(Said(12.5, "Battery Failsafe"), Said(900.0, "crash check"))))
    assert "its autopilot says 'Battery Failsafe' 10.4 s after take-off" in said(made)
    assert "crash" not in said(made)


def test_places_off_the_path_are_those_of_the_log():
    assert len(judged(whole()).off_path_m["uas_1"]) == pytest.approx(10 * FLIES_S, abs=12)
    assert judged(whole()).off_path_m["uas_1"].max() > FAR_M - 20.0  # the plan stays at home

"""What becomes of vehicles when a link, a companion, a pilot or a battery fails a stream."""

from importlib import import_module

import numpy as np
import pytest
from simulated_px4 import SimulatedPX4
from simulated_vehicle import (
    BRAKE,
    GUIDED,
    LAND,
    LOITER,
    RTL,
    SMART_RTL,
    SimulatedVehicle,
    mav,
)

pytest.importorskip("pyproj")

from stream_support import Loopback, apart_m, is_home, off_m, plan_of_two

from uas_coverage_env.operations.stream.surroundings import SwarmSurroundings


@pytest.fixture(scope="module")
def flight():
    return plan_of_two()


@pytest.mark.parametrize(
    ("reaction", "modes", "px4_mode"),
    [
        ("home", [SMART_RTL], (4, 5)),
        ("rtl", [RTL], (4, 5)),
        ("land", [LAND], (4, 6)),
        ("hold", [BRAKE, GUIDED], (4, 3)),
    ],
)
def test_a_stream_that_is_stopped_by_hand_leaves_all_vehicles_in_the_mode_asked(
    flight, reaction, modes, px4_mode
):
    kinds = (SimulatedVehicle, SimulatedPX4)
    loop = Loopback(flight, stop_s=24.0, reaction=reaction, kinds=kinds)
    ended, _ = loop.fly()
    assert ended.reason == "stopped by hand"
    main, sub = px4_mode
    copter, px4 = loop.vehicles
    assert copter.modes[2:] == modes
    assert px4.modes[-1] == main << 16 | sub << 24
    assert loop.ended_s < 300.0
    if reaction == "hold":
        assert ended.done == "uas_1, uas_2: told to hold"
    else:
        assert not copter.armed
        assert is_home(copter, 0) == (reaction != "land")


def test_a_vehicle_that_was_told_to_hold_flies_home_by_itself_where_no_pilot_takes_it(flight):
    loop = Loopback(flight, stop_s=24.0, reaction="hold")
    loop.fly(then_s=120.0)
    for u, vehicle in enumerate(loop.vehicles):
        assert vehicle.modes[2:] == [BRAKE, GUIDED, SMART_RTL]
        assert is_home(vehicle, u)


@pytest.mark.parametrize("new_names", [False, True])
def test_vehicles_whose_companion_is_killed_fly_home_the_way_they_came(flight, new_names):
    # to a vehicle it is the same as a link that is cut for good
    how = {"cut": (24.0, np.inf), "new_names": new_names}
    loop = Loopback(flight, vehicles=(how, how), patience_s=10.0)
    loop.fly(then_s=120.0)
    for u, vehicle in enumerate(loop.vehicles):
        assert vehicle.modes == [0, GUIDED, SMART_RTL]
        assert is_home(vehicle, u)
        assert off_m(vehicle, flight, u) < 7.0  # half a second blind, then 2.5 m/s²


def test_px4_without_a_companion_returns_as_it_was_set_to_before_it_armed(flight):
    how = {"cut": (24.0, np.inf)}
    loop = Loopback(
        flight, kinds=(SimulatedPX4, SimulatedPX4), vehicles=(how, how), patience_s=10.0
    )
    loop.fly(then_s=120.0)
    for u, vehicle in enumerate(loop.vehicles):
        assert vehicle.modes[-1] == vehicle.home
        assert is_home(vehicle, u)


def test_a_link_that_is_cut_for_a_while_lets_all_hold_and_then_go_on(flight):
    loop = Loopback(flight, vehicles=({}, {"cut": (24.0, 34.0)}))
    ended, _ = loop.fly()
    assert ended.reason == ""
    assert loop.says("uas_2 is not heard from: all slow down and hold") < 26.5
    assert [vehicle.modes for vehicle in loop.vehicles] == [[0, GUIDED, LAND]] * 2
    assert apart_m(loop) > 50.0


def test_one_that_is_not_heard_is_given_up_after_the_patience_and_both_come_home(flight):
    loop = Loopback(flight, vehicles=({}, {"cut": (24.0, np.inf)}), patience_s=20.0)
    ended, _ = loop.fly(then_s=60.0)
    assert ended.reason == "uas_2 is not heard from"
    assert ended.done == "uas_1, uas_2: told to fly home the way it came"
    assert loop.says("uas_2 does not answer")
    for u, vehicle in enumerate(loop.vehicles):
        assert vehicle.modes[-1] == SMART_RTL
        assert is_home(vehicle, u)


def test_px4_that_has_left_offboard_without_targets_stops_time_for_all(flight):
    kinds = (SimulatedPX4, SimulatedPX4)
    loop = Loopback(flight, kinds=kinds, vehicles=({"deaf": (24.0, 26.0)}, {}), patience_s=10.0)
    ended, _ = loop.fly()
    one, other = loop.vehicles
    assert ended.reason == "uas_1 does not take targets (RTL)"
    assert one.modes == [one.manual, one.guided, one.home]
    assert other.modes == [other.manual, other.guided, other.home]


def test_a_connection_that_breaks_in_flight_counts_as_not_heard(flight, monkeypatch):
    mavutil = import_module("pymavlink.mavutil")  # not before MAVLink 2 is chosen
    loop = Loopback(flight, patience_s=10.0)
    port, recv = loop.vehicles[1].port, mavutil.mavudp.recv

    def broken(link, n=None):
        if loop.clock.now_s() > 24.0 and link.destination_addr[1] == port:
            raise ConnectionResetError
        return recv(link, n)

    monkeypatch.setattr(mavutil.mavudp, "recv", broken)
    ended, _ = loop.fly()
    assert ended.reason == "uas_2 is not heard from"
    assert loop.vehicles[0].modes[-1] == SMART_RTL


def test_a_vehicle_that_a_pilot_gives_back_flies_to_its_place_and_all_go_on(flight):
    away = {"taken": (24.0, 39.0), "pilot_mps": (0.0, -2.0)}
    loop = Loopback(flight, vehicles=(away, {}))
    ended, _ = loop.fly()
    assert ended.reason == ""
    assert loop.says("uas_1 does not take targets (mode 5): all slow down and hold") < 26.0
    assert loop.says("from its place: all hold while it flies back") > 39.0
    vehicle = loop.vehicles[0]
    assert vehicle.modes == [0, LOITER, GUIDED, LAND] or vehicle.modes == [
        *(0, GUIDED, LOITER, GUIDED, LAND)
    ]
    told = np.array([(t, *place[:2]) for t, place, _ in vehicle.heard if t > 39.5])
    step_m = np.hypot(*np.diff(told[:, 1:], axis=0).T)
    assert step_m.max() < 2.0  # no jump
    assert step_m[told[1:, 0] < 48.0].max() < 0.1 * 4.0 + 0.05  # not in a hurry
    assert off_m(loop.vehicles[1], flight, 1) < 2.0


def test_a_vehicle_is_not_sent_back_through_a_wall(flight):
    # its pilot flies it 60 m to the east, beyond the wall
    away = {"taken": (24.0, 39.0), "pilot_mps": (0.0, 4.0)}
    loop = Loopback(flight, vehicles=({}, away), patience_s=35.0)
    ended, _ = loop.fly()
    assert "the way there is not clear: fly it nearer by hand" in ended.reason
    assert loop.says("fly it nearer by hand; all hold") > 39.0
    flown = np.array(loop.vehicles[1].path)
    waits = (flown[:, 0] > 42.0) & (flown[:, 0] < 55.0)
    assert (flown[waits, 2] > 165.0).all()


def test_a_way_back_is_clear_only_of_other_uas_too(flight):
    around = SwarmSurroundings(flight.scenario, ["uas_1", "uas_2"])
    here, there = np.array([100.0, 60.0, -20.0]), np.array([100.0, 100.0, -20.0])
    for between_m, is_clear in ((80.0, False), (110.0, True)):
        others_m = {"uas_2": np.array([100.0, between_m, -20.0])}
        assert around.is_clear("uas_1", here, there, others_m) == is_clear


def test_landing_and_flying_straight_home_are_told_only_where_the_way_is_clear(flight):
    around = SwarmSurroundings(flight.scenario, ["uas_1", "uas_2"])
    over, beyond = np.array([120.0, 152.0, -45.0]), np.array([120.0, 170.0, -20.0])
    home = np.array([60.0, 60.0, -3.0])
    assert not around.may_land("uas_1", over, {})
    assert around.may_land("uas_1", beyond, {})
    assert not around.goes_straight_home("uas_1", beyond, home, 15.0)
    assert around.goes_straight_home("uas_1", beyond, home, 45.0)


def test_a_pilot_who_keeps_a_vehicle_is_left_alone_and_the_other_comes_home(flight):
    loop = Loopback(flight, vehicles=({"taken": (24.0, np.inf)}, {}), patience_s=10.0)
    ended, _ = loop.fly()
    assert ended.reason == "uas_1 does not take targets (mode 5)"
    assert ended.done == "uas_2: told to fly home the way it came"
    assert [vehicle.modes[-1] for vehicle in loop.vehicles] == [LOITER, SMART_RTL]


def test_a_low_battery_takes_a_vehicle_home_and_the_other_is_given_up_after_it(flight):
    loop = Loopback(flight, vehicles=({"low_s": 24.0}, {}), patience_s=10.0)
    ended, _ = loop.fly()
    assert ended.reason == "uas_1 does not take targets (RTL)"
    assert loop.says("uas_1 says: Battery 1 is low") < 26.0
    assert loop.vehicles[0].modes == [0, GUIDED, RTL]
    assert loop.vehicles[1].modes == [0, GUIDED, SMART_RTL]


@pytest.mark.parametrize(("reaction", "mode"), [("home", SMART_RTL), ("rtl", RTL)])
def test_a_heartbeat_of_another_autopilot_in_flight_ends_as_asked_for_both(flight, reaction, mode):
    loop = Loopback(flight, patience_s=10.0, reaction=reaction)
    changing = loop.vehicles[0]
    step = changing.step

    def changed(dt_s):
        if changing.time_s > 24.0:
            changing.autopilot = mav.MAV_AUTOPILOT_INVALID
        step(dt_s)

    changing.step = changed
    ended, _ = loop.fly()
    assert ended.reason == "uas_1 does not take targets (mode None)"
    assert [vehicle.modes[-1] for vehicle in loop.vehicles] == [mode, mode]


@pytest.mark.parametrize("error", [BrokenPipeError, RuntimeError, SystemExit])
def test_before_any_error_ends_the_stream_all_get_the_mode_asked(flight, error):
    loop = Loopback(flight)
    clock, last_step = loop.clock, loop.vehicles[1].step

    def fails(dt_s):
        last_step(dt_s)
        if clock.now_s() > 24.0:  # from now on, each time
            raise error

    loop.vehicles[1].step = fails
    with pytest.raises(error):
        loop.fly()
    assert [vehicle.modes[-1] for vehicle in loop.vehicles] == [SMART_RTL, SMART_RTL]

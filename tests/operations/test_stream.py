"""A plan streamed to simulated autopilots over loopback, in time that they drive."""

import io
from importlib import import_module

import numpy as np
import pytest
from simulated_vehicle import LAND, DrivenClock, SimulatedPX4, SimulatedVehicle, mav
from small_worlds import meadow, waypoint

pytest.importorskip("pyproj")

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.cli import main
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations import LocalFrame, read_log
from uas_coverage_env.operations.stream import StreamOptions, stream_flight, timeline_of
from uas_coverage_env.scenario import Place

HERE = Place(latitude_deg=47.0, longitude_deg=8.0)
FRAME = LocalFrame(HERE)
STARTS_M = (60.0, 60.0, -1.0), (60.0, 120.0, -1.0)
BRAKE, RTL = 17, 6


@pytest.fixture(scope="module")
def flight():
    waypoints = [waypoint((140.0, east, -20.0)) for east in (60.0, 120.0)]
    scenario = meadow(STARTS_M, waypoints=waypoints).model_copy(update={"place": HERE})
    return rollout(scenario, load_planner("nearest-waypoint"))


class Loopback:
    def __init__(
        self,
        flight,
        *,
        stop_s=np.inf,
        kinds=(SimulatedVehicle, SimulatedVehicle),
        vehicles=({}, {}),
        **options,
    ):
        self.vehicles = [
            kind(FRAME, start_m, **how)
            for kind, start_m, how in zip(kinds, STARTS_M, vehicles, strict=True)
        ]
        self.flight, self.said = flight, []
        self.clock, self.options = DrivenClock(self.vehicles, stop_s), StreamOptions(**options)

    def fly(self):
        addresses = {f"uas_{n + 1}": one.address for n, one in enumerate(self.vehicles)}
        try:
            return stream_flight(
                self.flight, HERE, addresses, self.options, self.clock, self.said.append
            )
        finally:
            for vehicle in self.vehicles:
                vehicle.close()


def off_m(vehicle, flight, uas):
    """How far the vehicle was from its path above 4 m, at most."""
    plan = timeline_of(flight, uas)
    path = np.array([plan.place_m(t) for t in np.arange(plan.first_s, plan.last_s, 0.1)])
    flown = np.array(vehicle.path)[:, 1:]
    flown = flown[-flown[:, 2] > 4.0]
    return max(np.linalg.norm(path - place, axis=1).min() for place in flown)


@pytest.mark.parametrize(
    "kinds",
    [
        (SimulatedVehicle, SimulatedVehicle),
        (SimulatedPX4, SimulatedPX4),
        (SimulatedVehicle, SimulatedPX4),
    ],
)
def test_vehicles_take_off_follow_the_plan_in_time_and_land(flight, tmp_path, kinds):
    loop = Loopback(flight, kinds=kinds)
    ended, table = loop.fly()
    assert ended.reason == ""
    assert ended.late_s < 5.0
    for u, vehicle in enumerate(loop.vehicles):
        assert not vehicle.armed
        assert vehicle.modes == [vehicle.manual, vehicle.guided, vehicle.land]
        assert np.linalg.norm(vehicle.place_m - (*STARTS_M[u][:2], 0.0)) < 2.5
        assert off_m(vehicle, flight, u) < 1.0
        took_s = vehicle.path[-1][0]
        assert took_s < flight.last_sample[u] * flight.scenario.dt_s + 30.0
    (tmp_path / "flown.csv").write_text(table)
    logs = read_log(tmp_path / "flown.csv")
    assert sorted(log.uas for log in logs) == ["uas_1", "uas_2"]


def test_time_passes_more_slowly_for_all_while_one_lags_and_both_stay_on_their_paths(flight):
    loop = Loopback(flight, vehicles=({"slow": (10.0, 30.0)}, {}))
    ended, _ = loop.fly()
    assert ended.reason == ""
    assert ended.late_s > 5.0
    assert any("uas_1 is behind: time passes more slowly for all" in line for line in loop.said)
    assert max(off_m(vehicle, flight, u) for u, vehicle in enumerate(loop.vehicles)) < 1.5
    # side by side in the plan: by 5 m and what is flown in half a second they may come apart
    one, other = (np.array(vehicle.path)[:, 1] for vehicle in loop.vehicles)
    assert np.abs(one - other).max() < 12.0


@pytest.mark.parametrize(
    ("reaction", "mode", "px4_mode"),
    [("hold", BRAKE, (4, 3)), ("rtl", RTL, (4, 5)), ("land", LAND, (4, 6))],
)
def test_a_stream_that_is_stopped_by_hand_leaves_all_vehicles_in_the_mode_asked(
    flight, reaction, mode, px4_mode
):
    kinds = (SimulatedVehicle, SimulatedPX4)
    loop = Loopback(flight, stop_s=20.0, reaction=reaction, kinds=kinds)
    ended, _ = loop.fly()
    assert ended.reason == "stopped by hand"
    main, sub = px4_mode
    assert [vehicle.modes[-1] for vehicle in loop.vehicles] == [mode, main << 16 | sub << 24]


def test_px4_is_asked_for_offboard_only_once_it_has_heard_targets_for_long_enough(flight):
    loop = Loopback(flight, kinds=(SimulatedPX4, SimulatedPX4))
    loop.fly()
    assert [vehicle.denied for vehicle in loop.vehicles] == [0, 0]


def test_px4_that_has_left_offboard_without_targets_stops_time_for_all(flight):
    kinds = (SimulatedPX4, SimulatedPX4)
    loop = Loopback(flight, kinds=kinds, vehicles=({"deaf": (18.0, 20.0)}, {}), patience_s=10.0)
    ended, _ = loop.fly()
    one, other = loop.vehicles
    assert ended.reason == "uas_1 does not take targets (main mode 4, sub mode 3)"
    assert one.modes == [one.manual, one.guided, one.hold]
    assert other.modes == [other.manual, other.guided, other.hold]


def test_one_that_is_not_heard_stops_time_and_is_given_up_after_the_patience(flight):
    loop = Loopback(flight, vehicles=({}, {"silent_s": 18.0}), patience_s=10.0)
    ended, _ = loop.fly()
    assert ended.reason == "uas_2 is not heard from"
    assert any("all hold" in line for line in loop.said)
    assert ended.late_s > 9.0
    assert loop.vehicles[0].modes[-1] == BRAKE


def test_a_connection_that_breaks_in_flight_counts_as_not_heard(flight, monkeypatch):
    mavutil = import_module("pymavlink.mavutil")  # not before MAVLink 2 is chosen
    loop = Loopback(flight, patience_s=10.0)
    port, recv = loop.vehicles[1].port, mavutil.mavudp.recv

    def broken(link, n=None):
        if loop.clock.now_s() > 18.0 and link.destination_addr[1] == port:
            raise ConnectionResetError
        return recv(link, n)

    monkeypatch.setattr(mavutil.mavudp, "recv", broken)
    ended, _ = loop.fly()
    assert ended.reason == "uas_2 is not heard from"
    assert loop.vehicles[0].modes[-1] == BRAKE


def test_a_pilot_who_takes_over_gets_no_more_targets_and_the_other_holds(flight):
    loop = Loopback(flight, vehicles=({"taken_s": 18.0}, {}), patience_s=10.0)
    ended, _ = loop.fly()
    assert ended.reason == "uas_1 does not take targets (mode 0)"
    assert [vehicle.modes[-1] for vehicle in loop.vehicles] == [0, BRAKE]


def test_a_vehicle_that_is_elsewhere_is_not_armed(flight):
    loop = Loopback(flight)
    loop.vehicles[1].place_m = np.array([150.0, 150.0, 0.0])
    ended, _ = loop.fly()
    assert ended.reason == "uas_2 is 95 m from its start; put it there"
    assert not any(vehicle.armed for vehicle in loop.vehicles)


def test_an_autopilot_with_other_modes_is_refused(flight):
    loop = Loopback(flight)
    loop.vehicles[0].autopilot = 13
    with pytest.raises(InputError, match=r"uas_1.*autopilot 13.*only.*ArduPilot and PX4"):
        loop.fly()


def test_another_system_on_the_same_connection_is_not_heard(flight):
    loop = Loopback(flight)
    vehicle = loop.vehicles[0]
    report = vehicle._report

    def with_stranger():
        report()
        if vehicle.time_s > 1.0:  # elsewhere, on the ground, and of an unknown autopilot
            stranger = mav.MAVLink(None, srcSystem=7, srcComponent=1)
            for message in (
                stranger.heartbeat_encode(2, mav.MAV_AUTOPILOT_INVALID, 0, 0, 4),
                stranger.global_position_int_encode(0, *(10**8, 10**8), *(0,) * 6),
            ):
                vehicle._socket.sendto(message.pack(stranger), vehicle._peer)

    vehicle._report = with_stranger
    ended, _ = loop.fly()
    assert ended.reason == ""
    assert ended.late_s < 5.0


@pytest.mark.parametrize("reaction", ["hold", "rtl"])
def test_a_heartbeat_of_another_autopilot_in_flight_ends_as_asked_for_both(flight, reaction):
    loop = Loopback(flight, patience_s=10.0, reaction=reaction)
    changing = loop.vehicles[0]
    step = changing.step

    def changed(dt_s):
        if changing.time_s > 18.0:
            changing.autopilot = mav.MAV_AUTOPILOT_INVALID
        step(dt_s)

    changing.step = changed
    ended, _ = loop.fly()
    assert ended.reason == "uas_1 does not take targets (mode None)"
    mode = {"hold": BRAKE, "rtl": RTL}[reaction]
    assert [vehicle.modes[-1] for vehicle in loop.vehicles] == [mode, mode]


@pytest.mark.parametrize("error", [BrokenPipeError, RuntimeError, SystemExit])
def test_before_any_error_ends_the_stream_all_get_the_mode_asked(flight, error):
    loop = Loopback(flight)
    clock, last_step = loop.clock, loop.vehicles[1].step

    def fails(dt_s):
        last_step(dt_s)
        if clock.now_s() > 18.0:  # from now on, each time
            raise error

    loop.vehicles[1].step = fails
    with pytest.raises(error):
        loop.fly()
    assert [vehicle.modes[-1] for vehicle in loop.vehicles] == [BRAKE, BRAKE]


PORT = "udpout:127.0.0.1:9"


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--connect", "uas_1"], "should be UAS=ADDRESS"),
        (["--connect", "uas_1=udp:host"], "should be like udp:127.0.0.1:14550"),
        (["--connect", "uas_1=udpout:127.0.0.1:99999"], "should be like udp:127.0.0.1:14550"),
        (["--connect", "uas_1=/dev/null:1"], "should be like udp:127.0.0.1:14550"),
        (["--connect", f"uas_1={PORT}"], "uas_2 has no vehicle"),
        (["--connect", f"uas_9={PORT}"], "does not fly in this flight"),
        (["--connect", f"uas_1={PORT}", "--connect", f"uas_2={PORT}"], "is connected already"),
        (["--connect", f"uas_1={PORT}", "--on-abort", "dive"], "take hold, rtl, land"),
        (["--connect", f"uas_1={PORT}", "--lag", "nan"], "--lag nan: should be between"),
        (["--connect", f"uas_1={PORT}", "--place", "1,2"], "has a [place] already"),
        (["--connect", f"uas_1={PORT}", "--track", "nowhere/flown.csv"], "nowhere: is no folder"),
    ],
)
def test_what_cannot_be_streamed_is_refused_in_one_line(flight, tmp_path, capsys, arguments, line):
    flight.save(tmp_path / "flight")
    assert main(["stream", str(tmp_path / "flight"), "--yes", *arguments]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert line in err


def test_nothing_arms_unless_somebody_agrees(flight, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    flight.save(tmp_path / "flight")
    both = [f"uas_{n}=udpout:127.0.0.1:{n}" for n in (1, 2)]
    asked = ["stream", str(tmp_path / "flight"), "--connect", both[0], "--connect", both[1]]
    assert main(asked) == 2
    assert "say yes, or add --yes" in capsys.readouterr().err

"""A plan streamed to simulated autopilots over loopback, in time that they drive."""

import io
from importlib import import_module

import numpy as np
import pytest
from simulated_vehicle import (
    BRAKE,
    GUIDED,
    LAND,
    LOITER,
    PARAMETERS,
    RTL,
    SMART_RTL,
    DrivenClock,
    SimulatedPX4,
    SimulatedVehicle,
    mav,
)
from small_worlds import box, meadow, waypoint

pytest.importorskip("pyproj")

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.cli import main
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations import LocalFrame, read_log
from uas_coverage_env.operations.stream import StreamOptions, stream_flight, timeline_of
from uas_coverage_env.operations.stream.around import Around
from uas_coverage_env.scenario import Execution, Place

HERE = Place(latitude_deg=47.0, longitude_deg=8.0)
FRAME = LocalFrame(HERE)
STARTS_M = (60.0, 60.0, -1.0), (60.0, 120.0, -1.0)


@pytest.fixture(scope="module")
def flight():
    waypoints = [waypoint((160.0, east, -20.0)) for east in (60.0, 120.0)]
    by = Execution(flown_by="autopilot", speed_mps=9.0)
    wall = box("wall", (80.0, 150.0, -40.0), (199.0, 154.0, 0.0))
    scenario = meadow(STARTS_M, waypoints=waypoints, obstacles=[wall]).model_copy(
        update={"place": HERE, "execution": by}
    )
    return rollout(scenario, load_planner("lawnmower"))


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

    def fly(self, then_s=0.0):
        """Fly, and let vehicles fly on alone for a while after the stream has ended."""
        addresses = {f"uas_{n + 1}": one.address for n, one in enumerate(self.vehicles)}
        try:
            return stream_flight(self.flight, HERE, addresses, self.options, self.clock, self.tell)
        finally:
            self.ended_s = self.clock.now_s()
            for _ in range(round(10.0 * then_s)):
                self.clock.wait(0.1)
            for vehicle in self.vehicles:
                vehicle.close()

    def tell(self, line):
        self.said.append((self.clock.now_s(), line))

    def says(self, text):
        """When a line with a text was said first."""
        return next((time_s for time_s, line in self.said if text in line), None)


def off_m(vehicle, flight, uas, before_s=np.inf):
    """How far the vehicle was from its path above 4 m, at most."""
    plan = timeline_of(flight, uas)
    path = np.array([plan.place_m(t) for t in np.arange(plan.first_s, plan.last_s, 0.05)])
    flown = np.array(vehicle.path)
    flown = flown[(flown[:, 3] < -4.0) & (flown[:, 0] < before_s), 1:]
    return max(np.linalg.norm(path - place, axis=1).min() for place in flown)


def apart_m(loop):
    """Least distance of the two in the air."""
    one, other = (np.array(vehicle.path)[:, 1:] for vehicle in loop.vehicles)
    up = (one[:, 2] < -2.0) & (other[:, 2] < -2.0)
    return np.linalg.norm(one[up] - other[up], axis=1).min()


def is_home(vehicle, uas):
    away_m = np.linalg.norm(vehicle.place_m - (*STARTS_M[uas][:2], 0.0))
    return not vehicle.armed and away_m < 3.0


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
    assert (ended.reason, ended.done) == ("", "")
    assert ended.late_s < 5.0
    for u, vehicle in enumerate(loop.vehicles):
        assert vehicle.modes == [vehicle.manual, vehicle.guided, vehicle.land]
        assert vehicle.armings == 1
        assert is_home(vehicle, u)
        # no PX4 was watched, as ArduPilot was
        assert off_m(vehicle, flight, u) < (5.0 if kinds[u] is SimulatedPX4 else 2.0)
        took_s = vehicle.path[-1][0]
        assert took_s < flight.last_sample[u] * flight.scenario.dt_s + 40.0
    (tmp_path / "flown.csv").write_text(table)
    logs = read_log(tmp_path / "flown.csv")
    assert sorted(log.uas for log in logs) == ["uas_1", "uas_2"]


def test_time_passes_more_slowly_for_all_while_one_lags_and_both_stay_on_their_paths(flight):
    loop = Loopback(flight, vehicles=({"slow": (18.0, 34.0)}, {}))
    ended, _ = loop.fly()
    assert ended.reason == ""
    assert ended.late_s > 5.0
    assert loop.says("uas_1 is behind: time passes more slowly for all")
    assert max(off_m(vehicle, flight, u) for u, vehicle in enumerate(loop.vehicles)) < 3.0
    # side by side in the plan: one falls behind before the other has slowed down
    one, other = (np.array(vehicle.path)[:, 1] for vehicle in loop.vehicles)
    assert np.abs(one - other).max() < 30.0


def test_a_vehicle_is_never_told_to_stop_at_once_where_another_is_lost(flight):
    loop = Loopback(flight, vehicles=({}, {"cut": (24.0, 34.0)}))
    loop.fly()
    times_s, _, velocities = zip(*loop.vehicles[0].heard, strict=True)
    change = np.abs(np.diff(np.hypot(*np.array(velocities).T)))
    assert change.max() < 1.5  # at 10 m/s, in a tick
    assert off_m(loop.vehicles[0], flight, 0) < 2.0
    assert np.diff(times_s).max() < 0.15


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


def test_failsafes_are_set_before_a_vehicle_arms_and_put_back_once_it_has_landed(flight):
    loop = Loopback(flight)
    loop.fly(then_s=1.0)
    for vehicle in loop.vehicles:
        before = dict(vehicle.set_to[:4])
        assert before["FS_GCS_ENABLE"] == 3  # straight home is clear, too
        assert (before["FS_GCS_TIMEOUT"], before["SYSID_MYGCS"]) == (15, 250)
        assert vehicle.parameters == PARAMETERS
    assert loop.says("uas_1: GUID_TIMEOUT 3 -> 0.5, FS_GCS_ENABLE 0 -> 3") < 8.0


@pytest.mark.parametrize(
    ("how", "reason"),
    [
        ({"parameters": {"FS_GCS_ENABLE": None}}, "does not say what its FS_GCS_ENABLE is"),
        ({"forgets": ("FS_GCS_TIMEOUT",)}, "does not take FS_GCS_TIMEOUT = 15"),
    ],
)
def test_a_vehicle_whose_failsafes_cannot_be_set_is_not_armed(flight, how, reason):
    kept = {name: value for name, value in how.items() if name != "forgets"}
    loop = Loopback(flight, vehicles=({}, kept), patience_s=10.0)
    loop.vehicles[1].forgets = how.get("forgets", ())
    ended, _ = loop.fly()
    assert ended.reason.startswith(f"uas_2 {reason}")
    assert ended.done == "no vehicle was told anything"
    assert [vehicle.armings for vehicle in loop.vehicles] == [0, 0]


def test_px4_is_asked_for_offboard_only_once_it_has_heard_targets_for_long_enough(flight):
    loop = Loopback(flight, kinds=(SimulatedPX4, SimulatedPX4))
    loop.fly()
    assert [vehicle.denied for vehicle in loop.vehicles] == [0, 0]


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
    around = Around(flight.scenario, ["uas_1", "uas_2"])
    here, there = np.array([100.0, 60.0, -20.0]), np.array([100.0, 100.0, -20.0])
    for between_m, is_clear in ((80.0, False), (110.0, True)):
        others_m = {"uas_2": np.array([100.0, between_m, -20.0])}
        assert around.is_clear("uas_1", here, there, others_m) == is_clear


def test_landing_and_flying_straight_home_are_told_only_where_the_way_is_clear(flight):
    around = Around(flight.scenario, ["uas_1", "uas_2"])
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


def test_a_vehicle_whose_checks_fail_is_named_at_once_and_none_is_armed(flight):
    loop = Loopback(flight, vehicles=({}, {"refuses": "Battery 1 below minimum arming voltage"}))
    ended, _ = loop.fly()
    assert loop.says("uas_2 says: PreArm: Battery 1 below minimum arming voltage") < 10.0
    assert ended.reason.startswith("uas_2 does not pass its checks before arming")
    assert ended.reason.endswith("PreArm: Battery 1 below minimum arming voltage")
    assert ended.done == "no vehicle was told anything"
    assert [vehicle.armings for vehicle in loop.vehicles] == [0, 0]


def test_where_one_does_not_arm_the_others_are_armed_once_at_most_and_disarmed(flight):
    loop = Loopback(flight, vehicles=({}, {"balks": "Throttle too high"}))
    ended, _ = loop.fly()
    assert loop.says("uas_2 says: Arm: Throttle too high") < 10.0
    assert ended.reason.startswith("uas_2 does not arm")
    assert ended.reason.endswith(": Arm: Throttle too high")
    assert ended.done == "uas_1: told to disarm"
    assert [vehicle.armings for vehicle in loop.vehicles] == [1, 0]
    assert not loop.vehicles[0].armed
    assert loop.ended_s < 20.0


def test_a_vehicle_that_is_elsewhere_is_not_armed(flight):
    loop = Loopback(flight)
    loop.vehicles[1].place_m = np.array([150.0, 150.0, 0.0])
    ended, _ = loop.fly()
    assert ended.reason == "uas_2 is 95 m from its start; put it there"
    assert ended.done == "no vehicle was told anything"
    assert not any(vehicle.armings for vehicle in loop.vehicles)


def test_a_vehicle_that_flies_already_is_left_alone_and_no_other_is_armed(flight):
    loop = Loopback(flight)
    other = loop.vehicles[1]
    other.armed, other.mode, other.place_m = True, GUIDED, np.array([*STARTS_M[1][:2], -20.0])
    ended, _ = loop.fly()
    assert ended.reason == "uas_2 is flying or armed; stream begins on the ground"
    assert ended.done == "no vehicle was told anything"
    assert other.mode == GUIDED
    assert other.set_to == []
    assert loop.vehicles[0].armings == 0


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


def test_a_plan_that_vehicles_cannot_follow_is_refused_with_the_command_that_plans_it_again(flight):
    waypoints = [waypoint((160.0, east, -20.0)) for east in (60.0, 120.0)]
    scenario = meadow(STARTS_M, waypoints=waypoints).model_copy(update={"place": HERE})
    fast = rollout(scenario, load_planner("nearest-waypoint"))
    loop = Loopback(fast)
    with pytest.raises(InputError) as refused:
        loop.fly()
    line = str(refused.value)
    assert "more than the vehicles are set to (2.5 m/s² and 10 m/s)" in line
    assert "uas-coverage import ... --flown-by autopilot --speed 9, or load the .param" in line
    assert not any(vehicle.armings for vehicle in loop.vehicles)
    asked = float(line.rsplit("--late ", 1)[1])
    allowed = Loopback(fast, late=0.01 * asked)
    ended, _ = allowed.fly()
    assert ended.reason == ""
    assert max(off_m(vehicle, fast, u) for u, vehicle in enumerate(allowed.vehicles)) < 3.0


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
        (["--connect", f"uas_1={PORT}", "--on-abort", "dive"], "take home, rtl, land, hold"),
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

"""A plan streamed to simulated autopilots over loopback, in time that they drive."""

import io

import numpy as np
import pytest
from simulated_px4 import SimulatedPX4
from simulated_vehicle import (
    GUIDED,
    PARAMETERS,
    SimulatedVehicle,
    mav,
)
from small_worlds import meadow, waypoint

pytest.importorskip("pyproj")

from stream_support import HERE, STARTS_M, Loopback, is_home, off_m, plan_of_two

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.cli import main
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations import read_log


@pytest.fixture(scope="module")
def flight():
    return plan_of_two()


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

"""Files of logs as autopilots and ground stations write them, whole and damaged."""

import json
import struct

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

pytest.importorskip("pyproj")
pytest.importorskip("pymavlink")
pytest.importorskip("pyulog")

from autopilot_logs import BAT2_3_6, INSTANCE_4_0, OLD_CURR, bin_log, tlog, ulog
from flown_flights import FLIES_S, FRAME, WAYPOINTS_M, geodetic, judged, places_m, plan

from uas_coverage_env import Flight
from uas_coverage_env.cli import main
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight.metrics import energy_Wh
from uas_coverage_env.flight.record import LANDED
from uas_coverage_env.operations import flown_flight, read_log

N = len(WAYPOINTS_M)
ARMED = (20.0, 22.0 + FLIES_S)
TIMES_S = np.arange(0.0, 84.0, 0.2)
PLACES = geodetic(places_m(TIMES_S, 21.0))


def one(path):
    (log,) = read_log(path)
    return log


@pytest.fixture(scope="module")
def plan_at(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flights") / "plan"
    plan(uas=2).save(folder)
    return str(folder)


WRITERS = {
    ".bin": lambda path: bin_log(path, TIMES_S, PLACES, armed=ARMED),
    ".tlog": lambda path: tlog(path, TIMES_S, PLACES, armed=ARMED),
    ".ulg": lambda path: ulog(path, TIMES_S, PLACES, armed=ARMED),
}


@pytest.mark.parametrize("ending", WRITERS)
def test_a_log_of_each_kind_comes_back_as_the_flight_that_it_was(ending, tmp_path):
    path = tmp_path / f"uas_1{ending}"
    WRITERS[ending](path)
    log = one(path)
    assert log.time_s[0] > 1e9  # a clock that vehicles share
    made = judged(log)
    flight = made.flight
    assert flight.covered[-1] == N
    assert flight.steps == pytest.approx(FLIES_S + 2.0, abs=1.0)
    assert flight.mode[-1, 0] == LANDED
    assert not flight.violations
    # 36 A at 15 V and 0.01 A h a second, also on the ground before
    assert energy_Wh(flight)[0] == pytest.approx(15.0 * 36.0 * flight.steps / 3_600.0, rel=1e-3)
    used_Ah = (1.0 - flight.soc[-1, 0]) * flight.scenario.vehicles[0].battery.capacity_Ah
    assert used_Ah == pytest.approx(0.01 * ARMED[1], abs=0.02)
    assert "estimated" not in "".join(made.notes)
    assert np.degrees(flight.x[40, 0, 6]) == pytest.approx(0.0 if ending == ".ulg" else 10.0)


def test_the_logs_of_px4_hold_places_attitude_and_the_first_battery(tmp_path):
    ulog(tmp_path / "a.ulg", TIMES_S, PLACES, armed=ARMED)
    log = one(tmp_path / "a.ulg")
    places = np.column_stack([log.latitude_deg, log.longitude_deg, log.height_m])
    assert np.abs(places - PLACES).max() < 1e-4
    assert log.time_s == pytest.approx(1.7e9 + TIMES_S, abs=1e-3)
    assert np.degrees(log.attitude_rad[7]) == pytest.approx([0.0, 0.0, 40.0], abs=1e-4)
    assert (log.voltage_V[7], log.current_A[7]) == pytest.approx((15.0, 36.0))
    assert log.used_Ah[-1] == pytest.approx(0.01 * TIMES_S[-1])
    assert any("battery monitors 1, 2; 1 is used" in note for note in log.notes)


@pytest.mark.parametrize("without", ["home_position", "vehicle_global_position"])
def test_a_log_of_px4_without_its_home_or_its_global_position_is_read(without, tmp_path):
    missing = ("home_position", without)
    flown_m = places_m(TIMES_S, 21.0)
    ulog(tmp_path / "a.ulg", TIMES_S, PLACES, armed=ARMED, without=missing, local_m=flown_m)
    log = one(tmp_path / "a.ulg")
    places = np.column_stack([log.latitude_deg, log.longitude_deg, log.height_m])
    off_m = FRAME.to_ned(*places.T) - FRAME.to_ned(*PLACES.T)
    assert np.abs(off_m).max() < 0.6  # its map is that of a sphere: 0.3 % on a way north
    assert any("heights are above the origin of its own map" in note for note in log.notes)
    assert judged(log).flight.covered[-1] == N


GENERATIONS = {
    "Inst, since 4.1": None,
    "Instance, of 4.0": INSTANCE_4_0,
    "BAT2, of 3.6": BAT2_3_6,
    "CURR in hundredths, of 3.3": OLD_CURR,
}


@pytest.mark.parametrize("generation", GENERATIONS)
def test_the_first_battery_is_read_whatever_the_generation_of_the_log(generation, tmp_path):
    bin_log(tmp_path / "a.bin", TIMES_S, PLACES, formats=GENERATIONS[generation])
    log = one(tmp_path / "a.bin")
    assert log.voltage_V == pytest.approx(np.full(len(TIMES_S), 15.0))
    assert log.current_A == pytest.approx(np.full(len(TIMES_S), 36.0))
    assert log.used_Ah == pytest.approx(0.01 * TIMES_S, abs=1e-6)


def test_of_two_batteries_the_flight_has_the_energy_and_the_charge_of_the_first(tmp_path):
    bin_log(tmp_path / "a.bin", TIMES_S, PLACES, formats=INSTANCE_4_0, armed=ARMED)
    flight = judged(one(tmp_path / "a.bin")).flight
    assert energy_Wh(flight)[0] == pytest.approx(15.0 * 36.0 * flight.steps / 3_600.0, rel=1e-6)
    used_Ah = (1.0 - flight.soc[-1, 0]) * flight.scenario.vehicles[0].battery.capacity_Ah
    assert used_Ah == pytest.approx(0.01 * ARMED[1], abs=0.011)


def test_telemetry_from_before_take_off_is_no_flown_time(tmp_path):
    """A receiver that is off by 6 m and a barometer by 1.8 m, until it is armed."""
    flown_m = places_m(TIMES_S, 21.0)
    ground = ARMED[0] > TIMES_S
    flown_m[ground, 1] -= np.linspace(6.0, 0.0, ground.sum())
    flown_m[ground, 2] += np.linspace(1.2, 1.8, ground.sum())
    tlog(tmp_path / "a.tlog", TIMES_S, geodetic(flown_m), armed=ARMED)
    flight = judged(one(tmp_path / "a.tlog")).flight
    assert flight.steps == pytest.approx(FLIES_S + 2.0, abs=1.0)
    assert flight.covered[-1] == N
    assert flight.mode[-1, 0] == LANDED
    assert energy_Wh(flight)[0] == pytest.approx(15.0 * 36.0 * flight.steps / 3_600.0, rel=1e-6)


@pytest.mark.parametrize("generation", [name for name in GENERATIONS if "CURR" not in name])
def test_the_second_battery_is_read_where_it_is_asked_for(generation, tmp_path):
    bin_log(tmp_path / "a.bin", TIMES_S, PLACES, formats=GENERATIONS[generation])
    (log,) = read_log(tmp_path / "a.bin", battery=2)
    assert log.voltage_V == pytest.approx(np.full(len(TIMES_S), 1.0))
    with pytest.raises(InputError, match="has no battery monitor 3; it has 1, 2"):
        read_log(tmp_path / "a.bin", battery=3)


def test_a_vehicle_with_only_a_second_battery_is_read_by_that(tmp_path):
    second = lambda t, _: [("BAT", 1, 14.0, 20.0, 5.0 * t)]  # noqa: E731
    bin_log(tmp_path / "a.bin", TIMES_S, PLACES, batteries=second)
    assert one(tmp_path / "a.bin").voltage_V == pytest.approx(np.full(len(TIMES_S), 14.0))


def test_charge_comes_from_the_current_of_sys_status_where_that_is_all_there_is(tmp_path):
    tlog(tmp_path / "a.tlog", TIMES_S, PLACES, armed=ARMED, battery_status=False,
         sys_status=lambda t: (15_000, 3_600, max(0, int(90 - 0.2 * t))))  # fmt: skip
    made = judged(one(tmp_path / "a.tlog"))
    flight = made.flight
    capacity_Ah = flight.scenario.vehicles[0].battery.capacity_Ah
    # it begins with what the autopilot takes to be left when it is armed
    assert flight.soc[0, 0] == pytest.approx(0.86, abs=0.011)
    used_Ah = (flight.soc[0, 0] - flight.soc[-1, 0]) * capacity_Ah
    assert used_Ah == pytest.approx(36.0 * flight.steps / 3_600.0, rel=0.02)
    assert energy_Wh(flight)[0] == pytest.approx(15.0 * used_Ah, rel=0.02)
    assert "estimated" not in "".join(made.notes)


def test_charge_comes_from_the_share_left_where_no_current_is_measured(tmp_path):
    tlog(tmp_path / "a.tlog", TIMES_S, PLACES, armed=ARMED, battery_status=False,
         sys_status=lambda t: (14_800, -1, max(0, int(100 - 0.5 * t))))  # fmt: skip
    flight = judged(one(tmp_path / "a.tlog")).flight
    assert flight.soc[0, 0] == pytest.approx(0.9, abs=0.011)
    assert flight.soc[-1, 0] == pytest.approx(1.0 - 0.005 * ARMED[1], abs=0.02)
    # the voltage was measured, and stays
    assert flight.voltage_V[:, 0] == pytest.approx(np.full(len(flight.x), 14.8))
    assert [one.what for one in flight.of_log.estimates] == ["current"]


def test_what_telemetry_does_not_know_is_no_number(tmp_path):
    tlog(tmp_path / "a.tlog", TIMES_S, PLACES, armed=ARMED, battery_status=False,
         sys_status=lambda t: (65_535, -1, -1))  # fmt: skip
    log = one(tmp_path / "a.tlog")
    assert (log.voltage_V, log.current_A, log.soc, log.used_Ah) == (None, None, None, None)


def test_the_cells_of_a_battery_are_added_up(tmp_path):
    def cells(vehicle, t):
        return vehicle.battery_status_encode(0, 0, 0, 0, [3_700] * 4 + [65_535] * 6, -1, -1, 0, -1)

    from autopilot_logs import _stamped, ardupilotmega

    tlog(tmp_path / "a.tlog", TIMES_S, PLACES, battery_status=False,
         sys_status=lambda t: (65_535, -1, -1))  # fmt: skip
    vehicle = ardupilotmega.MAVLink(None, srcSystem=1, srcComponent=1)
    more = [_stamped(t, cells(vehicle, t).pack(vehicle)) for t in TIMES_S]
    (tmp_path / "a.tlog").write_bytes((tmp_path / "a.tlog").read_bytes() + b"".join(more))
    assert one(tmp_path / "a.tlog").voltage_V == pytest.approx(np.full(len(TIMES_S), 14.8))


def test_vehicles_of_one_link_are_chosen_by_their_systems(tmp_path, plan_at, capsys):
    both = {1: PLACES, 7: geodetic(places_m(TIMES_S, 21.0, 40.0))}
    path = tmp_path / "link.tlog"
    tlog(path, TIMES_S, both, systems=(1, 7), armed=ARMED)
    rest = ("--plan", plan_at, "--out", str(tmp_path / "out"))
    assert main(["log", f"uas_1={path}", *rest]) == 2
    err = capsys.readouterr().err
    assert "holds several vehicles (systems 1, 7); choose one for each UAS" in err
    assert err.count("\n") == 1
    assert main(["log", f"uas_1={path}:3", *rest]) == 2
    assert "has no vehicle of system 3; it has 1, 7" in capsys.readouterr().err
    assert main(["log", f"uas_1={path}:1", f"uas_2={path}:7", *rest]) == 0
    flight = Flight.load(tmp_path / "out")
    assert (flight.mode[-1] == LANDED).all()
    assert flight.x[30, :, 1] == pytest.approx([0.0, 40.0], abs=0.1)


def test_the_flight_of_each_log_is_chosen_by_its_number(tmp_path, plan_at, capsys):
    twice = np.vstack([PLACES, PLACES])
    times_s = np.append(TIMES_S, TIMES_S + 100.0)
    said = [(100.0 + t, "EV", n) for t, n in zip(ARMED, (10, 11), strict=True)]
    bin_log(tmp_path / "uas_1.bin", times_s, twice, armed=ARMED, said=said)
    arguments = ["log", str(tmp_path / "uas_1.bin"), "--plan", plan_at]
    assert main([*arguments, "--out", str(tmp_path / "none")]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "uas_1.bin: holds 2 flights: 1 (13:53:22 UTC, 60 s, up to 20 m), 2 (13:55:02" in err
    for number, used_Ah in (("1", 0.01 * ARMED[1]), ("uas_1=2", 0.01 * (100.0 + ARMED[1]))):
        out = tmp_path / f"out {number}"
        assert main([*arguments, "--out", str(out), "--flight", number]) == 0
        flight = Flight.load(out)
        assert flight.covered[-1] == N
        # of one pack, which no one changed between the flights
        dod = used_Ah / flight.scenario.vehicles[0].battery.capacity_Ah
        assert 1.0 - flight.soc[-1, 0] == pytest.approx(dod, abs=0.01)
    capsys.readouterr()
    for wrong, why in (
        ("0", "give a number from 1 on"),
        ("x", "give a number from 1 on"),
        ("uas_9=1", "there is no UAS 'uas_9'; the plan has uas_1, uas_2"),
    ):
        assert main([*arguments, "--out", str(tmp_path / "none"), "--flight", wrong]) == 2
        assert why in capsys.readouterr().err


def test_the_arm_message_and_the_land_detector_of_a_data_flash_log_are_heeded(tmp_path):
    said = [(20.0, "ARM", 1, 0), (21.2, "EV", 28), (21.0 + FLIES_S, "EV", 18), (83.0, "ARM", 0, 0)]
    bin_log(tmp_path / "a.bin", TIMES_S, PLACES, said=said)
    flight = judged(one(tmp_path / "a.bin")).flight
    assert flight.steps == pytest.approx(1.0 + FLIES_S, abs=1.0)
    assert flight.mode[-1, 0] == LANDED


def test_auto_armed_after_disarming_is_no_second_flight(tmp_path):
    """As Copter 4.7 logs it, again and again, where `AUTO_OPTIONS` lets it take off in AUTO."""
    said = [(t, "EV", 15) for t in np.arange(ARMED[1] + 0.01, TIMES_S[-1], 0.02)]
    bin_log(tmp_path / "a.bin", TIMES_S, PLACES, armed=ARMED, said=said)
    assert len(one(tmp_path / "a.bin").armed) == 1
    assert judged(one(tmp_path / "a.bin")).flight.mode[-1, 0] == LANDED


def test_a_log_that_begins_when_it_is_armed_may_say_only_when_it_is_disarmed(tmp_path):
    later = TIMES_S >= 20.0
    bin_log(tmp_path / "a.bin", TIMES_S[later], PLACES[later], said=[(ARMED[1], "EV", 11)])
    flight = judged(one(tmp_path / "a.bin")).flight
    assert flight.steps == pytest.approx(ARMED[1] - 20.0, abs=1.0)


GLITCHES = {
    "bin, ERR": lambda p: bin_log(
        p, TIMES_S, PLACES, armed=ARMED, said=[(40.0, "ERR", 11, 2), (50.0, "ERR", 11, 0)]
    ),
    "bin, MSG": lambda p: bin_log(
        p, TIMES_S, PLACES, armed=ARMED,
        said=[(40.0, "MSG", "GPS Glitch or Compass error"), (50.0, "MSG", "Glitch cleared")],
    ),
    "tlog": lambda p: tlog(
        p, TIMES_S, PLACES, armed=ARMED,
        said=[(40.0, "GPS Glitch or Compass error"), (50.0, "Glitch cleared")],
    ),
    "ulg": lambda p: ulog(
        p, TIMES_S, PLACES, armed=ARMED, said=[(40.0, "GPS glitch"), (50.0, "GPS glitch cleared")],
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", GLITCHES)
def test_a_glitch_that_an_autopilot_tells_is_named_with_its_time(case, tmp_path):
    path = tmp_path / f"a.{case.partition(',')[0]}"
    GLITCHES[case](path)
    made = judged(one(path))
    (note,) = [note for note in made.notes if "its autopilot, which says GPS glitch" in note]
    after_s = [float(word) for word in note.split() if word[0].isdigit()]
    assert after_s == pytest.approx([19.0, 29.0], abs=0.5)
    assert made.flight.covered[-1] == N


@pytest.mark.parametrize("size", [1_000, 200_000])
def test_what_follows_noise_in_a_data_flash_log_is_read(size, tmp_path):
    bin_log(tmp_path / "a.bin", TIMES_S, PLACES, armed=ARMED)
    whole = (tmp_path / "a.bin").read_bytes()
    noise = np.random.default_rng(5).bytes(size)
    half = len(whole) // 2
    (tmp_path / "a.bin").write_bytes(whole[:half] + noise + whole[half:])
    log = one(tmp_path / "a.bin")
    assert any("bytes of its log are damaged" in note for note in log.notes)
    made = judged(log)
    assert made.flight.covered[-1] == N
    assert made.flight.mode[-1, 0] == LANDED


def test_a_part_that_is_overwritten_is_a_gap_with_its_time(tmp_path):
    bin_log(tmp_path / "a.bin", TIMES_S, PLACES, armed=ARMED)
    whole = (tmp_path / "a.bin").read_bytes()
    a, b = int(0.45 * len(whole)), int(0.6 * len(whole))
    (tmp_path / "a.bin").write_bytes(whole[:a] + bytes(b - a) + whole[b:])
    made = judged(one(tmp_path / "a.bin"))
    (note,) = [note for note in made.notes if "nothing was logged for" in note]
    assert "s after take-off" in note
    assert made.flight.mode[-1, 0] == LANDED


@pytest.mark.parametrize("ending", WRITERS)
def test_an_empty_file_is_refused_in_one_line(ending, tmp_path, plan_at, capsys):
    path = tmp_path / f"uas_1{ending}"
    path.write_bytes(b"")
    assert main(["log", str(path), "--plan", plan_at, "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err == f"error: {path}: is empty\n"


def test_what_is_estimated_is_said_kept_and_shown(tmp_path, plan_at, capsys):
    path = tmp_path / "uas_1.csv"
    rows = [f"{t},{a},{b},{c}" for t, (a, b, c) in zip(TIMES_S, PLACES, strict=True)]
    path.write_text("\n".join(["t_s,latitude_deg,longitude_deg,height_m", *rows]))
    out = tmp_path / "out"
    assert main(["log", str(path), "--plan", plan_at, "--out", str(out)]) == 0
    err = capsys.readouterr().err
    assert "warning: uas_1: charge estimated as of level flight at full speed" in err
    assert "warning: uas_2: flight estimated as a stay at its start: it has no log" in err
    estimated = json.loads((out / "summary.json").read_text())["estimated"]
    assert {one["what"] for one in estimated} == {"charge", "current", "voltage", "flight"}
    assert main(["show", str(out)]) == 0
    assert "uas_1: charge estimated as of level flight" in capsys.readouterr().out
    assert main(["replay", str(out)]) == 0
    page = (out / "replay.html").read_text()
    assert "uas_1: charge estimated as of level flight" in page


_FILES = {}


def content(ending, tmp_path_factory):
    if ending not in _FILES:
        path = tmp_path_factory.mktemp("whole") / f"a{ending}"
        WRITERS[ending](path)
        _FILES[ending] = path.read_bytes()
    return _FILES[ending]


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    ending=st.sampled_from(sorted(WRITERS)),
    kind=st.sampled_from(["cut", "noise", "zeros", "removed"]),
    at=st.floats(0.02, 0.98),
    size=st.integers(1, 20_000),
    seed=st.integers(0, 1_000),
)
@example(ending=".bin", kind="zeros", at=0.25, size=60, seed=0)
def test_whatever_is_damaged_no_flight_is_made_up(ending, kind, at, size, seed, tmp_path_factory):
    whole = content(ending, tmp_path_factory)
    first = int(at * len(whole))
    head, tail = whole[:first], whole[first:]
    damaged = {
        "cut": head,
        "noise": head + np.random.default_rng(seed).bytes(size) + tail,
        "zeros": head + bytes(min(size, len(tail))) + tail[size:],
        "removed": head + tail[size:],
    }[kind]
    path = tmp_path_factory.mktemp("damaged") / f"a{ending}"
    path.write_bytes(damaged)
    try:
        made = flown_flight(plan_of_one(), {"uas_1": one(path)}, FRAME)
    except InputError:
        return
    flight, seconds = made.flight, FLIES_S + 2.0
    measured_s = one(path).time_s - 1.7e9
    # where the disarming is lost, the time on the ground counts
    assert flight.steps <= max(seconds + 2.0, measured_s[-1] - ARMED[0] + 1.5)
    assert not flight.violations
    assert energy_Wh(flight)[0] <= 15.0 * 36.0 * (max(seconds, flight.steps) + 2.0) / 3_600.0
    assert np.isfinite(flight.x).all()
    if flight.mode[-1, 0] != LANDED and ending != ".bin":
        assert flight.steps <= measured_s[-1] - ARMED[0] + 1.5
    # nothing is covered where nothing was measured
    for passed in flight.of_log.passes[1:]:
        assert np.linalg.norm(np.subtract(passed.x[:3], nearest_m(passed.x[:3]))) < 0.5


def nearest_m(place_m):
    """The nearest place of the flight that was flown."""
    flown = places_m(TIMES_S, 21.0) * np.array([1.0, 1.0, -1.0])
    flown[:, 2] = np.minimum(flown[:, 2], -1.0)
    return flown[np.linalg.norm(flown - place_m, axis=1).argmin()]


_PLANS = []


def plan_of_one():
    if not _PLANS:
        _PLANS.append(plan(uas=1))
    return _PLANS[0]


def test_a_timestamp_far_ahead_costs_one_message_and_no_more(tmp_path):
    bin_log(tmp_path / "a.bin", TIMES_S, PLACES, armed=ARMED)
    whole = bytearray((tmp_path / "a.bin").read_bytes())
    at = whole.find(b"\xa3\x95\x01", len(whole) // 3)
    whole[at + 3 : at + 11] = struct.pack("<Q", 10**15)
    (tmp_path / "a.bin").write_bytes(whole)
    log = one(tmp_path / "a.bin")
    assert len(log.time_s) == len(TIMES_S) - 1
    assert judged(log).flight.covered[-1] == N

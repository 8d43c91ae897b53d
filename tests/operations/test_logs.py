"""Logs of flights become flights again, and are judged as flights are."""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pyproj")
pytest.importorskip("pymavlink")
pytest.importorskip("pyulog")

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from autopilot_logs import bin_log, tlog
from recorded_flights import FOLDER, ORIGIN, recorded, rows_of
from test_export import random_flight

from uas_coverage_env import Flight, load_planner, rollout
from uas_coverage_env.cli import main
from uas_coverage_env.cli.sorties import keep_planned, planned_directory
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import covered_at, rest_of
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.flight.record import LANDED, LOST
from uas_coverage_env.operations import LocalFrame, flown_flight, read_log
from uas_coverage_env.operations.logs.flown_path import AT_HOME_M
from uas_coverage_env.operations.logs.logged import Logged
from uas_coverage_env.scenario import Place, Scenario, load_scenario

HERE = ("--place", "47.5,19.05")
FRAME = LocalFrame(Place(latitude_deg=47.5, longitude_deg=19.05))


@pytest.fixture(scope="module")
def plan():
    flight = random_flight(1)
    assert accomplished(flight)
    return flight


@pytest.fixture(scope="module")
def plan_at(plan, tmp_path_factory):
    folder = tmp_path_factory.mktemp("flights") / "plan"
    plan.save(folder)
    return str(folder)


def log_of(plan, i, **changes):
    """What a perfect log of a planned UAS holds, until it has landed."""
    samples = plan.last_sample[i] + 1
    places = FRAME.to_geodetic(plan.x[:samples, i, :3])
    fields = {
        "uas": plan.names[i],
        "time_s": plan.time_s[:samples],
        "latitude_deg": places[:, 0],
        "longitude_deg": places[:, 1],
        "height_m": places[:, 2],
    }
    return Logged(**fields | changes)


def logs_of(plan, **changes):
    return {name: log_of(plan, i, **changes) for i, name in enumerate(plan.names)}


def test_an_exported_track_comes_back_as_the_flight_that_it_was(plan, plan_at, tmp_path, capsys):
    files, out = tmp_path / "files", tmp_path / "flown"
    arguments = ["--format", "csv", "--out", str(files), "--min-slack", "0", *HERE]
    assert main(["export", plan_at, *arguments]) == 0
    logs = [str(files / f"{name}.csv") for name in plan.names]
    # the export holds its flight, and where it is
    assert main(["log", *logs, "--plan", str(files), "--out", str(out)]) == 0
    said = capsys.readouterr()
    assert "covered 100%" in said.out
    assert "estimated" not in said.out + said.err
    flight = Flight.load(out)
    assert flight.planner == "log"
    steps = min(flight.steps, plan.steps)
    off_m = np.linalg.norm(flight.x[:steps, :, :3] - plan.x[:steps, :, :3], axis=2)
    assert off_m.max() < AT_HOME_M + 2.0  # on the ground it is put to its start
    for i in range(len(plan.names)):
        away = np.linalg.norm(plan.x[:steps, i, :3] - plan.x[0, i, :3], axis=1) > 8.0
        assert off_m[away, i].max() < 0.01
        soc_off = np.abs(flight.soc[:steps, i] - plan.soc[:steps, i])
        assert soc_off.max() < 2e-3  # the touchdown is in no table
    assert flight.covered[-1] == plan.covered[-1]
    assert np.abs(covered_at(flight) - covered_at(plan)).max() <= 1
    assert (flight.mode[-1] == LANDED).all()
    assert (flight.violations, flight.breaches) == (plan.violations, plan.breaches)
    # the last metres to its start are not flown
    assert plan.min_separation_m - 0.1 < flight.min_separation_m < plan.min_separation_m + 0.5
    assert accomplished(flight)
    assert (out / "map.png").is_file()


def test_the_log_of_one_of_several_sorties_needs_its_own_plan(plan, tmp_path):
    keep_planned([plan, plan], tmp_path, None)
    with pytest.raises(InputError, match=r"holds 2 sorties; give the one .* \S*planned_1$"):
        planned_directory(tmp_path)
    assert Flight.load(planned_directory(tmp_path / "planned_2")) == plan
    keep_planned([plan], tmp_path, None)
    assert Flight.load(planned_directory(tmp_path)) == plan


def test_charge_of_a_log_is_that_of_the_flight(plan):
    soc = np.linspace(1.0, 0.6, plan.last_sample[0] + 1)
    logs = {plan.names[0]: log_of(plan, 0, soc=soc)}
    flight = flown_flight(plan, logs, FRAME).flight
    assert flight.soc[0, 0] == 1.0
    assert flight.soc[-1, 0] == pytest.approx(0.6, abs=0.03)
    vehicle = plan.scenario.vehicles[0]
    used_Ah = flight.current_A[:, 0].sum() * plan.scenario.dt_s / 3600.0
    assert used_Ah == pytest.approx((1.0 - flight.soc[-1, 0]) * vehicle.battery.capacity_Ah)
    volts = flight.voltage_V[: flight.last_sample[0], 0]
    assert (np.diff(volts) <= 1e-9).all()


def test_a_charge_that_was_not_logged_is_estimated_and_said(plan):
    made = flown_flight(plan, logs_of(plan), FRAME)
    assert sum("estimated as of level flight" in note for note in made.notes) == len(plan.names)
    used, planned = 1.0 - made.flight.soc[-1], 1.0 - plan.soc[-1]
    assert (used > 0.8 * planned).all()
    assert (used < 1.4 * planned).all()


def test_a_uas_without_a_log_stays_at_its_start(plan):
    made = flown_flight(plan, {plan.names[0]: log_of(plan, 0)}, FRAME)
    assert any("has no log" in note for note in made.notes)
    assert (made.flight.x[:, 1, :3] == plan.scenario.uas[1].start_m).all()
    assert (made.flight.mode[-1] == LANDED).all()


def test_a_flight_that_was_broken_off_ends_in_the_air(plan):
    whole = log_of(plan, 0)
    half = len(whole.time_s) // 2
    cut = {
        f.name: getattr(whole, f.name)[:half]
        for f in dataclasses.fields(Logged)
        if isinstance(getattr(whole, f.name), np.ndarray)
    }
    made = flown_flight(plan, {plan.names[0]: Logged(plan.names[0], **cut)}, FRAME)
    assert made.flight.ended == "stopped"
    assert made.flight.mode[-1, 0] < LANDED
    assert any("ends away from home" in note for note in made.notes)
    assert made.flight.covered[-1] < len(plan.scenario.waypoints)
    rest = rest_of(made.flight)
    assert len(rest.waypoints) == len(plan.scenario.waypoints) - made.flight.covered[-1]
    assert accomplished(rollout(rest, load_planner("nearest-waypoint"), 0))


def test_contacts_and_breaches_are_found_as_in_a_simulated_flight(plan):
    # both fly the way of the first: side by side at best
    both = {name: log_of(plan, 0, uas=name) for name in plan.names}
    flight = flown_flight(plan, both, FRAME).flight
    assert {v.kind for v in flight.violations} == {"uas"}
    assert (flight.mode[-1] == LOST).all()
    outside = log_of(plan, 0)
    high = dataclasses.replace(outside, height_m=outside.height_m * 10.0)
    flight = flown_flight(plan, {plan.names[0]: high}, FRAME).flight
    assert [v.kind for v in flight.violations] == ["geofence"]


def test_the_log_of_another_place_is_refused(plan):
    far = log_of(plan, 0)
    far = dataclasses.replace(far, latitude_deg=far.latitude_deg + 1.0)
    with pytest.raises(InputError, match=r"never nearer than 11\d\.\d km to the mission"):
        flown_flight(plan, {plan.names[0]: far}, FRAME)


def test_gaps_are_told(plan):
    log = log_of(plan, 0)
    keep = np.ones(len(log.time_s), bool)
    keep[20:40] = False
    cut = dataclasses.replace(
        log,
        **{
            f.name: getattr(log, f.name)[keep]
            for f in dataclasses.fields(Logged)
            if isinstance(getattr(log, f.name), np.ndarray)
        },
    )
    made = flown_flight(plan, {plan.names[0]: cut}, FRAME)
    assert any("nothing was logged for 21.0 s" in note for note in made.notes)


CORNERS = np.array([(47.5, 19.05, 0.0), (47.5, 19.05, 20.0), (47.501, 19.051, 20.0)])


def test_a_data_flash_log_holds_places_attitude_and_charge(tmp_path):
    bin_log(tmp_path / "a.bin", [0.0, 1.0, 2.0], CORNERS)
    (logged,) = read_log(tmp_path / "a.bin")
    assert np.diff(logged.time_s).tolist() == pytest.approx([1.0, 1.0])
    assert logged.time_s[0] > 1e9  # of the satellites: common to all vehicles
    places = np.column_stack([logged.latitude_deg, logged.longitude_deg, logged.height_m])
    assert np.abs(places - CORNERS).max() < 1e-6
    assert np.degrees(logged.attitude_rad[1]) == pytest.approx([10.0, -5.0, 2.0])
    assert logged.used_Ah == pytest.approx([0.0, 0.01, 0.02])
    assert logged.voltage_V == pytest.approx([15.0] * 3)
    assert logged.current_A == pytest.approx([36.0] * 3)


def test_telemetry_holds_places_attitude_and_charge(tmp_path):
    tlog(tmp_path / "a.tlog", [0.0, 1.0, 2.0], CORNERS)
    (logged,) = read_log(tmp_path / "a.tlog")
    assert logged.time_s == pytest.approx([1.7e9, 1.7e9 + 1.0, 1.7e9 + 2.0])
    places = np.column_stack([logged.latitude_deg, logged.longitude_deg, logged.height_m])
    assert np.abs(places - CORNERS).max() < 1e-6
    assert np.degrees(logged.attitude_rad[1]) == pytest.approx([10.0, -5.0, 4.0])
    assert logged.used_Ah == pytest.approx([0.0, 0.01, 0.02])
    assert logged.voltage_V == pytest.approx([15.0] * 3)


def test_a_log_whose_clock_goes_back_is_refused(tmp_path):
    tlog(tmp_path / "a.tlog", [0.0, 100.0, 30.0], CORNERS[:3])
    with pytest.raises(InputError, match=r"clock goes back by 70 s, 100 s after its beginning"):
        read_log(tmp_path / "a.tlog")


def test_damaged_places_of_a_log_are_passed_over_without_a_word(tmp_path, capfd):
    bin_log(tmp_path / "a.bin", np.arange(3.0), CORNERS[:3])
    whole = (tmp_path / "a.bin").read_bytes()
    (tmp_path / "a.bin").write_bytes(whole + b"\x55" * 1_000 + whole[-200:])
    (logged,) = read_log(tmp_path / "a.bin")
    assert len(logged.time_s) == 3
    assert capfd.readouterr() == ("", "")


def test_data_flash_logs_become_a_flight(plan, plan_at, tmp_path, capsys):
    paths = []
    for i, name in enumerate(plan.names):
        log = log_of(plan, i)
        places = np.column_stack([log.latitude_deg, log.longitude_deg, log.height_m])
        path = tmp_path / f"{i:08}.BIN"
        bin_log(path, log.time_s, places, first_s=100.0 + 50.0 * i)
        paths.append(f"{name}={path}")
    out = tmp_path / "flown"
    assert main(["log", *paths, "--plan", plan_at, "--out", str(out), *HERE]) == 0
    capsys.readouterr()
    flight = Flight.load(out)
    assert flight.covered[-1] == plan.covered[-1]
    assert (flight.mode[-1] == LANDED).all()
    assert flight.steps == pytest.approx(plan.steps, abs=8)
    assert (flight.soc[-1] < flight.soc[0]).all()


def around_karhula():
    """A plan over the place of the recorded flights, with what they pass as waypoints."""
    data = load_scenario("open_field").model_dump(mode="json", by_alias=True)
    fence = [(n, e, d) for n in (-500.0, 500.0) for e in (-500.0, 500.0) for d in (-120.0, 0.0)]
    corners = [
        ORIGIN.to_ned(*map(float, row[2:])) for row in rows_of("tolerance_2m_uas_1_items.csv")[1::4]
        if row[2]
    ]  # fmt: skip
    data["geofence"]["vertices_m"] = fence
    data |= {"obstacles": [], "moving_obstacles": [], "decorations": [], "max_steps": 100}
    data["place"] = ORIGIN.place.model_dump()
    data["waypoints"] = [
        {"position_m": corner.tolist(), "radius_m": 15.0, "weight": 1.0} for corner in corners
    ]
    for k, uas in enumerate(data["uas"]):
        start_m = recorded(f"tolerance_2m_uas_{k + 1}")[1][0]
        uas["start_m"] = [float(start_m[0]), float(start_m[1]), -1.0]
    return Scenario.model_validate_json(json.dumps(data))


def test_recorded_flights_of_an_autopilot_come_home_and_are_judged(tmp_path, capsys):
    plan = rollout(around_karhula(), load_planner("hover"), 0, max_steps=2)
    plan.save(tmp_path / "plan")
    logs = []
    for k in (1, 2):
        text = (FOLDER / f"tolerance_2m_uas_{k}_flown.csv").read_text()
        path = tmp_path / f"uas_{k}_flown.csv"
        path.write_text(text)
        logs.append(str(path))
    out = tmp_path / "flown"
    assert main(["log", *logs, "--plan", str(tmp_path / "plan"), "--out", str(out)]) == 0
    capsys.readouterr()
    flight = Flight.load(out)
    for k in (0, 1):
        times_s, _ = recorded(f"tolerance_2m_uas_{k + 1}")
        # from the ground to the ground, less what is below its start
        assert flight.last_sample[k] == pytest.approx(times_s[-1], abs=15)
    assert flight.scenario.max_steps > 500  # the plan had fewer
    assert accomplished(flight)
    assert not flight.violations
    assert flight.min_separation_m == pytest.approx(12.0, abs=1.0)
    assert main(["replay", str(out)]) == 0
    assert (out / "replay.html").stat().st_size > 10_000


HEAD = "t_s,latitude_deg,longitude_deg,height_m"
MISTAKES = {
    "no file": (None, "cannot be read or written (no such file"),
    "nothing": ("", "is empty"),
    "no column": ("t_s,lat,lon\n0,1,2", "has no column latitude_deg"),
    "no rows": (HEAD, "holds no sample"),
    "no number": (f"{HEAD}\n0,47,x,1", "line 2: longitude_deg 'x' is no number"),
    "underscores": (f"{HEAD}\n0,4_7,19,1", "line 2: latitude_deg '4_7' is no number"),
    "not finite": (f"{HEAD}\n0,47,nan,1", "line 2: longitude_deg 'nan' is no number"),
    "a short row": (f"{HEAD}\n0,47", "line 2: holds 2 values, not 4"),
    "one sample": (f"{HEAD}\n0,47,19,1", "fewer than two positions"),
    "time backwards": (f"{HEAD}\n1,47,19,1\n0,47,19,1", "time 0.000 s follows 1.000 s"),
    "metres": (f"{HEAD}\n0,5000,19,1\n1,5000,19,1", "latitude 5000 should be within 90"),
    "percent": (f"{HEAD},soc\n0,47,19,1,99\n1,47,19,1,98", "soc should be between 0 and 1"),
    "the ground": (f"{HEAD}\n0,47.5,19.05,0\n1,47.5,19.05,0", "it is of no flight"),
    "another UAS": (f"{HEAD},uas\n0,47,19,1,x\n1,47,19,1,x", "is of 'x'; give UAS="),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_log_that_cannot_be_meant_is_refused_in_one_line(case, plan_at, tmp_path, capsys):
    text, said = MISTAKES[case]
    path = tmp_path / "uas_1.csv"
    if text is not None:
        path.write_text(text)
    arguments = [str(path), "--plan", plan_at, "--out", str(tmp_path / "out"), *HERE]
    assert main(["log", *arguments]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert said in err


OTHERS = {
    "an unknown ending": ("uas_1.txt", "unknown kind of log; give .csv, .bin, .tlog, .ulg"),
    "a name of no UAS": ("flight.csv", "does not say of which UAS it is; give UAS=flight.csv"),
    "no data flash log": ("uas_1.bin", "holds no position (POS)"),
    "no telemetry": ("uas_1.tlog", "holds no position (GLOBAL_POSITION_INT)"),
}


def test_a_battery_beyond_its_depth_is_a_contact_as_in_any_flight(plan):
    used_Ah = np.linspace(0.0, 100.0, plan.last_sample[0] + 1)
    flight = flown_flight(plan, {plan.names[0]: log_of(plan, 0, used_Ah=used_Ah)}, FRAME).flight
    assert [v.kind for v in flight.violations] == ["battery"]


@pytest.mark.parametrize("case", OTHERS)
def test_a_file_that_is_no_log_is_refused_in_one_line(case, plan_at, tmp_path, capsys):
    name, said = OTHERS[case]
    path = tmp_path / name
    path.write_text(f"{HEAD}\n0,47.5,19.05,0\n1,47.5,19.05,20\n" * 20 if "csv" not in name else
                    f"{HEAD}\n0,47.5,19.05,0\n1,47.5,19.05,20\n")  # fmt: skip
    arguments = [str(path), "--plan", plan_at, "--out", str(tmp_path / "out"), *HERE]
    assert main(["log", *arguments]) == 2
    assert said in capsys.readouterr().err


def test_two_logs_of_one_uas_are_refused(plan, plan_at, tmp_path, capsys):
    path = tmp_path / "uas_1.csv"
    path.write_text(f"{HEAD}\n0,47.5,19.05,0\n1,47.5,19.05,20\n")
    arguments = [str(path), str(path), "--plan", plan_at, "--out", str(tmp_path / "out"), *HERE]
    assert main(["log", *arguments]) == 2
    assert "is a second log of uas_1" in capsys.readouterr().err

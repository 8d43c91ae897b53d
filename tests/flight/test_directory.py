import csv
import dataclasses
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Decision, Flight, rollout
from uas_coverage_env.flight.directory import FLIGHT_COLUMNS
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.world import Velocity, Wrench

FILES = {
    "scenario.json",
    "flight.csv",
    "moving_obstacles.csv",
    "plan.csv",
    "legs.csv",
    "rewards.csv",
    "summary.json",
    "run.json",
}
FLIGHT_HEADER = (
    "t_s,uas,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,phi_rad,theta_rad,psi_rad,wx_radps,wy_radps,"
    "wz_radps,dod,u_th_V,soc,voltage_V,current_A,mode,lift_N,tau_x_Nm,tau_y_Nm,tau_z_Nm,"
    "delta_thrust_N,covered"
)


@pytest.fixture
def saved(flight, tmp_path) -> Path:
    return flight.save(tmp_path / "flight")


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_a_saved_flight_reads_back_equal(flight, saved):
    assert {path.name for path in saved.iterdir()} == FILES
    assert Flight.load(saved) == flight


def test_flights_that_differ_in_one_bit_are_not_equal(flight):
    x = flight.x.copy()
    x[3, 0, 5] = np.nextafter(x[3, 0, 5], 1.0)
    assert dataclasses.replace(flight, x=x) != flight
    assert flight != "a flight"


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    st.data(),
    st.floats(allow_nan=False, allow_infinity=False),
)
def test_every_finite_number_survives_the_way_through_the_files(
    yard, tmp_path_factory, data, separation_m
):
    numbers = st.floats(-1e150, 1e150)  # legs have lengths: squares are finite, too
    flight = rollout(yard, _Predicting(), max_steps=2)
    flight = dataclasses.replace(
        flight,
        x=data.draw(arrays(float, flight.x.shape, elements=numbers)),
        u=data.draw(arrays(float, flight.u.shape, elements=numbers)),
        min_separation_m=separation_m,
    )
    folder = tmp_path_factory.mktemp("flight")
    assert Flight.load(flight.save(folder)) == flight


class _Predicting:
    """Holds position and says so."""

    last_decision = None

    def reset(self, scenario, seed):
        self.last_decision = None

    def act(self, swarm):
        paths_m = {name: np.tile(swarm.x[i, :3], (3, 1)) for i, name in enumerate(swarm.names)}
        self.last_decision = Decision(paths_m, fallback=swarm.step == 1, mip_gap=0.125)
        return {name: Velocity(0.0, 0.0, 3.0) for name in swarm.active}


def test_flight_csv_has_the_columns_of_the_contract_in_their_order(saved):
    assert (saved / "flight.csv").read_text().splitlines()[0] == FLIGHT_HEADER
    assert (saved / "moving_obstacles.csv").read_text().startswith("t_s,name,x_m,y_m,z_m\n")
    assert (saved / "plan.csv").read_text() == "t_s,uas,n,x_m,y_m,z_m\n"


def test_there_is_one_row_per_uas_and_sample_until_it_has_landed(flight, saved):
    rows = rows_of(saved / "flight.csv")
    for i, name in enumerate(flight.names):
        own = [row for row in rows if row["uas"] == name]
        assert [float(row["t_s"]) for row in own] == list(range(flight.last_sample[i] + 1))
        assert [row["mode"] for row in own].index("landed") == len(own) - 1
        assert float(own[-1]["current_A"]) == float(own[-1]["lift_N"]) == 0.0
        assert {row["mode"] for row in own[:-1]} == {"transit", "return"}
        assert all(float(row["soc"]) == 1.0 - float(row["dod"]) for row in own)
    assert [float(row["t_s"]) for row in rows] == sorted(float(row["t_s"]) for row in rows)


def test_a_lost_uas_has_its_last_row_where_it_is_lost(yard, tmp_path):
    planner: Any = _Predicting()
    planner.act = lambda swarm: {name: Velocity(12.0, 0.0, 3.0) for name in swarm.active}
    folder = rollout(yard, planner).save(tmp_path / "lost")
    modes = [row["mode"] for row in rows_of(folder / "flight.csv") if row["uas"] == "left"]
    assert modes.index("lost") == len(modes) - 1
    violations = json.loads((folder / "summary.json").read_text())["violations"]
    assert violations[0] == {
        "t_s": float(len(modes) - 1),
        "uas": "left",
        "kind": "geofence",
        "with": None,
    }


def test_a_limit_exceeded_is_in_the_summary_and_is_read_back(yard, tmp_path):
    planner: Any = _Predicting()
    planner.act = lambda swarm: dict.fromkeys(swarm.active, Wrench(0.0, 0.0, -0.00825, 0.0))
    flight = rollout(yard, planner, max_steps=3)
    folder = flight.save(tmp_path / "tilted")
    tilt = json.loads((folder / "summary.json").read_text())["violations"][0]
    assert list(tilt) == ["t_s", "uas", "kind", "with", "value", "limit", "samples"]
    assert (tilt["kind"], tilt["with"], tilt["limit"]) == ("limit", "tilt", 0.4363)
    assert Flight.load(folder) == flight


def test_the_summary_follows_from_the_rows(saved, yard):
    result = json.loads((saved / "summary.json").read_text())
    rows = rows_of(saved / "flight.csv")
    energy_J = sum(float(row["voltage_V"]) * float(row["current_A"]) for row in rows) * yard.dt_s
    assert result["energy_Wh"] == pytest.approx(energy_J / 3600.0, rel=1e-12)
    assert result["coverage"] == int(rows[-1]["covered"]) / len(yard.waypoints) == 1.0
    assert result["steps"] == max(float(row["t_s"]) for row in rows)
    assert result["all_home"] is True


def test_the_summary_has_the_fields_of_the_contract(saved):
    result = json.loads((saved / "summary.json").read_text())
    kinds = {
        **dict.fromkeys(("coverage", "energy_Wh", "wall_time_s", "return"), float),
        **dict.fromkeys(("steps", "breaches", "fallbacks", "seed"), int),
        **dict.fromkeys(("min_separation_m", "min_obstacle_clearance_m"), float),
        **dict.fromkeys(("decision_time_s", "versions", "planner", "reward_terms"), dict),
        **{"all_home": bool, "violations": list, "mip_gap_p50": type(None)},
    }
    assert {key: type(result[key]) for key in kinds} == kinds
    assert "failed_figures" not in result
    assert list(result["decision_time_s"]) == ["p50", "p95", "p99", "max"]
    assert result["planner"] == {"name": "Listed", "options": {}}
    assert result["seed"] == 3
    assert result["mip_gap_p50"] is None
    assert {"uas-coverage-env", "python", "numpy", "numba", "highspy"} <= set(result["versions"])


def test_the_scenario_is_kept_with_every_default_filled_in(saved, yard):
    scenario = json.loads((saved / "scenario.json").read_text())
    assert scenario["schema"] == 1
    assert scenario["decorations"] == []
    assert scenario["waypoints"][1] == {
        "kind": None,
        "position_m": [50.0, 30.0, -10.0],
        "radius_m": 8.0,
        "weight": 2.0,
    }
    assert scenario["uas"][0]["vehicle"] == "s500_v2"


def test_moving_obstacles_are_kept_at_every_sample(saved, yard, flight):
    rows = rows_of(saved / "moving_obstacles.csv")
    assert len(rows) == flight.steps + 1
    for row in rows:
        centre_m = yard.moving_positions(float(row["t_s"]))[0]
        assert [float(row[key]) for key in ("x_m", "y_m", "z_m")] == pytest.approx(centre_m)
        assert row["name"] == "kite"


def test_predictions_are_kept_step_by_step(yard, tmp_path):
    flight = rollout(yard, _Predicting(), max_steps=2)
    rows = rows_of(flight.save(tmp_path / "flight") / "plan.csv")
    assert [(row["t_s"], row["uas"], row["n"]) for row in rows] == [
        (time, name, n) for time in ("0.0", "1.0") for name in ("left", "right") for n in "012"
    ]
    assert float(rows[0]["z_m"]) == -1.0
    result = summary(flight)
    assert (result["fallbacks"], result["mip_gap_p50"]) == (1, 0.125)


def test_a_folder_that_is_not_empty_is_refused(flight, tmp_path):
    (tmp_path / "thesis.txt").write_text("all of it")
    with pytest.raises(InputError, match="is not empty"):
        flight.save(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_overwriting_replaces_our_files_and_no_other(flight, yard, tmp_path):
    rollout(yard, _Predicting(), max_steps=1).save(tmp_path)
    (tmp_path / "thesis.txt").write_text("all of it")
    flight.save(tmp_path, overwrite=True)
    assert Flight.load(tmp_path) == flight
    assert (tmp_path / "thesis.txt").read_text() == "all of it"
    assert {path.name for path in tmp_path.iterdir()} == {*FILES, "thesis.txt"}


def test_a_file_is_no_folder(flight, tmp_path):
    (tmp_path / "flight").write_text("")
    with pytest.raises(InputError, match="is a file"):
        flight.save(tmp_path / "flight")
    with pytest.raises(InputError, match="cannot be written"):
        flight.save(tmp_path / "flight" / "deeper")


def test_a_write_that_fails_leaves_the_former_flight_whole(flight, yard, tmp_path, monkeypatch):
    former = rollout(yard, _Predicting(), max_steps=1)
    former.save(tmp_path)
    mkstemp = tempfile.mkstemp

    def full_disk(suffix, prefix, folder):
        if "run.json" in prefix:
            raise OSError(28, "No space left on device")
        return mkstemp(suffix, prefix, folder)

    monkeypatch.setattr(tempfile, "mkstemp", full_disk)
    with pytest.raises(InputError, match="No space left"):
        flight.save(tmp_path, overwrite=True)
    assert {path.name for path in tmp_path.iterdir()} == FILES
    assert Flight.load(tmp_path) == former


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("flight.csv", "t_s,uas\n"),
        ("flight.csv", FLIGHT_HEADER + "\n"),
        ("flight.csv", FLIGHT_HEADER + "\n0.0,left\n"),
        ("summary.json", "[]"),
        ("summary.json", "{}"),
        ("run.json", "not json"),
        ("plan.csv", "t_s,uas,n,x_m,y_m,z_m\n0.0,nobody,0,0,0,0\n"),
        ("moving_obstacles.csv", "t_s,name,x_m,y_m,z_m\n0.0,kite,0,0,0\n"),
    ],
)
def test_a_damaged_file_is_named_in_one_line(saved, name, text):
    (saved / name).write_text(text)
    with pytest.raises(InputError) as error:
        Flight.load(saved)
    assert name in str(error.value)
    assert "\n" not in str(error.value)


def refusal(folder: Path) -> str:
    with pytest.raises(InputError) as error:
        Flight.load(folder)
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize(
    ("name", "column", "value", "words"),
    [
        ("flight.csv", "t_s", "inf", "line 4: 'inf' is not finite"),
        ("flight.csv", "t_s", "1e308", "is not within the"),
        ("flight.csv", "t_s", "noon", "line 4: 'noon' is no number"),
        ("flight.csv", "uas", "middle", "uas is 'middle'; there are left, right"),
        ("flight.csv", "x_m", "nan", "'nan' is not finite"),
        ("flight.csv", "soc", "full", "'full' is no number"),
        ("flight.csv", "mode", "resting", "mode is 'resting'; there are covering, transit"),
        ("flight.csv", "covered", "-1", "covered is '-1', not a whole number from 0 to 3"),
        ("flight.csv", "covered", "9" * 30, "covered is"),
        ("plan.csv", "t_s", "1e999", "line 4: '1e999' is not finite"),
        ("plan.csv", "n", "9" * 30, "n is"),
        ("plan.csv", "n", "-1", "n is '-1', not a whole number"),
        ("plan.csv", "z_m", "deep", "'deep' is no number"),
        ("moving_obstacles.csv", "t_s", "7.0", "line 4: is of 'kite' at '7.0' s; 'kite' at 2 s"),
        ("moving_obstacles.csv", "name", "gull", "is of 'gull'"),
        ("moving_obstacles.csv", "x_m", "inf", "line 4: 'inf' is not finite"),
    ],
)
def test_a_wrong_value_is_named_with_its_line(yard, tmp_path, name, column, value, words):
    folder = rollout(yard, _Predicting(), max_steps=2).save(tmp_path / "flight")
    lines = [line.split(",") for line in (folder / name).read_text().splitlines()]
    lines[3][lines[0].index(column)] = value
    (folder / name).write_text("".join(f"{','.join(line)}\n" for line in lines))
    assert words in refusal(folder).removeprefix(f"{folder / name}: was damaged: ")


@pytest.mark.parametrize(
    ("name", "path", "value", "words"),
    [
        ("summary.json", ("breaches",), -1, "breaches: should be greater than or equal to 0"),
        ("summary.json", ("breaches",), True, "breaches: should be a whole number, not true"),
        ("summary.json", ("wall_time_s",), "1", 'wall_time_s: should be a number, not "1"'),
        ("summary.json", ("energy_Wh",), float("nan"), "energy_Wh: should be a finite number"),
        ("summary.json", ("planner",), "Listed", "planner: should be a table"),
        ("summary.json", ("violations",), [{}], "violations[0].t_s: is missing"),
        (
            "summary.json",
            ("violations",),
            [{"t_s": 1.0, "uas": "middle", "kind": "geofence", "with": None}],
            "violations[0]: uas is 'middle'; there are left, right",
        ),
        (
            "summary.json",
            ("violations",),
            [{"t_s": 1e300, "uas": "left", "kind": "geofence", "with": None}],
            "violations[0]: 1e+300 s is not within the",
        ),
        (
            "summary.json",
            ("violations",),
            [{"t_s": 1.0, "uas": "left", "kind": "limit", "with": "tilt", "limit": 0.4}],
            "violations[0]: of a limit it holds with, value, limit and samples",
        ),
        ("run.json", ("dynamics",), "magic", "dynamics: should be 'lpv' or 'nonlinear'"),
        ("run.json", ("ended",), "well", "ended: should be 'complete'"),
        ("run.json", ("return_mode",), 1, "return_mode: should be true or false, not 1"),
        ("run.json", ("decisions", 0, "duration_s"), -1.0, "decisions[0].duration_s: should be"),
        ("run.json", ("decisions",), [], "0 decisions for"),
    ],
)
def test_a_wrong_field_is_named(saved, name, path, value, words):
    data = json.loads((saved / name).read_text())
    table = data
    for key in path[:-1]:
        table = table[key]
    table[path[-1]] = value
    (saved / name).write_text(json.dumps(data))
    assert words in refusal(saved)
    del table[path[-1]]
    (saved / name).write_text(json.dumps(data))
    if path == ("energy_Wh",):  # it follows from the rows
        assert Flight.load(saved)
    else:
        assert "is missing" in refusal(saved)


@pytest.mark.parametrize("name", ["flight.csv", "rewards.csv"])
def test_a_sample_that_is_there_twice_is_refused(saved, name):
    lines = (saved / name).read_text().splitlines(keepends=True)
    (saved / name).write_text("".join([*lines, lines[3]]))
    words = f"line {len(lines) + 1}: sample 1 of left is there twice"
    assert refusal(saved) == f"{saved / name}: was damaged: {words}"


def test_a_planner_that_predicts_nothing_needs_no_file_of_predictions(flight, saved):
    (saved / "plan.csv").unlink()
    assert Flight.load(saved) == flight


def test_a_folder_without_a_flight_is_named(tmp_path):
    with pytest.raises(InputError, match=r"scenario\.json: cannot be read"):
        Flight.load(tmp_path)


def test_an_interrupted_flight_is_kept_like_any_other(yard, listed, tmp_path):
    def stop(progress):
        if progress.swarm.step == 4:
            raise KeyboardInterrupt

    flight = rollout(yard, listed, on_step=stop)
    loaded = Flight.load(flight.save(tmp_path / "flight"))
    assert loaded == flight
    assert (loaded.ended, loaded.steps) == ("stopped", 4)


def test_a_flight_that_never_began_is_kept_too(yard, listed, tmp_path):
    flight = rollout(yard, listed, should_stop=lambda: True)
    loaded = Flight.load(flight.save(tmp_path / "flight"))
    assert loaded == flight
    assert summary(loaded)["decision_time_s"] == {
        "p50": None,
        "p95": None,
        "p99": None,
        "max": None,
    }


def test_files_that_ask_for_more_samples_than_they_hold_are_refused_before_room_is_made(saved):
    path = saved / "flight.csv"
    header, first, *_ = path.read_text().splitlines()
    late = ",".join(["15.0", *first.split(",")[1:]])
    path.write_text(f"{header}\n{first}\n{late}\n")
    with pytest.raises(InputError, match=r"it holds 2 rows, too few for 16 samples"):
        Flight.load(saved)


def test_a_row_that_does_not_fit_its_headings_is_not_written(flight, tmp_path, monkeypatch):
    monkeypatch.setattr("uas_coverage_env.flight.directory.FLIGHT_COLUMNS", FLIGHT_COLUMNS[:-1])
    with pytest.raises(ValueError, match="a row of 26 values under 25 headings"):
        flight.save(tmp_path / "flight")
    assert not (tmp_path / "flight" / "flight.csv").exists()

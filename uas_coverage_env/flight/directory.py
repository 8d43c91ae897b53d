"""The flight directory: plain files that hold one flight, written whole or not at all."""

import csv
import dataclasses
import io
import json
import math
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from uas_coverage_env.flight.metrics import summary
from uas_coverage_env.flight.record import (
    MODES,
    PLAN_DTYPE,
    DecisionRecord,
    Flight,
    Violation,
)
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.strict_toml import InputError, parse
from uas_coverage_env.vehicle import N_INPUTS, N_STATES

T = TypeVar("T")

STATE_COLUMNS = (
    *("x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps", "phi_rad", "theta_rad", "psi_rad"),
    *("wx_radps", "wy_radps", "wz_radps", "dod", "u_th_V"),
)
INPUT_COLUMNS = ("lift_N", "tau_x_Nm", "tau_y_Nm", "tau_z_Nm", "delta_thrust_N")
FLIGHT_COLUMNS = (
    *("t_s", "uas", *STATE_COLUMNS, "soc", "voltage_V", "current_A", "mode"),
    *(*INPUT_COLUMNS, "covered"),
)
_SUMMARY_FIELDS = {
    "planner": str,
    "planner_options": dict[str, Any],
    "violations": tuple[Violation, ...],
    "seed": int,
    "breaches": int,
    "min_separation_m": float | None,
    "min_obstacle_clearance_m": float | None,
    "wall_time_s": float,
    "versions": dict[str, str],
}
_RUN_FIELDS = {
    "dynamics": str,
    "return_mode": bool,
    "safety_filter": bool,
    "ended": str,
    "decisions": tuple[DecisionRecord, ...],
}
MOVING_COLUMNS = ("t_s", "name", "x_m", "y_m", "z_m")
PLAN_COLUMNS = ("t_s", "uas", "n", "x_m", "y_m", "z_m")


def check_directory(directory: Path, *, overwrite: bool) -> None:
    """Make sure that a flight can be written there, before it is flown.

    Raises:
        InputError: It is a file, is not empty and `overwrite` is not set, or cannot be written.
    """
    try:
        if directory.exists() and not directory.is_dir():
            raise InputError(f"{directory}: is a file; give a folder")
        directory.mkdir(parents=True, exist_ok=True)
        empty = not any(directory.iterdir())
        with tempfile.TemporaryFile(dir=directory):
            pass
    except OSError as error:
        raise InputError(f"{directory}: cannot be written ({error.strerror})") from error
    if not empty and not overwrite:
        raise InputError(f"{directory}: is not empty; give another folder or ask to overwrite")


def write_flight(flight: Flight, directory: Path, *, overwrite: bool = False) -> Path:
    """Write all files of a flight; foreign files in the folder are left alone.

    Raises:
        InputError: See `check_directory`.
    """
    check_directory(directory, overwrite=overwrite)
    times = [repr(time) for time in flight.time_s.tolist()]
    texts = {
        "scenario.json": _json(flight.scenario.model_dump(mode="json", by_alias=True)),
        "flight.csv": _csv(FLIGHT_COLUMNS, _flight_rows(flight, times)),
        "moving_obstacles.csv": _csv(MOVING_COLUMNS, _moving_rows(flight, times)),
        "plan.csv": _csv(PLAN_COLUMNS, _plan_rows(flight, times)),
        "run.json": _json(_run(flight)),
        # the summary last: where it is, the rest is
        "summary.json": _json(summary(flight)),
    }
    _write_all(directory, texts)
    return directory


def read_flight(directory: Path) -> dict[str, Any]:
    """Read the fields of a `Flight` from its directory.

    Raises:
        InputError: A file is missing or was damaged.
    """
    scenario = parse(
        _read(directory, "scenario.json", json.loads), Scenario, str(directory / "scenario.json")
    )
    samples = _read(directory, "flight.csv", lambda text: _flight_arrays(text, scenario))
    steps = len(samples["x"]) - 1
    shape = (steps + 1, len(scenario.moving_obstacles), 3)
    return {
        "scenario": scenario,
        **_read(directory, "summary.json", lambda text: _summary_fields(text, scenario)),
        **_read(directory, "run.json", lambda text: _run_fields(text, steps)),
        **samples,
        "moving_position_m": _read(
            directory, "moving_obstacles.csv", lambda text: _moving_array(text).reshape(shape)
        ),
        "plan": _read(directory, "plan.csv", lambda text: _plan_array(text, scenario)),
    }


def _flight_rows(flight: Flight, times: Sequence[str]) -> Iterator[list[Any]]:
    """One row per UAS and sample, up to the sample in which it has landed or is lost."""
    states, inputs = flight.x.tolist(), flight.u.tolist()
    soc, voltage_V, current_A = (
        series.tolist() for series in (flight.soc, flight.voltage_V, flight.current_A)
    )
    modes, covered, last = flight.mode.tolist(), flight.covered.tolist(), flight.last_sample
    for k, time in enumerate(times):
        for i, name in enumerate(flight.names):
            if k <= last[i]:
                yield [
                    *(time, name, *states[k][i], soc[k][i], voltage_V[k][i], current_A[k][i]),
                    *(MODES[modes[k][i]], *inputs[k][i], covered[k]),
                ]


def _flight_arrays(text: str, scenario: Scenario) -> dict[str, Any]:
    rows = _rows(text, FLIGHT_COLUMNS)
    if not rows:
        raise ValueError("it holds no sample")
    index = {uas.name: i for i, uas in enumerate(scenario.uas)}
    samples = 1 + _step(rows[-1][0], scenario)
    shape = (samples, len(index))
    x, u = np.zeros((*shape, N_STATES)), np.zeros((*shape, N_INPUTS))
    voltage_V, current_A = np.zeros(shape), np.zeros(shape)
    mode, covered = np.zeros(shape, np.int8), np.zeros(samples, np.int64)
    first_input = FLIGHT_COLUMNS.index(INPUT_COLUMNS[0])
    last = np.zeros(len(index), np.int64)
    found = np.zeros(shape, np.bool_)
    for row in rows:
        k, i = _step(row[0], scenario), index[row[1]]
        x[k, i] = [_number(value) for value in row[2 : 2 + N_STATES]]
        voltage_V[k, i], current_A[k, i] = _number(row[-9]), _number(row[-8])
        mode[k, i] = MODES.index(row[-7])
        u[k, i] = [_number(value) for value in row[first_input : first_input + N_INPUTS]]
        covered[k] = int(row[-1])
        last[i] = k
        found[k, i] = True
    for i, name in enumerate(index):
        if not found[: last[i] + 1, i].all():
            raise ValueError(f"sample {found[:, i].argmin()} of {name} is missing")
    for i, k in enumerate(last):  # after the end of a UAS its last sample is repeated
        for series in (x, u, voltage_V, current_A, mode):
            series[k + 1 :, i] = series[k, i]
    return {
        **{"x": x, "u": u, "voltage_V": voltage_V, "current_A": current_A},
        **{"mode": mode, "covered": covered},
    }


def _moving_rows(flight: Flight, times: Sequence[str]) -> Iterator[list[Any]]:
    names = [obstacle.name for obstacle in flight.scenario.moving_obstacles]
    for time, positions_m in zip(times, flight.moving_position_m.tolist(), strict=True):
        for name, position_m in zip(names, positions_m, strict=True):
            yield [time, name, *position_m]


def _moving_array(text: str) -> NDArray[np.float64]:
    rows = _rows(text, MOVING_COLUMNS)
    return np.array([[_number(value) for value in row[2:]] for row in rows])


def _plan_rows(flight: Flight, times: Sequence[str]) -> Iterator[list[Any]]:
    for step, i, n, position_m in flight.plan.tolist():
        yield [times[step], flight.names[i], n, *position_m.tolist()]


def _plan_array(text: str, scenario: Scenario) -> NDArray[np.void]:
    index = {uas.name: i for i, uas in enumerate(scenario.uas)}
    return np.array(
        [
            (
                _step(time, scenario),
                index[name],
                int(n),
                tuple(_number(value) for value in position),
            )
            for time, name, n, *position in _rows(text, PLAN_COLUMNS)
        ],
        dtype=PLAN_DTYPE,
    )


def _run(flight: Flight) -> dict[str, Any]:
    """How the flight came about: what no other file says, decision by decision."""
    return {
        "dynamics": flight.dynamics,
        "return_mode": flight.return_mode,
        "safety_filter": flight.safety_filter,
        "ended": flight.ended,
        "decisions": [dataclasses.asdict(decision) for decision in flight.decisions],
    }


def _run_fields(text: str, steps: int) -> dict[str, Any]:
    run = _fields(_object(text), _RUN_FIELDS)
    if len(run["decisions"]) != steps:
        raise ValueError(f"it holds {len(run['decisions'])} decisions for {steps} steps")
    return run


def _summary_fields(text: str, scenario: Scenario) -> dict[str, Any]:
    """What the summary alone holds; the rest of it follows from the other files."""
    data = _object(text)
    entries = [
        {
            "time_s": entry["t_s"],
            "uas": entry["uas"],
            "kind": entry["kind"],
            "partner": entry["with"],
        }
        for entry in data["violations"]
    ]
    summary_fields = _fields(
        {
            **data,
            "violations": entries,
            "planner": data["planner"]["name"],
            "planner_options": data["planner"]["options"],
        },
        _SUMMARY_FIELDS,
    )
    names = {uas.name for uas in scenario.uas}
    for violation in summary_fields["violations"]:
        if violation.uas not in names:
            raise ValueError(f"a violation names {violation.uas[:80]!r}, which is no UAS")
        _step(violation.time_s, scenario)
    return summary_fields


def _object(text: str) -> dict[str, Any]:
    data = json.loads(text, parse_constant=_number)
    if not isinstance(data, dict):
        raise ValueError("it should hold one object, { ... }")
    return data


def _fields(data: dict[str, Any], kinds: dict[str, Any]) -> dict[str, Any]:
    """Some fields of an object, each of the kind that a `Flight` holds."""
    return {name: TypeAdapter(kind).validate_python(data[name]) for name, kind in kinds.items()}


def _step(time_s: str | float, scenario: Scenario) -> int:
    step = round(float(time_s) / scenario.dt_s)
    if not 0 <= step <= scenario.max_steps:
        raise ValueError(f"{time_s} s is not within the {scenario.max_steps} steps of the mission")
    return step


def _number(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text} is not finite")
    return number


def _json(data: Any) -> str:
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _csv(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    # the csv module writes floats as repr does: they read back to the last bit
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()


def _rows(text: str, header: Sequence[str]) -> list[list[str]]:
    rows = list(csv.reader(io.StringIO(text)))
    if not rows or tuple(rows[0]) != tuple(header):
        raise ValueError(f"its first line should be {','.join(header)}")
    return rows[1:]


def _read(directory: Path, name: str, reader: Callable[[str], T]) -> T:
    path = directory / name
    try:
        return reader(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); is it a flight?") from error
    except (ValueError, KeyError, IndexError, TypeError, RecursionError, csv.Error) as error:
        raise InputError(f"{path}: was damaged: {' '.join(str(error).split())}") from error


def _write_all(directory: Path, texts: dict[str, str]) -> None:
    """Write every file beside its place first, then move them all: no half flight stays behind."""
    written: list[tuple[Path, Path]] = []
    try:
        for name, text in texts.items():
            temporary = directory / f".{name}.{os.getpid()}"
            written.append((temporary, directory / name))
            temporary.write_text(text, encoding="utf-8", newline="")
        for temporary, final in written:
            temporary.replace(final)
    except OSError as error:
        raise InputError(f"{directory}: cannot be written ({error.strerror})") from error
    finally:
        for temporary, _ in written:
            temporary.unlink(missing_ok=True)

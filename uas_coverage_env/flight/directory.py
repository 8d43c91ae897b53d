"""The flight directory: plain files that hold one flight, written whole or not at all.

`reading` reads them back.
"""

import csv
import dataclasses
import io
import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from uas_coverage_env.files.output_dir import prepare_folder, write_files
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.flight.legs import Leg, legs_of
from uas_coverage_env.flight.of_log import STATES
from uas_coverage_env.flight.record import MODES, FlightRecord
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.toml_text import toml_text
from uas_coverage_env.vehicle import vehicle_names

STATE_COLUMNS = (
    *("x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps", "phi_rad", "theta_rad", "psi_rad"),
    *("wx_radps", "wy_radps", "wz_radps", "dod", "u_th_V"),
)
INPUT_COLUMNS = ("lift_N", "tau_x_Nm", "tau_y_Nm", "tau_z_Nm", "delta_thrust_N")
FLIGHT_COLUMNS = (
    *("t_s", "uas", *STATE_COLUMNS, "soc", "voltage_V", "current_A", "mode"),
    *(*INPUT_COLUMNS, "covered"),
)
MOVING_COLUMNS = ("t_s", "name", "x_m", "y_m", "z_m")
PLAN_COLUMNS = ("t_s", "uas", "n", "x_m", "y_m", "z_m")
LEG_COLUMNS = tuple(field.name for field in dataclasses.fields(Leg))
REWARD_FILE = "rewards.csv"
REWARD_COLUMNS = ("t_s", "uas")
"""Then one for each term."""
PASS_FILE = "passes.csv"
PASS_COLUMNS = ("t_s", "uas", *STATE_COLUMNS[:STATES])


def check_directory(directory: Path, *, overwrite: bool) -> None:
    """Make sure that a flight can be written there, before it is flown.

    Raises:
        InputError: It is a file, is not empty and `overwrite` is not set, or cannot be written.
    """
    if prepare_folder(directory) and not overwrite:
        raise InputError(f"{directory}: is not empty; give another folder or ask to overwrite")


def write_flight(flight: FlightRecord, directory: Path, *, overwrite: bool = False) -> Path:
    """Write all files of a flight; foreign files in the folder are left alone.

    Raises:
        InputError: See `check_directory`.
    """
    check_directory(directory, overwrite=overwrite)
    if flight.reward_terms is None:  # those of a former flight are not this one's
        (directory / REWARD_FILE).unlink(missing_ok=True)
    if flight.of_log is None:
        (directory / PASS_FILE).unlink(missing_ok=True)
    write_files(directory, flight_files(flight))
    return directory


def flight_files(flight: FlightRecord) -> dict[str, bytes]:
    """The files of a flight, name -> content; the summary last: where it is, the rest is."""
    times = [repr(time) for time in flight.time_s.tolist()]
    texts = {
        **_scenario_files(flight.scenario),
        "flight.csv": _csv(FLIGHT_COLUMNS, _flight_rows(flight, times)),
        "moving_obstacles.csv": _csv(MOVING_COLUMNS, _moving_rows(flight, times)),
        "plan.csv": _csv(PLAN_COLUMNS, _plan_rows(flight, times)),
        "legs.csv": _csv(LEG_COLUMNS, map(dataclasses.astuple, legs_of(flight))),
        **_reward_file(flight, times),
        **_pass_file(flight),
        "run.json": _json(_run(flight)),
        "summary.json": _json(summary(flight)),
    }
    return {name: text.encode() for name, text in texts.items()}


def _scenario_files(scenario: Scenario) -> dict[str, str]:
    """The scenario, and beside it its own vehicles: it stays whole wherever the folder goes."""
    data = scenario.model_dump(mode="json", by_alias=True)
    named: dict[str, str] = {}
    texts: dict[str, str] = {}
    for uas, vehicle in zip(data["uas"], scenario.vehicles, strict=True):
        path = uas["vehicle"]
        if path in vehicle_names():
            continue
        if path not in named:
            named[path] = f"vehicle_{uas['name']}.toml"
            texts[named[path]] = toml_text(vehicle.model_dump(mode="json"))
        uas["vehicle"] = named[path]
    return {**texts, "scenario.json": _json(data)}


def _flight_rows(flight: FlightRecord, times: Sequence[str]) -> Iterator[list[Any]]:
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


def _moving_rows(flight: FlightRecord, times: Sequence[str]) -> Iterator[list[Any]]:
    names = [obstacle.name for obstacle in flight.scenario.moving_obstacles]
    for time, positions_m in zip(times, flight.moving_position_m.tolist(), strict=True):
        for name, position_m in zip(names, positions_m, strict=True):
            yield [time, name, *position_m]


def _plan_rows(flight: FlightRecord, times: Sequence[str]) -> Iterator[list[Any]]:
    for step, i, n, position_m in flight.plan.tolist():
        yield [times[step], flight.names[i], n, *position_m.tolist()]


def _reward_file(flight: FlightRecord, times: Sequence[str]) -> dict[str, str]:
    """The terms of every UAS and step, at the sample before it; nothing where none were kept."""
    if flight.reward_terms is None:
        return {}
    paid, last = flight.reward_terms.tolist(), flight.last_sample
    rows = (
        [times[k], name, *paid[k][i]]
        for k in range(flight.steps)
        for i, name in enumerate(flight.names)
        if k < last[i]
    )
    return {REWARD_FILE: _csv((*REWARD_COLUMNS, *flight.reward_names), rows)}


def _pass_file(flight: FlightRecord) -> dict[str, str]:
    """What covered something, of a flight from a log; nothing of any other."""
    if flight.of_log is None:
        return {}
    rows = ([repr(one.time_s), one.uas, *one.x] for one in flight.of_log.passes)
    return {PASS_FILE: _csv(PASS_COLUMNS, rows)}


def _run(flight: FlightRecord) -> dict[str, Any]:
    """How the flight came about: what no other file says, decision by decision."""
    # in still air the file is as it was before there were disturbances
    disturbed = {"disturbances": list(flight.disturbances)} if flight.disturbances else {}
    return {
        "dynamics": flight.dynamics,
        "return_mode": flight.return_mode,
        "safety_filter": flight.safety_filter,
        **disturbed,
        **_events(flight),
        **_swaps(flight),
        "ended": flight.ended,
        "decisions": [dataclasses.asdict(decision) for decision in flight.decisions],
    }


def _events(flight: FlightRecord) -> dict[str, Any]:
    if flight.open_waypoints is None:
        return {}
    return {
        "events": [dataclasses.asdict(event) for event in flight.events],
        "open_waypoints": flight.open_waypoints,
    }


def _swaps(flight: FlightRecord) -> dict[str, Any]:
    if not flight.swaps:
        return {}
    return {"swaps": [dataclasses.asdict(swap) for swap in flight.swaps]}


def _json(data: Any) -> str:
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _csv(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    # the csv module writes floats as repr does: they read back to the last bit
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    for row in rows:
        if len(row) != len(header):
            raise ValueError(f"a row of {len(row)} values under {len(header)} headings: {header}")
        writer.writerow(row)
    return text.getvalue()

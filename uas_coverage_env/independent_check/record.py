"""A flight directory read for the independent check: plain arrays, nothing of the world's code.

Only `scenario.json`, `flight.csv`, `moving_obstacles.csv`, `plan.csv` and `summary.json` are read,
the files of the public contract, with the standard library and NumPy; besides, the vehicles' files,
in the directory or shipped, for their limits, and from `run.json` which dynamics were flown.
"""

from __future__ import annotations

import csv
import json
import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_SHIPPED = Path(__file__).parents[1] / "vehicle"

FLYING_MODES = ("covering", "transit", "return")
NUMBERS = (
    *("x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps", "phi_rad", "theta_rad", "dod", "soc"),
    *("wx_radps", "wy_radps", "wz_radps"),
    *("voltage_V", "current_A", "lift_N", "tau_x_Nm", "tau_y_Nm", "tau_z_Nm", "covered"),
)


class BadFlightError(ValueError):
    """The directory is no flight, or its files do not fit together; one line."""


class NotJudgedError(BadFlightError):
    """Something happens in the flight that is not judged here; one line."""


@dataclass(frozen=True)
class Track:
    """One UAS's rows of `flight.csv`, from t = 0 to its last.

    Attributes:
        entry: The UAS in `scenario.json`.
        vehicle: Its vehicle's file.
        columns: Column name -> (n,) values, those of `NUMBERS`.
        modes: Mode of each row.
        swaps: (landed, took off) sample numbers of each swap of battery packs, in order.
    """

    entry: dict[str, Any]
    vehicle: dict[str, Any]
    columns: dict[str, FloatArray]
    modes: tuple[str, ...]
    swaps: tuple[tuple[int, int], ...] = ()

    @property
    def rests(self) -> NDArray[np.bool_]:
        """(n,) whether it stands on the ground in the step from a sample on, to fly again."""
        rests = np.zeros(len(self.modes), np.bool_)
        for landed, took_off in self.swaps:
            rests[landed:took_off] = True
        return rests

    @property
    def name(self) -> str:
        """Name in the scenario."""
        return self.entry["name"]

    @property
    def landings(self) -> list[int]:
        """The samples at which it has landed."""
        return [*(landed for landed, _ in self.swaps), *([-1] if self.end == "landed" else [])]

    @property
    def home_m(self) -> list[float]:
        """(3,) where it lands [m]."""
        return self.entry.get("land_m", self.entry["start_m"])

    @property
    def position_m(self) -> FloatArray:
        """(n, 3) [m]."""
        return self._stack("x_m", "y_m", "z_m")

    @property
    def velocity_mps(self) -> FloatArray:
        """(n, 3) [m/s]."""
        return self._stack("vx_mps", "vy_mps", "vz_mps")

    @property
    def steps(self) -> int:
        """Steps flown: one less than rows."""
        return len(self.modes) - 1

    @property
    def end(self) -> str:
        """The last mode: landed, lost, or one in which it still flies."""
        return self.modes[-1]

    def _stack(self, *names: str) -> FloatArray:
        return np.column_stack([self.columns[name] for name in names])


@dataclass(frozen=True)
class FlightRecord:
    """What the five files hold.

    Attributes:
        scenario: `scenario.json`.
        summary: `summary.json`.
        tracks: One per UAS, in the order of the scenario.
        moving_m: (T, M, 3) [m] centres of the moving obstacles at every sample.
        plan: (step, UAS) -> (n, 3) [m] positions predicted at that step.
        dynamics: `lpv` or `nonlinear`.
        disturbed: Whether `run.json` names disturbances.
    """

    scenario: dict[str, Any]
    summary: dict[str, Any]
    tracks: tuple[Track, ...]
    moving_m: FloatArray
    plan: dict[tuple[int, str], FloatArray]
    dynamics: str
    disturbed: bool

    @property
    def dt_s(self) -> float:
        """Length of a step [s]."""
        return self.scenario["dt_s"]

    @property
    def steps(self) -> int:
        """Steps until the last UAS is home or lost, or the flight ends."""
        return max(track.steps for track in self.tracks)


def read_record(directory: Path) -> FlightRecord:
    """Read a flight directory.

    Raises:
        BadFlightError: A file is missing, damaged, or does not fit the others.
    """
    name = "scenario.json"
    try:
        scenario = json.loads((directory / name).read_text(encoding="utf-8"))
        name = "summary.json"
        summary = json.loads((directory / name).read_text(encoding="utf-8"))
        name = "run.json"
        run = json.loads((directory / name).read_text(encoding="utf-8"))
        dynamics = run["dynamics"]
        disturbed = bool(run.get("disturbances")) or "sensing" in scenario
        vehicles = []
        for uas in scenario["uas"]:
            # shipped ones by their names, a user's own by the file beside the scenario
            name = uas["vehicle"]
            path = directory / name if name.endswith(".toml") else _SHIPPED / f"{name}.toml"
            vehicles.append(tomllib.loads(path.read_text(encoding="utf-8")))
        name = "flight.csv"
        tracks = _tracks(_rows(directory / name), scenario, vehicles, summary.get("swaps", ()))
        steps = max(track.steps for track in tracks)
        name = "moving_obstacles.csv"
        moving_m = _moving(_rows(directory / name), scenario, steps)
        name = "plan.csv"
        plan = _plan(_rows(directory / name), scenario)
    except OSError as error:
        raise BadFlightError(f"{directory / name}: cannot be read ({error.strerror})") from error
    except (ValueError, KeyError, TypeError, IndexError) as error:
        reason = " ".join(str(error).split())
        kind = type(error).__name__
        raise BadFlightError(f"{directory / name}: was damaged ({kind}: {reason})") from error
    if scenario.get("events"):
        raise NotJudgedError(f"{directory}: events happen in it, which are not judged here")
    for track in tracks:
        drawn = np.flatnonzero((track.columns["current_A"] > 0.0) | track.rests)
        if len(drawn) and len(drawn) <= drawn[-1] - drawn[0]:
            raise NotJudgedError(
                f"{directory}: {track.name} lands and takes off again, which is not judged here"
            )
    return FlightRecord(scenario, summary, tracks, moving_m, plan, dynamics, disturbed)


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file, strict=True))


def _number(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text!r} is not finite")
    return value


def _step(row: dict[str, str], dt_s: float) -> int:
    time_s = _number(row["t_s"])
    step = round(time_s / dt_s)
    if step < 0 or abs(step * dt_s - time_s) > 1e-6:
        raise ValueError(f"t_s = {time_s} is no sample of dt_s = {dt_s}")
    return step


def _tracks(
    rows: list[dict[str, str]],
    scenario: dict[str, Any],
    vehicles: list[dict[str, Any]],
    swaps: Sequence[dict[str, Any]],
) -> tuple[Track, ...]:
    of_uas: dict[str, list[dict[str, str]]] = {uas["name"]: [] for uas in scenario["uas"]}
    for row in rows:
        if _step(row, scenario["dt_s"]) != len(of_uas[row["uas"]]):
            raise ValueError(f"{row['uas']} has no row, or two, before t_s = {row['t_s']}")
        of_uas[row["uas"]].append(row)
    tracks = []
    for entry, vehicle in zip(scenario["uas"], vehicles, strict=True):
        mine = of_uas[entry["name"]]
        if not mine:
            raise ValueError(f"no row of {entry['name']}")
        columns = {name: np.array([_number(row[name]) for row in mine]) for name in NUMBERS}
        modes = tuple(row["mode"] for row in mine)
        if any(mode not in FLYING_MODES for mode in modes[:-1]):
            raise ValueError(f"{entry['name']} has rows after it has landed or is lost")
        if modes[-1] not in (*FLYING_MODES, "landed", "lost"):
            raise ValueError(f"{entry['name']} has the unknown mode {modes[-1]!r}")
        rests = tuple(
            (round(swap["landed_s"] / scenario["dt_s"]), round(swap["t_s"] / scenario["dt_s"]))
            for swap in swaps
            if swap["uas"] == entry["name"]
        )
        tracks.append(Track(entry, vehicle, columns, modes, rests))
    return tuple(tracks)


def _moving(rows: list[dict[str, str]], scenario: dict[str, Any], steps: int) -> FloatArray:
    index = {obstacle["name"]: m for m, obstacle in enumerate(scenario["moving_obstacles"])}
    moving_m = np.full((steps + 1, len(index), 3), np.nan)
    for row in rows:
        at = _step(row, scenario["dt_s"]), index[row["name"]]
        moving_m[at] = [_number(row[axis]) for axis in ("x_m", "y_m", "z_m")]
    if np.isnan(moving_m).any():
        raise ValueError("a moving obstacle has no position at some sample")
    return moving_m


def _plan(
    rows: list[dict[str, str]], scenario: dict[str, Any]
) -> dict[tuple[int, str], FloatArray]:
    names = {uas["name"] for uas in scenario["uas"]}
    points: dict[tuple[int, str], list[list[float]]] = {}
    for row in rows:
        if row["uas"] not in names:
            raise ValueError(f"unknown UAS {row['uas']!r}")
        path = points.setdefault((_step(row, scenario["dt_s"]), row["uas"]), [])
        if int(row["n"]) != len(path):
            raise ValueError(f"the plan of {row['uas']} at {row['t_s']} s lacks n = {len(path)}")
        path.append([_number(row[axis]) for axis in ("x_m", "y_m", "z_m")])
    return {key: np.array(path) for key, path in points.items()}

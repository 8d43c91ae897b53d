"""A flight directory read back: whoever hands one over, nothing in it is believed unchecked."""

import csv
import dataclasses
import io
import json
import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, JsonValue, model_validator

from uas_coverage_env.files.plain_files import read_text
from uas_coverage_env.files.strict_toml import InputError, StrictModel, parse
from uas_coverage_env.flight.directory import (
    FLIGHT_COLUMNS,
    INPUT_COLUMNS,
    MOVING_COLUMNS,
    PASS_COLUMNS,
    PASS_FILE,
    PLAN_COLUMNS,
    REWARD_COLUMNS,
    REWARD_FILE,
    STATE_COLUMNS,
)
from uas_coverage_env.flight.of_log import Estimate, OfLog, Pass, Unknown
from uas_coverage_env.flight.record import (
    LIMIT,
    MODES,
    PLAN_DTYPE,
    DecisionRecord,
    EventRecord,
    LeftOpen,
    Swap,
    Violation,
    Why,
)
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation import Dynamics
from uas_coverage_env.vehicle import N_INPUTS, N_STATES

T = TypeVar("T")
M = TypeVar("M", bound=BaseModel)

Count = Annotated[int, Field(ge=0)]
Seconds = Annotated[float, Field(ge=0.0)]

_LONGEST_PLAN = 1_000_000
_LONGEST_SHOWN = 40


class _Violation(StrictModel):
    time_s: Annotated[float, Field(ge=0.0, alias="t_s")]
    uas: str
    kind: str
    partner: Annotated[str | None, Field(alias="with")]
    value: float | None = None
    limit: float | None = None
    samples: Count | None = None

    @model_validator(mode="after")
    def _limit_is_whole(self) -> Self:
        told = (self.partner, self.value, self.limit, self.samples)
        if self.kind == LIMIT and None in told:
            raise ValueError("of a limit it holds with, value, limit and samples")
        return self


class _LeftOpen(StrictModel):
    model_config = ConfigDict(strict=False)  # reasons are read from their words

    waypoint: Count
    why: Why
    detail: str


class _Estimate(StrictModel):
    uas: str
    what: str
    how: str


class _Unknown(StrictModel):
    uas: str
    from_s: float
    to_s: float
    why: str


class _Planner(StrictModel):
    name: str
    options: dict[str, JsonValue]


class _Summary(StrictModel):
    """What the summary alone holds; the rest of it follows from the other files."""

    model_config = ConfigDict(extra="ignore")

    violations: tuple[_Violation, ...]
    left_open: tuple[_LeftOpen, ...] = ()
    estimated: tuple[_Estimate, ...] | None = None
    not_known: tuple[_Unknown, ...] = ()
    breaches: Count
    height_breaches: Count = 0
    min_separation_m: float | None
    min_obstacle_clearance_m: float | None
    wall_time_s: Seconds
    versions: dict[str, str]
    seed: int
    planner: _Planner


class _Decision(StrictModel):
    duration_s: Seconds
    fallback: bool = False
    mip_gap: float | None = None
    filtered: Count = 0
    reason: str | None = None


class _Event(StrictModel):
    time_s: Seconds
    kind: str
    uas: str | None
    event: Count


class _Swap(StrictModel):
    uas: str
    landed_s: Seconds
    time_s: Seconds


class _Run(StrictModel):
    dynamics: Dynamics
    return_mode: bool
    safety_filter: bool
    disturbances: tuple[str, ...] = ()
    events: tuple[_Event, ...] = ()
    open_waypoints: Count | None = None
    swaps: tuple[_Swap, ...] = ()
    ended: Literal["complete", "steps", "stopped"]
    decisions: tuple[_Decision, ...]


def read_flight(directory: Path) -> dict[str, Any]:
    """Read the fields of a `Flight` from its directory.

    Raises:
        InputError: A file is missing or was damaged.
    """
    # an own vehicle's file is named relative to the folder
    scenario = _parsed(directory / "scenario.json", Scenario, context={"folder": directory})
    samples = _read(directory / "flight.csv", lambda text: _flight_arrays(text, scenario))
    steps = len(samples["x"]) - 1
    summary = _summary_fields(directory / "summary.json", scenario)
    return {
        "scenario": scenario,
        **summary,
        **_of_log(directory, summary.pop("of_log"), scenario),
        **_run_fields(directory / "run.json", scenario, steps),
        **samples,
        "moving_position_m": _read(
            directory / "moving_obstacles.csv", lambda text: _moving_array(text, scenario, steps)
        ),
        "plan": _plan(directory / "plan.csv", scenario),
        **_reward_fields(directory / REWARD_FILE, scenario, steps),
    }


def _flight_arrays(text: str, scenario: Scenario) -> dict[str, Any]:
    rows = _rows(text, FLIGHT_COLUMNS)
    if not rows:
        raise ValueError("it holds no sample")
    index = {uas.name: i for i, uas in enumerate(scenario.uas)}
    modes = {name: number for number, name in enumerate(MODES)}
    shape = (1 + max(_each(rows, lambda row: _step(row[0], scenario))), len(index))
    if shape[0] > len(rows):
        raise ValueError(f"it holds {len(rows)} rows, too few for {shape[0]} samples")
    x, u = np.zeros((*shape, N_STATES)), np.zeros((*shape, N_INPUTS))
    voltage_V, current_A = np.zeros(shape), np.zeros(shape)
    mode, covered = np.zeros(shape, np.int8), np.zeros(shape[0], np.int64)
    last = np.zeros(len(index), np.int64)
    found = np.zeros(shape, np.bool_)
    most_covered = sum(w.visits for w in scenario.waypoints) + len(scenario.events)

    def put(row: list[str]) -> None:
        told = dict(zip(FLIGHT_COLUMNS, row, strict=True))
        k, i = _step(told["t_s"], scenario), _chosen("uas", told["uas"], index)
        x[k, i] = [_number(told[name]) for name in STATE_COLUMNS]
        _number(told["soc"])  # it follows from the depth of discharge
        voltage_V[k, i], current_A[k, i] = _number(told["voltage_V"]), _number(told["current_A"])
        mode[k, i] = _chosen("mode", told["mode"], modes)
        u[k, i] = [_number(told[name]) for name in INPUT_COLUMNS]
        covered[k] = _whole("covered", told["covered"], most_covered)
        last[i] = k
        _note(found, k, i, told["uas"])

    _each(rows, put)
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


def _moving_array(text: str, scenario: Scenario, steps: int) -> NDArray[np.float64]:
    names = [obstacle.name for obstacle in scenario.moving_obstacles]
    rows = _rows(text, MOVING_COLUMNS)
    if len(rows) != (steps + 1) * len(names):
        raise ValueError(
            f"it holds {len(rows)} rows; {steps + 1} samples of {len(names)} moving obstacles "
            f"are {(steps + 1) * len(names)}"
        )
    for number, row in enumerate(rows):
        k, i = divmod(number, len(names))
        if row[1] != names[i] or _step(row[0], scenario) != k:
            raise ValueError(
                f"line {number + 2}: is of {_short(row[1])} at {_short(row[0])} s; {names[i]!r} "
                f"at {k * scenario.dt_s:g} s comes there"
            )
    positions_m = _each(rows, lambda row: [_number(value) for value in row[2:]])
    return np.array(positions_m, dtype=np.float64).reshape(steps + 1, len(names), 3)


def _plan(path: Path, scenario: Scenario) -> NDArray[np.void]:
    """Empty where there is no such file: a planner that predicts nothing has none."""
    if not path.exists():
        return np.empty(0, dtype=PLAN_DTYPE)
    return _read(path, lambda text: _plan_array(text, scenario))


def _plan_array(text: str, scenario: Scenario) -> NDArray[np.void]:
    index = {uas.name: i for i, uas in enumerate(scenario.uas)}

    def point(row: list[str]) -> tuple[Any, ...]:
        time_s, uas, n, *position_m = row
        return (
            _step(time_s, scenario),
            _chosen("uas", uas, index),
            _whole("n", n, _LONGEST_PLAN),
            tuple(_number(value) for value in position_m),
        )

    return np.array(_each(_rows(text, PLAN_COLUMNS), point), dtype=PLAN_DTYPE)


def _reward_fields(path: Path, scenario: Scenario, steps: int) -> dict[str, Any]:
    """Nothing where there is no such file: a flight from before rewards were kept."""
    if not path.exists():
        return {}
    return _read(path, lambda text: _reward_arrays(text, scenario, steps))


def _reward_arrays(text: str, scenario: Scenario, steps: int) -> dict[str, Any]:
    header = next(csv.reader(io.StringIO(text)), [])
    first = len(REWARD_COLUMNS)
    names = tuple(header[first:])
    if len(set(names)) < len(names):
        raise ValueError("it names a term of the reward twice")
    rows = _rows(text, (*REWARD_COLUMNS, *names))
    index = {uas.name: i for i, uas in enumerate(scenario.uas)}
    terms = np.zeros((steps, len(index), len(names)))
    found = np.zeros(terms.shape[:2], np.bool_)

    def put(row: list[str]) -> None:
        k, i = _step(row[0], scenario), _chosen("uas", row[1], index)
        if k >= steps:
            raise ValueError(f"{_short(row[0])} s is not before the end of the flight")
        terms[k, i] = [_number(value) for value in row[first:]]
        _note(found, k, i, row[1])

    _each(rows, put)
    return {"reward_terms": terms, "reward_names": names}


def _of_log(directory: Path, of_log: OfLog | None, scenario: Scenario) -> dict[str, Any]:
    """What is estimated and not known, with what covered something; nothing of other flights."""
    if of_log is None:
        return {}
    passes = _read(directory / PASS_FILE, lambda text: _passes(text, scenario))
    return {"of_log": dataclasses.replace(of_log, passes=passes)}


def _passes(text: str, scenario: Scenario) -> tuple[Pass, ...]:
    index = {uas.name: i for i, uas in enumerate(scenario.uas)}

    def read(row: list[str]) -> Pass:
        time_s, uas, *x = row
        _step(time_s, scenario)
        _chosen("uas", uas, index)
        return Pass(_number(time_s), uas, tuple(_number(value) for value in x))

    found = _each(_rows(text, PASS_COLUMNS), read)
    if any(one.time_s > other.time_s for one, other in pairwise(found)):
        raise ValueError("its times are not in order")
    return tuple(found)


def _run_fields(path: Path, scenario: Scenario, steps: int) -> dict[str, Any]:
    run = _parsed(path, _Run)
    if len(run.decisions) != steps:
        raise InputError(
            f"{path}: was damaged: it holds {len(run.decisions)} decisions for {steps} steps"
        )
    decisions = tuple(DecisionRecord(**decision.model_dump()) for decision in run.decisions)
    events = tuple(_event(path, n, event, scenario, steps) for n, event in enumerate(run.events))
    swaps = tuple(_swap(path, n, swap, scenario) for n, swap in enumerate(run.swaps))
    return {**dict(run), "decisions": decisions, "events": events, "swaps": swaps}


def _event(path: Path, number: int, event: _Event, scenario: Scenario, steps: int) -> EventRecord:
    kinds = [table.kind for table in scenario.events]
    if event.event >= len(kinds):
        mistake = f"event is {event.event}; the scenario has {len(kinds)}, from 0 on"
    elif event.kind != kinds[event.event]:
        mistake = f"kind is {_short(event.kind)}; event {event.event} is {kinds[event.event]!r}"
    elif event.time_s > steps * scenario.dt_s + 1e-6:
        mistake = f"time_s is {event.time_s:g}; the flight ends at {steps * scenario.dt_s:g}"
    else:
        return EventRecord(**event.model_dump())
    raise InputError(f"{path}: was damaged: events[{number}]: {mistake}")


def _swap(path: Path, number: int, swap: _Swap, scenario: Scenario) -> Swap:
    try:
        _chosen("uas", swap.uas, {uas.name: i for i, uas in enumerate(scenario.uas)})
        if _step(swap.landed_s, scenario) >= _step(swap.time_s, scenario):
            raise ValueError("it flies on before it has landed")
    except ValueError as error:
        raise InputError(f"{path}: was damaged: swaps[{number}]: {error}") from error
    return Swap(**swap.model_dump())


def _summary_fields(path: Path, scenario: Scenario) -> dict[str, Any]:
    summary = _parsed(path, _Summary)
    names = {uas.name: i for i, uas in enumerate(scenario.uas)}
    for number, violation in enumerate(summary.violations):
        try:
            _chosen("uas", violation.uas, names)
            _step(violation.time_s, scenario)
        except ValueError as error:
            raise InputError(f"{path}: was damaged: violations[{number}]: {error}") from error
    for number, entry in enumerate((*(summary.estimated or ()), *summary.not_known)):
        if entry.uas not in names:
            raise InputError(
                f"{path}: was damaged: entry {number} of estimated and not_known is of "
                f"{_short(entry.uas)}; there are {', '.join(names)}"
            )
    fields = dict(summary)
    estimated, unknown = fields.pop("estimated"), fields.pop("not_known")
    of_log = None
    if estimated is not None:
        of_log = OfLog(
            tuple(Estimate(**dict(one)) for one in estimated),
            tuple(Unknown(**dict(one)) for one in unknown),
        )
    return {
        **fields,
        "of_log": of_log,
        "violations": tuple(Violation(**dict(violation)) for violation in summary.violations),
        "left_open": tuple(LeftOpen(**dict(one)) for one in summary.left_open),
        "planner": summary.planner.name,
        "planner_options": dict(summary.planner.options),
    }


def _parsed(path: Path, model: type[M], *, context: Any = None) -> M:
    return parse(_read(path, _object), model, str(path), context=context)


def _object(text: str) -> dict[str, Any]:
    data = json.loads(text)
    if not isinstance(data, dict):
        raise ValueError("it should hold one object, { ... }")
    return data


def _rows(text: str, header: Sequence[str]) -> list[list[str]]:
    rows = list(csv.reader(io.StringIO(text)))
    if not rows or tuple(rows[0]) != tuple(header):
        raise ValueError(f"its first line should be {','.join(header)}")
    for line, row in enumerate(rows[1:], start=2):
        if len(row) != len(header):
            raise ValueError(f"line {line}: holds {len(row)} values, not {len(header)}")
    return rows[1:]


def _note(found: NDArray[np.bool_], sample: int, i: int, uas: str) -> None:
    """Note that the row of a sample has come, which it may once: of two, one would be lost."""
    if found[sample, i]:
        raise ValueError(f"sample {sample} of {uas} is there twice")
    found[sample, i] = True


def _each(rows: Sequence[list[str]], reader: Callable[[list[str]], T]) -> list[T]:
    """What a reader makes of each row; a mistake names the line."""
    made: list[T] = []
    for line, row in enumerate(rows, start=2):
        try:
            made.append(reader(row))
        except ValueError as error:
            raise ValueError(f"line {line}: {error}") from error
    return made


def _step(time_s: str | float, scenario: Scenario) -> int:
    number = _number(time_s)
    if not 0.0 <= number <= scenario.dt_s * (scenario.max_steps + 0.5):
        raise ValueError(
            f"{_short(time_s)} s is not within the {scenario.max_steps} steps of the mission"
        )
    return round(number / scenario.dt_s)


def _number(text: str | float) -> float:
    try:
        number = float(text)
    except ValueError:
        raise ValueError(f"{_short(text)} is no number") from None
    if not math.isfinite(number):
        raise ValueError(f"{_short(text)} is not finite")
    return number


def _whole(column: str, text: str, most: int) -> int:
    number = _number(text)
    if not (number.is_integer() and 0 <= number <= most):
        raise ValueError(f"{column} is {_short(text)}, not a whole number from 0 to {most}")
    return int(number)


def _chosen(column: str, text: str, known: Mapping[str, int]) -> int:
    if text not in known:
        raise ValueError(f"{column} is {_short(text)}; there are {', '.join(known)}")
    return known[text]


def _short(value: object) -> str:
    return repr(value)[:_LONGEST_SHOWN]


def _read(path: Path, reader: Callable[[str], T]) -> T:
    try:
        return reader(read_text(path))
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); is it a flight?") from error
    except (ValueError, RecursionError, csv.Error) as error:
        raise InputError(f"{path}: was damaged: {' '.join(str(error).split())}") from error

"""A flight directory read back: whoever hands one over, nothing in it is believed unchecked."""

import csv
import io
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, JsonValue, model_validator

from uas_coverage_env.entities.codes import DynamicsName
from uas_coverage_env.files.strict_toml import InputError, StrictModel
from uas_coverage_env.flight.checked import (
    chosen,
    each,
    note,
    number_of,
    parsed,
    read,
    rows_of,
    short,
    step_of,
    whole_number,
)
from uas_coverage_env.flight.directory import (
    FLIGHT_COLUMNS,
    INPUT_COLUMNS,
    MOVING_COLUMNS,
    PLAN_COLUMNS,
    REWARD_COLUMNS,
    REWARD_FILE,
    STATE_COLUMNS,
)
from uas_coverage_env.flight.of_log_reading import EstimateEntry, UnknownEntry, read_of_log
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
from uas_coverage_env.vehicle.layout import N_INPUTS, N_STATES

Count = Annotated[int, Field(ge=0)]
Seconds = Annotated[float, Field(ge=0.0)]

_LONGEST_PLAN = 1_000_000


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


class _Planner(StrictModel):
    name: str
    options: dict[str, JsonValue]


class _Summary(StrictModel):
    """What the summary alone holds; the rest of it follows from the other files."""

    model_config = ConfigDict(extra="ignore")

    violations: tuple[_Violation, ...]
    left_open: tuple[_LeftOpen, ...] = ()
    estimated: tuple[EstimateEntry, ...] | None = None
    not_known: tuple[UnknownEntry, ...] = ()
    breaches: Count
    height_breaches: Count = 0
    reserve_breaches: Count = 0
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
    processor_s: Seconds | None = None
    flown_by: tuple[str, ...] = ()


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
    dynamics: DynamicsName
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
    scenario = parsed(directory / "scenario.json", Scenario, context={"folder": directory})
    samples = read(directory / "flight.csv", lambda text: _flight_arrays(text, scenario))
    steps = len(samples["x"]) - 1
    return {
        "scenario": scenario,
        **_summary_fields(directory / "summary.json", scenario),
        **_run_fields(directory / "run.json", scenario, steps),
        **samples,
        "moving_position_m": read(
            directory / "moving_obstacles.csv", lambda text: _moving_array(text, scenario, steps)
        ),
        "plan": _plan(directory / "plan.csv", scenario),
        **_reward_fields(directory / REWARD_FILE, scenario, steps),
    }


def _flight_arrays(text: str, scenario: Scenario) -> dict[str, Any]:
    rows = rows_of(text, FLIGHT_COLUMNS)
    if not rows:
        raise ValueError("it holds no sample")
    index = {uas.name: i for i, uas in enumerate(scenario.uas)}
    modes = {name: number for number, name in enumerate(MODES)}
    shape = (1 + max(each(rows, lambda row: step_of(row[0], scenario))), len(index))
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
        k, i = step_of(told["t_s"], scenario), chosen("uas", told["uas"], index)
        x[k, i] = [number_of(told[name]) for name in STATE_COLUMNS]
        number_of(told["soc"])  # it follows from the depth of discharge
        voltage_V[k, i], current_A[k, i] = (
            number_of(told["voltage_V"]),
            number_of(told["current_A"]),
        )
        mode[k, i] = chosen("mode", told["mode"], modes)
        u[k, i] = [number_of(told[name]) for name in INPUT_COLUMNS]
        covered[k] = whole_number("covered", told["covered"], most_covered)
        last[i] = k
        note(found, k, i, told["uas"])

    each(rows, put)
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
    rows = rows_of(text, MOVING_COLUMNS)
    if len(rows) != (steps + 1) * len(names):
        raise ValueError(
            f"it holds {len(rows)} rows; {steps + 1} samples of {len(names)} moving obstacles "
            f"are {(steps + 1) * len(names)}"
        )
    for number, row in enumerate(rows):
        k, i = divmod(number, len(names))
        if row[1] != names[i] or step_of(row[0], scenario) != k:
            raise ValueError(
                f"line {number + 2}: is of {short(row[1])} at {short(row[0])} s; {names[i]!r} "
                f"at {k * scenario.dt_s:g} s comes there"
            )
    positions_m = each(rows, lambda row: [number_of(value) for value in row[2:]])
    return np.array(positions_m, dtype=np.float64).reshape(steps + 1, len(names), 3)


def _plan(path: Path, scenario: Scenario) -> NDArray[np.void]:
    """Empty where there is no such file: a planner that predicts nothing has none."""
    if not path.exists():
        return np.empty(0, dtype=PLAN_DTYPE)
    return read(path, lambda text: _plan_array(text, scenario))


def _plan_array(text: str, scenario: Scenario) -> NDArray[np.void]:
    index = {uas.name: i for i, uas in enumerate(scenario.uas)}

    def point(row: list[str]) -> tuple[Any, ...]:
        time_s, uas, n, *position_m = row
        return (
            step_of(time_s, scenario),
            chosen("uas", uas, index),
            whole_number("n", n, _LONGEST_PLAN),
            tuple(number_of(value) for value in position_m),
        )

    return np.array(each(rows_of(text, PLAN_COLUMNS), point), dtype=PLAN_DTYPE)


def _reward_fields(path: Path, scenario: Scenario, steps: int) -> dict[str, Any]:
    """Nothing where there is no such file: a flight from before rewards were kept."""
    if not path.exists():
        return {}
    return read(path, lambda text: _reward_arrays(text, scenario, steps))


def _reward_arrays(text: str, scenario: Scenario, steps: int) -> dict[str, Any]:
    header = next(csv.reader(io.StringIO(text)), [])
    first = len(REWARD_COLUMNS)
    names = tuple(header[first:])
    if len(set(names)) < len(names):
        raise ValueError("it names a term of the reward twice")
    rows = rows_of(text, (*REWARD_COLUMNS, *names))
    index = {uas.name: i for i, uas in enumerate(scenario.uas)}
    terms = np.zeros((steps, len(index), len(names)))
    found = np.zeros(terms.shape[:2], np.bool_)

    def put(row: list[str]) -> None:
        k, i = step_of(row[0], scenario), chosen("uas", row[1], index)
        if k >= steps:
            raise ValueError(f"{short(row[0])} s is not before the end of the flight")
        terms[k, i] = [number_of(value) for value in row[first:]]
        note(found, k, i, row[1])

    each(rows, put)
    return {"reward_terms": terms, "reward_names": names}


def _run_fields(path: Path, scenario: Scenario, steps: int) -> dict[str, Any]:
    run = parsed(path, _Run)
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
        mistake = f"kind is {short(event.kind)}; event {event.event} is {kinds[event.event]!r}"
    elif event.time_s > steps * scenario.dt_s + 1e-6:
        mistake = f"time_s is {event.time_s:g}; the flight ends at {steps * scenario.dt_s:g}"
    else:
        return EventRecord(**event.model_dump())
    raise InputError(f"{path}: was damaged: events[{number}]: {mistake}")


def _swap(path: Path, number: int, swap: _Swap, scenario: Scenario) -> Swap:
    try:
        chosen("uas", swap.uas, {uas.name: i for i, uas in enumerate(scenario.uas)})
        if step_of(swap.landed_s, scenario) >= step_of(swap.time_s, scenario):
            raise ValueError("it flies on before it has landed")
    except ValueError as error:
        raise InputError(f"{path}: was damaged: swaps[{number}]: {error}") from error
    return Swap(**swap.model_dump())


def _summary_fields(path: Path, scenario: Scenario) -> dict[str, Any]:
    summary = parsed(path, _Summary)
    names = {uas.name: i for i, uas in enumerate(scenario.uas)}
    for number, violation in enumerate(summary.violations):
        try:
            chosen("uas", violation.uas, names)
            step_of(violation.time_s, scenario)
        except ValueError as error:
            raise InputError(f"{path}: was damaged: violations[{number}]: {error}") from error
    fields = dict(summary)
    estimated, unknown = fields.pop("estimated"), fields.pop("not_known")
    return {
        **fields,
        "of_log": None if estimated is None else read_of_log(path, estimated, unknown, scenario),
        "violations": tuple(Violation(**dict(violation)) for violation in summary.violations),
        "left_open": tuple(LeftOpen(**dict(one)) for one in summary.left_open),
        "planner": summary.planner.name,
        "planner_options": dict(summary.planner.options),
    }

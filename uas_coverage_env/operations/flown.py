"""A flight from logs: put to the samples of its plan, and judged by the rules of the world."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.log import FlightLog
from uas_coverage_env.flight.rollout import recorded_versions
from uas_coverage_env.operations.corners import distances_m
from uas_coverage_env.operations.frame import LocalFrame
from uas_coverage_env.operations.logs import Logged
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation.flown import FlownWorld
from uas_coverage_env.vehicle import (
    DOD,
    N_STATES,
    PHI,
    VX,
    VehicleParams,
    dod_per_s,
    tilts_and_turn,
)
from uas_coverage_env.vehicle.battery import open_circuit_voltage

PLANNER = "log"
"""Name of the planner of what was flown elsewhere."""

AT_HOME_M = 5.0
"""Of its start, horizontally, a UAS on the ground is at home: satellite navigation is no better."""

_LONGEST_GAP_S = 5.0
_MOST_STEPS = 100_000
_LIFT_M = 0.5

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Flown:
    """A flight that was flown.

    Attributes:
        flight: As the world judges it.
        off_path_m: UAS -> (N,) distance of each of its samples in the air from the planned path.
        notes: What the logs do not say, and was assumed.
    """

    flight: Flight
    off_path_m: Mapping[str, FloatArray]
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Track:
    """One UAS on the samples of the flight.

    Attributes:
        x: (T, 14).
        resting: (T,) whether it stands at home for good.
        voltage_V: (T,).
        current_A: (T,).
    """

    x: FloatArray
    resting: NDArray[np.bool_]
    voltage_V: FloatArray
    current_A: FloatArray


def flown_flight(plan: Flight, logs: Mapping[str, Logged], frame: LocalFrame) -> Flown:
    """The flight of some logs.

    Args:
        plan: The flight whose files were flown.
        logs: UAS -> what was logged; one without a log stayed at its start.
        frame: Where on the Earth it was.

    Raises:
        InputError: The logs are of another place, or no flight of the plan.
    """
    notes: list[str] = []
    places_m = {
        name: frame.to_ned(log.latitude_deg, log.longitude_deg, log.height_m)
        for name, log in logs.items()
    }
    for name, places in places_m.items():
        _check_place(plan.scenario, name, places)
    times_s = _samples_s(plan.scenario.dt_s, logs, places_m)
    scenario, dropped = _scenario(plan.scenario, len(times_s) - 1)
    notes += dropped
    tracks = []
    for i, uas in enumerate(scenario.uas):
        log = logs.get(uas.name)
        if log is None:
            notes.append(f"{uas.name} has no log: it is taken to have stayed at its start")
            tracks.append(_grounded(scenario, i, len(times_s)))
        else:
            notes += [f"{uas.name}: {note}" for note in _gaps(log)]
            track, said = _track(scenario, i, log, places_m[uas.name], times_s)
            notes += [f"{uas.name}: {note}" for note in said]
            tracks.append(track)
    flight = _judged(scenario, tracks)
    for i, (uas, track) in enumerate(zip(scenario.uas, tracks, strict=True)):
        landed = int(flight.last_sample[i])
        away_m = np.linalg.norm(track.x[landed:, :2] - uas.start_m[:2], axis=1)
        if (away_m > AT_HOME_M).any():
            notes.append(
                f"{uas.name}: its log flies on after the landing at {landed * scenario.dt_s:g} s; "
                f"only the sortie until then is judged"
            )
    off_path_m = {
        uas.name: _off_path_m(plan, flight, i)
        for i, uas in enumerate(scenario.uas)
        if uas.name in logs
    }
    return Flown(flight, off_path_m, tuple(notes))


def _check_place(scenario: Scenario, name: str, places_m: FloatArray) -> None:
    corners_m = scenario.fence.vertices_m
    size_m = float(np.linalg.norm(np.ptp(corners_m, axis=0)))
    away_m = np.linalg.norm(places_m - corners_m.mean(axis=0), axis=1).min()
    if away_m > size_m:
        raise InputError(
            f"the log of {name} is never nearer than {away_m / 1e3:.1f} km to the mission; give "
            f"the log of this place, or the right --place"
        )


def _samples_s(
    dt_s: float, logs: Mapping[str, Logged], places_m: Mapping[str, FloatArray]
) -> FloatArray:
    """(T,) times of the samples on the clock of the logs: from the first that takes off."""
    begins, ends = [], []
    for name, log in logs.items():
        up = np.flatnonzero(-places_m[name][:, 2] > _LIFT_M)
        if len(up):
            begins.append(log.time_s[max(up[0] - 1, 0)])
            ends.append(log.time_s[min(up[-1] + 1, len(log.time_s) - 1)])
    if not begins:
        raise InputError(f"no log is higher than {_LIFT_M:g} m: it is of no flight")
    steps = math.ceil((max(ends) - min(begins)) / dt_s) + 1
    if steps > _MOST_STEPS:
        raise InputError(
            f"the logs last {max(ends) - min(begins):.0f} s, more than {_MOST_STEPS} steps; give "
            f"logs of one flight on one clock"
        )
    return min(begins) + dt_s * np.arange(steps + 1)


def _scenario(scenario: Scenario, steps: int) -> tuple[Scenario, list[str]]:
    """The scenario as a log can be judged by it, and what it is without."""
    dropped = [
        words
        for words, there in (
            ("events", scenario.events),
            ("moving obstacles", scenario.moving_obstacles),
            ("errors of sensors", scenario.sensing),
        )
        if there
    ]
    changes = {
        "max_steps": max(scenario.max_steps, steps),
        "events": (),
        "moving_obstacles": (),
        "sensing": None,
    }
    notes = [f"judged without the scenario's {', '.join(dropped)}: no log tells of them"]
    return scenario.model_copy(update=changes), notes if dropped else []


def _gaps(log: Logged) -> list[str]:
    gaps_s = np.diff(log.time_s)
    worst = int(gaps_s.argmax())
    if gaps_s[worst] <= _LONGEST_GAP_S:
        return []
    return [
        f"nothing was logged for {gaps_s[worst]:.1f} s from {log.time_s[worst]:.1f} s on; a "
        f"straight line is taken to have been flown"
    ]


def _grounded(scenario: Scenario, i: int, n_samples: int) -> _Track:
    x = np.zeros((n_samples, N_STATES))
    x[:, :3], x[:, DOD] = scenario.uas[i].start_m, 1.0 - scenario.uas[i].soc_0
    none = np.zeros(n_samples)
    return _Track(x, np.ones(n_samples, np.bool_), none, none)


def _track(
    scenario: Scenario, i: int, log: Logged, places_m: FloatArray, times_s: FloatArray
) -> tuple[_Track, list[str]]:
    notes = []
    start_m = np.array(scenario.uas[i].start_m)
    at = _at_home(scenario, start_m, places_m)
    away = np.flatnonzero(~at)
    x = np.zeros((len(times_s), N_STATES))
    x[:, :3] = _interpolated(times_s, log.time_s, places_m)
    # the ground is under the volume in which missions are judged: how it gets to its start and
    # from there to the ground is no part of them
    x[:, 2] = np.minimum(x[:, 2], 0.0)
    left_s, back_s = (
        (log.time_s[max(away[0] - 1, 0)], log.time_s[min(away[-1] + 1, len(at) - 1)])
        if len(away)
        else (math.inf, -math.inf)
    )
    before = (times_s <= left_s) & at[0]
    resting = (times_s >= back_s) & at[-1]
    x[before | resting, :3] = start_m
    x[:, VX : VX + 3] = np.gradient(x[:, :3], scenario.dt_s, axis=0)
    x[before | resting, VX : VX + 3] = 0.0
    if not at[-1]:
        notes.append(f"its log ends away from home, at {log.time_s[-1]:.1f} s")
    if log.attitude_rad is not None:
        attitude_rad = _interpolated(times_s, log.time_s, log.attitude_rad)
        turns = scenario.uas[i].heading == "course"
        x[:, PHI : PHI + 3] = tilts_and_turn(attitude_rad) if turns else attitude_rad
    in_air = ~(before | resting)
    x[:, DOD], said = _depths(scenario, i, log, times_s, in_air)
    voltage_V, current_A = _battery(scenario.vehicles[i], scenario.dt_s, log, times_s, x[:, DOD])
    return _Track(x, resting, voltage_V, current_A), [*notes, *said]


def _at_home(scenario: Scenario, start_m: FloatArray, places_m: FloatArray) -> NDArray[np.bool_]:
    """(N,) whether a UAS is on the ground below its start, or on the way to it or from it."""
    beside_m = np.linalg.norm(places_m[:, :2] - start_m[:2], axis=1)
    top_m = max(-start_m[2], 0.0) + scenario.landing_distance_m
    return (beside_m <= AT_HOME_M) & (-places_m[:, 2] <= top_m)


def _interpolated(at_s: FloatArray, times_s: FloatArray, values: FloatArray) -> FloatArray:
    return np.stack([np.interp(at_s, times_s, column) for column in values.T], axis=1)


def _depths(
    scenario: Scenario, i: int, log: Logged, times_s: FloatArray, in_air: NDArray[np.bool_]
) -> tuple[FloatArray, list[str]]:
    """(T,) depth of discharge, and what is to be said of it."""
    uas, vehicle = scenario.uas[i], scenario.vehicles[i]
    full = 1.0 - uas.soc_0
    if log.used_Ah is not None:
        used_Ah = np.interp(times_s, log.time_s, log.used_Ah)
        used = (used_Ah - used_Ah[0]) / vehicle.battery.capacity_Ah
        return np.minimum(full + used, 1.0), []
    if log.soc is not None:
        return 1.0 - np.interp(times_s, log.time_s, log.soc), []
    per_s = dod_per_s(vehicle, full)
    estimated = full + per_s * scenario.dt_s * np.append(0.0, np.cumsum(in_air[:-1]))
    note = "its log has no charge: estimated as of level flight at full speed"
    # an estimate takes no UAS away
    return np.minimum(estimated, max(uas.dod_max, full)), [note]


def _battery(
    vehicle: VehicleParams, dt_s: float, log: Logged, times_s: FloatArray, dod: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(T,) voltage and current from a sample to the next; what was not logged, from the charge."""
    battery = vehicle.battery
    if log.current_A is not None:
        current_A = np.interp(times_s, log.time_s, log.current_A)
    else:
        current_A = np.append(np.diff(dod), 0.0) * 3_600.0 * battery.capacity_Ah / dt_s
    if log.voltage_V is not None:
        return np.interp(times_s, log.time_s, log.voltage_V), current_A
    resistance_ohm = battery.resistance_0_ohm + battery.resistance_th_ohm
    return open_circuit_voltage(vehicle, dod) - resistance_ohm * current_A, current_A


def _judged(scenario: Scenario, tracks: Sequence[_Track]) -> Flight:
    x = np.stack([track.x for track in tracks], axis=1)
    resting = np.stack([track.resting for track in tracks], axis=1)
    voltage_V = np.stack([track.voltage_V for track in tracks], axis=1)
    current_A = np.stack([track.current_A for track in tracks], axis=1)
    world = FlownWorld(scenario, x[0])
    log = FlightLog(world, scenario)
    for k in range(1, len(x)):
        if world.done:
            break
        outcome = world.follow(x[k], resting[k])
        outcome["voltage_V"], outcome["current_A"] = voltage_V[k - 1], current_A[k - 1]
        outcome["returning"] = False  # no mode of the log
        log.add({}, None, 0.0, None, outcome)
    return Flight(
        scenario=scenario,
        planner=PLANNER,
        planner_options={},
        seed=0,
        dynamics="lpv",
        return_mode=False,
        safety_filter=False,
        disturbances=(),
        ended="complete" if world.done else "stopped",
        wall_time_s=0.0,
        versions=recorded_versions(),
        **log.series(),
    )


def _off_path_m(plan: Flight, flight: Flight, i: int) -> FloatArray:
    """(N,) distances of the samples that UAS i flew from the path that it was to fly [m]."""
    places_m = flight.x[: flight.last_sample[i] + 1, i, :3]
    path_m = plan.x[: plan.last_sample[i] + 1, i, :3]
    nearest_m = np.linalg.norm(places_m - path_m[0], axis=1)
    for a, b in pairwise(path_m):
        nearest_m = np.minimum(nearest_m, distances_m(places_m, a, b))
    return nearest_m

"""A flight from logs: put to the samples of its plan, and judged by the rules of the world."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.log import FlightLog, Taken
from uas_coverage_env.flight.loop import recorded_versions
from uas_coverage_env.flight.of_log import STATES, Estimate, OfLog, Pass, Unknown
from uas_coverage_env.operations.geodesy import LocalFrame
from uas_coverage_env.operations.logs.battery import BatteryRecord, battery_of, unused
from uas_coverage_env.operations.logs.flights import chosen_flight
from uas_coverage_env.operations.logs.flown_path import FlownPath, path_of
from uas_coverage_env.operations.logs.judged_world import FlownWorld, Moments
from uas_coverage_env.operations.logs.logged import Logged
from uas_coverage_env.operations.path_geometry import distances_m
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.attitude import tilts_and_turn

PLANNER = "log"
"""Name of the planner of what was flown elsewhere."""

_MOST_STEPS = 100_000

_FINEST_S = 0.05
"""Between two samples of a log that are judged: at full speed that is a metre."""

_SAME_S = 1e-3
"""A sample of a log that is no farther from one of the flight is that one."""

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Flown:
    """A flight that was flown.

    Attributes:
        flight: As the world judges it.
        off_path_m: UAS -> (N,) distance of each position of its log in the air from the planned
            path.
        notes: What is to be known of the logs, with what was estimated (`flight.of_log`).
    """

    flight: Flight
    off_path_m: Mapping[str, FloatArray]
    notes: tuple[str, ...]


def flown_flight(
    plan: Flight,
    logs: Mapping[str, Logged],
    frame: LocalFrame,
    numbers: Mapping[str, int] | None = None,
) -> Flown:
    """The flight of some logs.

    Args:
        plan: The flight whose files were flown.
        logs: UAS -> what was logged; one without a log stayed at its start.
        frame: Where on the Earth it was.
        numbers: UAS -> which flight of its log, from 1 on; of others it must be the only one.

    Raises:
        InputError: The logs are of another place, of no flight of the plan, or of several.
    """
    flights = {name: chosen_flight(log, (numbers or {}).get(name)) for name, log in logs.items()}
    names = plan.names
    ways = {
        i: path_of(plan.scenario, i, flights[name], frame)
        for i, name in enumerate(names)
        if name in flights
    }
    begins_s, steps = _clock(plan.scenario.dt_s, list(ways.values()))
    scenario, notes = _scenario(plan.scenario, steps)
    flown = _Judged(scenario, ways, begins_s, steps)
    for i, name in enumerate(names):
        if i in ways:
            notes += [f"{name}: {note}" for note in (*ways[i].notes, *flown.batteries[i].notes)]
    notes += map(str, flown.estimates())
    flight = flown.flight()
    return Flown(
        flight,
        {names[i]: _off_path_m(plan, flight, i, way, begins_s) for i, way in ways.items()},
        tuple(notes),
    )


def _clock(dt_s: float, ways: Sequence[FlownPath]) -> tuple[float, int]:
    """When the flight begins, on the clock of the logs, and how many steps it has."""
    begins_s = min(way.flight.begins_s for way in ways)
    steps = max(_last_step(way, begins_s, dt_s) for way in ways)
    if steps > _MOST_STEPS:
        raise InputError(
            f"the logs last {steps * dt_s:.0f} s, more than {_MOST_STEPS} steps; give logs of one "
            f"flight on one clock"
        )
    return begins_s, max(steps, 1)


def _last_step(way: FlownPath, begins_s: float, dt_s: float) -> int:
    """The step in which it is home, or the last of which all is known."""
    steps = (way.ends_s - begins_s) / dt_s
    return math.ceil(steps - _SAME_S) if way.home else math.floor(steps + _SAME_S)


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


class _Judged:
    """The ways of all UAS, as the world judges them.

    Args:
        scenario: The mission.
        ways: Index of UAS -> its way; one without stays at its start.
        begins_s: When the flight begins, on the clock of the logs [s].
        steps: How many it has.
    """

    def __init__(
        self, scenario: Scenario, ways: Mapping[int, FlownPath], begins_s: float, steps: int
    ) -> None:
        self._scenario, self._ways, self._begins_s = scenario, ways, begins_s
        self._n_uas = len(scenario.uas)
        self._grid_s = scenario.dt_s * np.arange(steps + 1)
        # each as if it were the last: what ends away from home ends where its log does
        self._last = [
            _last_step(ways[i], begins_s, scenario.dt_s) if i in ways else 0
            for i in range(self._n_uas)
        ]
        own_s = [self._own_s(i) for i in range(self._n_uas)]
        self._time_s = np.unique(np.concatenate([self._grid_s, *own_s]))
        self._log_s: FloatArray = np.asarray(begins_s + self._time_s, np.float64)
        self._measured = np.stack([np.isin(self._time_s, of_one) for of_one in own_s], axis=1)
        self.batteries: list[BatteryRecord] = [self._battery(i) for i in range(self._n_uas)]
        self._x = np.stack([self._states(i) for i in range(self._n_uas)], axis=1)

    def flight(self) -> Flight:
        """The flight."""
        world = FlownWorld(self._scenario, self._x[0])
        log, passes = FlightLog(world, self._scenario), self._starts()
        known, ends = self._known(), np.searchsorted(self._time_s, self._grid_s)
        n_steps = len(self._grid_s) - 1
        home = np.array([i not in self._ways or self._ways[i].home for i in range(self._n_uas)])
        last = np.array(self._last)
        for k in range(1, n_steps + 1):
            if world.done:
                break
            part = slice(ends[k - 1] + 1, ends[k] + 1)
            moments = Moments(self._x[part], known[part], self._measured[part])
            over = last <= k
            gone = ~home & over if k < n_steps else np.zeros_like(home)
            outcome, covering = world.follow(moments, home & over, gone)
            passes += [self._pass(int(ends[k - 1]) + 1 + m, i) for m, i in covering]
            for i, battery in enumerate(self.batteries):
                outcome["voltage_V"][i] = battery.voltage_V[k - 1]
                outcome["current_A"][i] = battery.current_A[k - 1]
            outcome["returning"] = False  # no mode of the log
            log.add({}, None, Taken(processor_s=None), None, outcome)
        fields = log.series()
        self._keep_measured(fields)
        return Flight(
            scenario=self._scenario,
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
            of_log=OfLog(tuple(self.estimates()), tuple(self._unknown()), tuple(passes)),
            **fields,
        )

    def _own_s(self, i: int) -> FloatArray:
        """(N,) when UAS i was measured, since the beginning of the flight [s]."""
        if i not in self._ways:
            return np.zeros(0)
        way = self._ways[i]
        times_s = way.log.time_s - self._begins_s
        times_s = times_s[(times_s >= 0.0) & (times_s <= way.ends_s - self._begins_s)]
        near = np.rint(times_s / self._scenario.dt_s).astype(int)
        near = np.minimum(near, len(self._grid_s) - 1)
        same = np.abs(times_s - self._grid_s[near]) <= _SAME_S
        times_s = np.unique(np.where(same, self._grid_s[near], times_s))
        times_s = times_s[times_s <= self._grid_s[-1]]
        # of several in one interval, the first
        _, first = np.unique(np.floor(times_s / _FINEST_S + _SAME_S), return_index=True)
        return times_s[first]

    def _battery(self, i: int) -> BatteryRecord:
        if i not in self._ways:
            return unused(self._scenario, i, len(self._grid_s))
        way, at_s = self._ways[i], np.asarray(self._begins_s + self._grid_s, np.float64)
        in_air = ~way.standing(at_s) & (at_s < way.ends_s)
        return battery_of(self._scenario, i, way.log, at_s, in_air)

    def _states(self, i: int) -> FloatArray:
        """(M, 14) of UAS i at all moments."""
        uas = self._scenario.uas[i]
        x = np.zeros((len(self._time_s), S.N_STATES))
        x[:, S.DOD] = np.interp(self._time_s, self._grid_s, self.batteries[i].dod)
        if i not in self._ways:
            x[:, :3] = uas.start_m
            return x
        way, ends_m = self._ways[i], (np.array(uas.start_m), np.array(uas.home_m))
        at_s, half_s = self._log_s, 0.5 * self._scenario.dt_s
        x[:, :3] = way.places_at(at_s, *ends_m)
        moved_m = way.places_at(at_s + half_s, *ends_m) - way.places_at(at_s - half_s, *ends_m)
        x[:, S.VX : S.VX + 3] = moved_m / (2.0 * half_s)
        x[way.standing(at_s), S.VX : S.VX + 3] = 0.0
        attitude_rad = way.attitude_at(at_s)
        if attitude_rad is not None:
            turns = uas.heading == "course"
            x[:, S.PHI : S.PHI + 3] = tilts_and_turn(attitude_rad) if turns else attitude_rad
        return x

    def _known(self) -> NDArray[np.int8]:
        """(M, U) what is known at each moment, see `Moments`."""
        known = np.full(self._measured.shape, 2, np.int8)
        for i, way in self._ways.items():
            at_s = self._log_s
            there = way.knows(at_s)
            known[~there, i] = 0
            # the way to a moment leads through a gap where it or the moment before is in one
            through = np.append(False, ~way.knows(0.5 * (at_s[1:] + at_s[:-1])))
            known[there & through, i] = 1
        return known

    def _starts(self) -> list[Pass]:
        return [self._pass(0, i) for i in range(self._n_uas)]

    def _pass(self, moment: int, i: int) -> Pass:
        time_s, x = float(self._time_s[moment]), self._x[moment, i, :STATES]
        return Pass(time_s, self._scenario.uas[i].name, tuple(x.tolist()))

    def _keep_measured(self, fields: dict[str, NDArray[np.float64]]) -> None:
        """Put voltages that were measured back where the record has those of the model."""
        n_samples = len(fields["voltage_V"])
        for i, battery in enumerate(self.batteries):
            if battery.measured_V:
                last = min(self._last[i], n_samples - 1)
                fields["voltage_V"][: last + 1, i] = battery.voltage_V[: last + 1]
                fields["voltage_V"][last:, i] = battery.voltage_V[last]

    def estimates(self) -> list[Estimate]:
        """What was not measured."""
        found = []
        for i, uas in enumerate(self._scenario.uas):
            if i not in self._ways:
                how = "as a stay at its start: it has no log"
                found.append(Estimate(uas.name, "flight", how))
                continue
            found += [*self._ways[i].estimates, *self.batteries[i].estimates]
            if uas.sensors and self._ways[i].log.attitude_rad is None:
                found.append(
                    Estimate(uas.name, "attitude", "as level and facing north: its log has none")
                )
        return found

    def _unknown(self) -> list[Unknown]:
        return [
            dataclasses.replace(
                one, from_s=one.from_s - self._begins_s, to_s=one.to_s - self._begins_s
            )
            for _, way in sorted(self._ways.items())
            for one in way.unknown
        ]


def _off_path_m(
    plan: Flight, flight: Flight, i: int, way: FlownPath, begins_s: float
) -> FloatArray:
    """(N,) distances of the places that UAS i flew from the path that it was to fly [m]."""
    ends_s = begins_s + flight.last_sample[i] * flight.scenario.dt_s
    times_s = way.log.time_s
    in_air = (times_s >= way.flight.take_off_s) & (times_s <= min(ends_s, way.ends_s))
    places_m = way.places_m[in_air] if in_air.any() else way.places_m[:1]
    path_m = plan.x[: plan.last_sample[i] + 1, i, :3]
    nearest_m = np.linalg.norm(places_m - path_m[0], axis=1)
    for a, b in pairwise(path_m):
        nearest_m = np.minimum(nearest_m, distances_m(places_m, a, b))
    return nearest_m

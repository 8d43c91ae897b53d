"""The log of a flight under way: samples and steps as they come, arrays in the end."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import interpreted
from uas_coverage_env.entities.commands import command_mode
from uas_coverage_env.entities.outcome import CONTACT_NAMES, FAULT, NONE
from uas_coverage_env.entities.state import FLYING, SWAPPING
from uas_coverage_env.entities.state import LOST as IS_LOST
from uas_coverage_env.env.policy.interface import MissionInterface
from uas_coverage_env.features.event import OfUas
from uas_coverage_env.flight.record import (
    COVERING,
    LANDED,
    LIMIT,
    LOST,
    MODES,
    PLAN_DTYPE,
    RETURN,
    DecisionRecord,
    EventRecord,
    Swap,
    Violation,
    last_samples,
)
from uas_coverage_env.planning.decision import GUIDANCE, Decision
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.discharge import open_circuit_V
from uas_coverage_env.vehicle.limits import LIMIT_NAMES, N_LIMITS, write_limited
from uas_coverage_env.world import Command, GoTo


@dataclass(frozen=True)
class Taken:
    """What a decision took: time, and processor time of all threads, where it is known [s]."""

    wall_s: float = 0.0
    processor_s: float | None = 0.0


@dataclass(frozen=True)
class _Sample:
    x: NDArray[np.float64]
    status: NDArray[np.int64]
    covered: int


@dataclass(frozen=True)
class _Step:
    outcome: NDArray[np.void]
    modes: list[int]
    decision: DecisionRecord
    plan: NDArray[np.void]
    paid: NDArray[np.float64] | None
    sample: _Sample


class FlightLog:
    """Keeps a flight while it is flown; Ctrl-C at any moment leaves whole steps behind.

    Args:
        world: What is flown.
        scenario: As the mission begins.
        meter: Of the reward; None where no commands are known that it could be paid for.
    """

    def __init__(
        self, world: World, scenario: Scenario, meter: MissionInterface | None = None
    ) -> None:
        self._world = world
        self._scenario = scenario
        self._meter = meter
        self._steps: list[_Step] = []
        # in which all UAS rest: they belong to the flight if one flies again
        self._resting: list[_Step] = []
        self._covered = int((~world.state.uncovered).sum())
        self._start = self._sample()

    @property
    def steps(self) -> int:
        """Steps so far."""
        return len(self._steps) + len(self._resting)

    @property
    def covered(self) -> int:
        """Waypoints that the swarm has covered so far."""
        return (self._steps[-1].sample if self._steps else self._start).covered

    def add(
        self,
        commands: Mapping[str, Command],
        packed: NDArray[np.void] | None,
        took: Taken,
        decision: Decision | None,
        outcome: NDArray[np.void],
    ) -> None:
        """Keep the step just flown: the commands, how they were found, and what came of them."""
        paid = None
        if self._meter is not None and packed is not None:
            paid = self._meter.reward_terms(packed, outcome)
        names = self._world.names
        modes = [
            _mode(commands.get(name), returning)
            for name, returning in zip(names, outcome["returning"], strict=True)
        ]
        filtered = int(outcome["filtered"].sum())
        record = _decision_record(took, decision, filtered, commands.values())
        plan = _plan_rows(decision, self.steps, names)
        self._covered += int(outcome["newly_covered"].sum())
        step = _Step(outcome, modes, record, plan, paid, self._sample())
        if outcome["flew"].any():
            rested, self._resting = self._resting, []
            # one statement, so that there is no half a step
            self._steps += [*rested, step]
        else:
            self._resting.append(step)

    def series(self) -> dict[str, Any]:
        """The fields of `Flight` that follow from what was kept."""
        samples = [self._start, *(step.sample for step in self._steps)]
        x = np.array([sample.x for sample in samples])
        flies = self._flies()
        mode = self._mode(np.array([sample.status for sample in samples]), flies)
        u = np.zeros((*mode.shape, S.N_INPUTS))
        current_A, voltage_V = np.zeros(mode.shape), np.zeros(mode.shape)
        for k, step in enumerate(self._steps):
            flying = mode[k] < LANDED
            u[k, flying] = step.outcome["u"][flying]
            current_A[k, flying] = step.outcome["current_A"][flying]
            voltage_V[k, flying] = step.outcome["voltage_V"][flying]
        for i, k in enumerate(last_samples(mode)):
            x[k:, i] = x[k, i]
            # while nothing is drawn the battery shows what it has
            vehicle = self._world.arena.vehicles[i]
            for j in np.flatnonzero(~flies[:k, i]):
                voltage_V[j, i] = open_circuit_V(vehicle, x[j, i, S.DOD]) - x[j, i, S.U_TH]
            voltage_V[k:, i] = open_circuit_V(vehicle, x[k, i, S.DOD]) - x[k, i, S.U_TH]
            for true in self._world.state.true_vehicles[i : i + 1]:
                voltage_V[k:, i] -= true["further_V"][: true["n_further"]].sum()
        return {
            **{"x": x, "u": u, "voltage_V": voltage_V, "current_A": current_A, "mode": mode},
            "covered": np.array([sample.covered for sample in samples], np.int64),
            "moving_position_m": np.array(self._moving_path_m(len(samples))),
            "plan": np.concatenate([np.empty(0, PLAN_DTYPE), *(step.plan for step in self._steps)]),
            "decisions": tuple(step.decision for step in self._steps),
            "violations": tuple(self._violations()),
            "breaches": sum(int(step.outcome["breaches"].sum()) for step in self._steps),
            "height_breaches": sum(int(step.outcome["too_low"].sum()) for step in self._steps),
            "reserve_breaches": sum(
                int(step.outcome["below_reserve"].sum()) for step in self._steps
            ),
            "events": self._events(),
            "swaps": tuple(self._swaps()),
            "reward_terms": self._reward_terms(),
            "reward_names": () if self._meter is None else self._meter.settings.term_names,
            "open_waypoints": self._world.visits_to_come
            if self._scenario.events or self._scenario.asks_again
            else None,
            "min_separation_m": self._smallest("separation_m"),
            "min_obstacle_clearance_m": self._smallest("obstacle_clearance_m"),
        }

    def _reward_terms(self) -> NDArray[np.float64] | None:
        """(T - 1, U, R)."""
        if self._meter is None:
            return None
        shape = (len(self._steps), len(self._world.names), len(self._meter.settings.term_names))
        return np.array([step.paid for step in self._steps]).reshape(shape)

    def _moving_path_m(self, n_samples: int) -> NDArray[np.float64]:
        """(T, M, 3) [m] of the obstacles that the scenario began with."""
        n_moving = len(self._scenario.moving_obstacles)
        return self._world.arena.moving_path_m[:n_samples, :n_moving]

    def _events(self) -> tuple[EventRecord, ...]:
        state, names = self._world.state, self._world.names
        found = []
        for e, event in enumerate(self._scenario.events):
            sample, uas = int(state.events[e].step), int(state.events[e].uas)
            if sample <= len(self._steps):
                name = names[uas] if isinstance(event, OfUas) else None
                found.append(EventRecord(sample * self._scenario.dt_s, event.kind, name, e))
        return tuple(sorted(found, key=lambda event: event.time_s))

    def _swaps(self) -> Iterator[Swap]:
        """In order of their take-offs."""
        landed_s: dict[str, float] = {}
        for k, step in enumerate(self._steps):
            time_s = (k + 1) * self._scenario.dt_s
            for name, status in zip(self._world.names, step.sample.status.tolist(), strict=True):
                if status == SWAPPING:
                    landed_s.setdefault(name, time_s)
                elif name in landed_s:
                    if status == FLYING:
                        yield Swap(name, landed_s[name], time_s)
                    del landed_s[name]

    def _sample(self) -> _Sample:
        state = self._world.state
        return _Sample(state.x.copy(), state.uas["status"].copy(), self._covered)

    def _flies(self) -> NDArray[np.bool_]:
        """(T, U) whether a UAS flies from a sample on."""
        end = self._steps[-1].sample if self._steps else self._start
        return np.array([*(step.outcome["flew"] for step in self._steps), end.status == FLYING])

    def _mode(self, status: NDArray[np.int64], flies: NDArray[np.bool_]) -> NDArray[np.int8]:
        """(T, U) the mode of the command that acts from a sample on, or how the UAS has ended.

        One that has landed and takes off again has not ended yet: it is on its return.
        """
        modes = [step.modes for step in self._steps]
        # nothing acts from the last sample on; a UAS that still flies there keeps its mode
        final = modes[-1] if modes else [COVERING] * status.shape[1]
        ended = np.where(status == IS_LOST, LOST, LANDED)
        later = np.logical_or.accumulate(flies[::-1])[::-1]
        resting = np.where(later, RETURN, ended)
        return np.where(flies, [*modes, final], resting).astype(np.int8)

    def _violations(self) -> list[Violation]:
        scenario, known = self._scenario, self._world.known
        partners = {
            "obstacle": [obstacle.name for obstacle in known.obstacles],
            "moving_obstacle": [obstacle.name for obstacle in known.moving_obstacles],
            "uas": self._world.names,
        }
        found: dict[tuple[int, str], Violation] = {}
        for k, step in enumerate(self._steps):
            time_s = (k + 1) * scenario.dt_s
            for i, name in enumerate(self._world.names):
                entry = step.outcome[i]
                if entry["contact"] not in (NONE, FAULT):
                    kind = CONTACT_NAMES[entry["contact"]]
                    partner = partners[kind][entry["contact_with"]] if kind in partners else None
                    found[i, kind] = Violation(time_s, name, kind, partner)
                for limit, value, bound in self._exceeded(step, i):
                    now = Violation(time_s, name, LIMIT, limit, value, bound, 1)
                    found[i, limit] = found[i, limit].worse(now) if (i, limit) in found else now
        return list(found.values())

    def _exceeded(self, step: _Step, i: int) -> Iterator[tuple[str, float, float]]:
        """The limits that UAS i exceeds at the end of a step: name, value and bound."""
        entry = step.outcome[i]
        mask = int(entry["limits_exceeded"])
        if not mask:
            return
        vehicle, values = self._world.arena.vehicles[i], np.empty(N_LIMITS)
        body_rates = self._world.dynamics == "nonlinear" and not vehicle.follows_course
        interpreted(write_limited)(
            step.sample.x[i], entry["voltage_V"], entry["current_A"], body_rates, values
        )
        for bit, limit in enumerate(LIMIT_NAMES):
            if mask >> bit & 1:
                yield limit, float(values[bit]), float(vehicle.bounds[bit])

    def _smallest(self, field: str) -> float | None:
        """The smallest distance met in flight; None where there never was a partner (infinity)."""
        smallest = min((float(step.outcome[field].min()) for step in self._steps), default=math.inf)
        return smallest if math.isfinite(smallest) else None


def _mode(command: Command | None, returning: bool) -> int:
    """The mode of a UAS in a step; COVERING stands in for one that does not fly."""
    if returning:
        return RETURN
    return COVERING if command is None else MODES.index(command_mode(command))


def _plan_rows(decision: Decision | None, step: int, names: tuple[str, ...]) -> NDArray[np.void]:
    parts = [np.empty(0, PLAN_DTYPE)]
    for name, positions_m in (decision.predicted_m if decision else {}).items():
        rows = np.empty(len(positions_m), PLAN_DTYPE)
        rows["step"], rows["uas"] = step, names.index(name)
        rows["n"], rows["position_m"] = np.arange(len(positions_m)), positions_m
        parts.append(rows)
    return np.concatenate(parts)


def _decision_record(
    took: Taken, decision: Decision | None, filtered: int, commands: Iterable[Command]
) -> DecisionRecord:
    gap = reason = None
    by = [] if decision is None else [str(who) for who in decision.flown_by]
    if any(isinstance(each, GoTo) and each.waypoint is not None for each in commands):
        by.append(GUIDANCE)
    if decision is not None:
        if decision.mip_gap is not None and math.isfinite(decision.mip_gap):
            gap = float(decision.mip_gap)  # an infinite gap says that there is no bound
        reason = None if decision.reason is None else str(decision.reason)
    fallback = decision is not None and decision.fallback
    return DecisionRecord(
        took.wall_s, fallback, gap, filtered, reason, took.processor_s, tuple(dict.fromkeys(by))
    )

"""Flights along labelled routes in free air, from which the flight network learns their times."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.route.landing import is_landed, towards_home
from uas_coverage_agents.route.layers import Layers
from uas_coverage_agents.route.leg_flight import (
    AHEAD,
    DOWN,
    EAST,
    IS_HOME,
    N_FLIGHT,
    N_VELOCITIES,
    NORTH,
    RADIUS,
    observe_places,
    weigh,
)
from uas_coverage_agents.training.route_labels import Label
from uas_coverage_env.autopilot.control import command_wrench, write_command
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.entities.commands import COMMAND_DTYPE, VELOCITY
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.lpv import fly_kinematics
from uas_coverage_env.world import build_arena

MOST_STEPS = 900

_COVERED, _STRAIGHT_S = range(2)
"""What is noted of each step: waypoints covered so far, and the time of the straight way [s]."""


class Course(NamedTuple):
    """A route to fly: UAS, vehicle, places (K, 5) of `leg_flight`, and home at their end."""

    uas: Any
    vehicle: Any
    rules: Any
    places: NDArray[np.float64]
    planned_steps: int


class Samples(NamedTuple):
    """What was read, and the time it took beyond the straight way [s]."""

    rows: NDArray[np.float32]
    beyond_s: NDArray[np.float32]


@allocating_kernel
def _places_ahead(places, covered, ahead):
    for k in range(AHEAD):
        ahead[k] = places[min(covered + k, places.shape[0] - 1)]


@allocating_kernel
def _fly(uas, vehicle, rules, places, layers, noise_s, rng, rows, notes):
    """Fly a route; (steps, covered). Writes what the network reads to `rows`, and `notes`."""
    n = places.shape[0] - 1
    x, reference, u = np.zeros(S.N_STATES), np.zeros(2), np.zeros(S.N_INPUTS)
    x[:3] = uas.home_m
    command = np.zeros(1, COMMAND_DTYPE)[0]
    ahead, aims_m = np.empty((AHEAD, 5)), np.empty((AHEAD, 3))
    commands, costs = np.empty((N_VELOCITIES, 3)), np.empty(N_VELOCITIES)
    covered = 0
    for step in range(notes.shape[0]):
        while covered < n:
            at = places[covered]
            dx, dy, dz = x[S.X] - at[NORTH], x[S.Y] - at[EAST], x[S.Z] - at[DOWN]
            if dx * dx + dy * dy + dz * dz > at[RADIUS] * at[RADIUS]:
                break
            covered += 1
        _places_ahead(places, covered, ahead)
        notes[step, _COVERED] = covered
        notes[step, _STRAIGHT_S] = observe_places(
            x, reference, uas.speed_mps, ahead[0], ahead[1], ahead[2], rows[step]
        )
        if covered == n:
            if is_landed(uas, rules, x):
                return step, covered
            towards_home(vehicle, uas, rules, x, reference, commands[0], command)
            best = 0
        else:
            weigh(
                vehicle, uas.speed_mps, x, reference, ahead, layers, aims_m, commands, costs,
                command,
            )  # fmt: skip
            if noise_s > 0.0:
                costs += noise_s * rng.random(costs.shape[0])
            best = costs.argmin()
        write_command(command, VELOCITY, commands[best, 0], commands[best, 1], commands[best, 2])
        command_wrench(vehicle, x, reference, command, u)
        fly_kinematics(vehicle, x, u)
    return notes.shape[0], covered


def courses_of(labels: list[Label], town_of: Callable[[Label], Scenario]) -> list[Course]:
    """Every route of two waypoints or more, with its UAS."""
    courses = []
    for label in labels:
        scenario = town_of(label)
        arena = build_arena(scenario)
        for u, (route, steps) in enumerate(zip(label.routes, label.steps, strict=True)):
            if len(route) > 1 and steps:
                places = np.zeros((len(route) + 1, 5))
                for k, w in enumerate(route):
                    places[k, :3] = scenario.waypoints[w].position_m
                    places[k, RADIUS] = scenario.waypoints[w].radius_m
                places[-1, :3] = scenario.uas[u].home_m
                places[-1, IS_HOME] = 1.0
                courses.append(
                    Course(arena.uas[u], arena.vehicles[u], arena.rules[0], places, steps)
                )
    return courses


def flown(
    courses: list[Course], layers: Layers, noise_s: float, rng: np.random.Generator
) -> tuple[Samples, float]:
    """Fly all courses: what can be learned, and their steps over those that were planned."""
    rows_of, beyond_of, steps, planned = [], [], 0, 0
    for course in courses:
        rows, notes = np.zeros((MOST_STEPS, N_FLIGHT)), np.zeros((MOST_STEPS, 2))
        uas, vehicle, rules, places, planned_steps = course
        end, covered = _fly(uas, vehicle, rules, places, layers, noise_s, rng, rows, notes)
        steps, planned = steps + end, planned + planned_steps
        n = len(places) - 1
        if covered < n or end == MOST_STEPS:
            continue
        done = notes[: end + 1, _COVERED]
        times = np.full(n + 3, float(end))  # at which each place is reached; home at the end
        times[:n] = np.searchsorted(done, np.arange(1, n + 1))
        third = times[(done + 2).astype(int)]
        beyond = third - np.arange(end + 1) - notes[: end + 1, _STRAIGHT_S]
        rows_of.append(rows[: end + 1].astype(np.float32))
        beyond_of.append(beyond.astype(np.float32))
    return Samples(np.concatenate(rows_of), np.concatenate(beyond_of)), steps / planned

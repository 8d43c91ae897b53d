"""Random states in which return mode has not called yet, and whether it brings the UAS home.

The part of `returns.py` that has `--vehicle`. A state: a town as large as the vehicle needs to
stop, a UAS at a drawn place and altitude, that has flown at a drawn velocity until it knows the
wind, with so little charge left that return mode calls within the next seconds. From there it flies
on, to a drawn waypoint or straight on at full speed, until it is called, and home.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env import GoTo, Scenario, World, generate_scenario
from uas_coverage_env.autopilot.return_mode import has_to_return, seconds_home, seconds_to_keep
from uas_coverage_env.entities.codes import DynamicsName
from uas_coverage_env.entities.outcome import CONTACT_NAMES
from uas_coverage_env.entities.state import CONSUMPTION, LANDED
from uas_coverage_env.vehicle import VehicleParams, load_vehicle
from uas_coverage_env.vehicle.layout import DOD, Z
from uas_coverage_env.vehicle.stopping import stopping_of
from uas_coverage_env.world import Command, Velocity

STATES_OF_A_TOWN = 5
FLYABLE = 2.0 / 3.0
"""Of the highest speed of a vehicle: in more wind than that, return mode promises nothing."""

_NEAREST_M, _FROM_WALLS_M, _ALTITUDES_M = 15.0, 6.0, (3.0, 45.0)
_STOPS_M = 30.0
"""A vehicle that stops within this flies in towns as they are generated, others in larger ones."""

_STEPS_S = (0.5, 1.0, 2.0)
_LEARNS_S = (15.0, 30.0)
_SPARE_S = (5.0, 10.0, 20.0, 40.0, 80.0, 160.0, 320.0)


@dataclass(frozen=True)
class Returned:
    """One flight from a state.

    Attributes:
        lost_to: What it was lost to; None: it landed.
        called_at_m: (3,) where it was when return mode called it [m]; None: it never did.
        left: Of its usable charge, what was left in the end [-].
    """

    lost_to: str | None
    called_at_m: NDArray[np.float64] | None
    left: float


def flown_wind_mps(vehicle: VehicleParams, wind_mps: float) -> float:
    """The wind asked for, or the strongest in which return mode promises something [m/s]."""
    return min(wind_mps, FLYABLE * vehicle.limits.v_xy_max_mps)


def town_for(seed: int, vehicle: str, wind_mps: float) -> Scenario:
    """A generated town with one UAS of a vehicle, as many times larger as that stops later."""
    rng = np.random.default_rng([seed, 16])
    made = generate_scenario(
        seed, n_uas=1, n_waypoints=int(rng.integers(4, 40)), n_obstacles=int(rng.integers(20))
    )
    parameters = load_vehicle(vehicle)
    body, dt_s = parameters.airframe, float(rng.choice(_STEPS_S))
    larger = max(1.0, stopping_of(parameters, dt_s).way_m / _STOPS_M)
    table = made.model_dump(mode="json", by_alias=True, exclude_none=True)
    for entry in (table["geofence"], *table["obstacles"]):
        entry["vertices_m"] = (larger * np.array(entry["vertices_m"])).tolist()
    for entry in table["obstacles"]:
        entry["safe_distance_m"] *= larger
    for entry in table["waypoints"]:
        entry["position_m"] = [larger * part for part in entry["position_m"]]
        entry["radius_m"] *= larger
    (uas,) = table["uas"]
    uas["start_m"] = [larger * part for part in uas["start_m"]]
    uas["vehicle"], uas["soc_0"], uas["dod_max"] = vehicle, 1.0, parameters.battery.dod_max
    uas["radius_m"] = round(body.arm_m + parameters.rotor.propeller_radius_m, 3)
    table["dt_s"], table["max_steps"] = dt_s, 20_000
    if wind_mps > 0.0:
        mean_mps = flown_wind_mps(parameters, wind_mps)
        table["wind"] = {"mean_mps": mean_mps, "from_deg": float(rng.uniform(0.0, 360.0))}
    return Scenario.model_validate(table)


def _put_anywhere(world: World, rng: np.random.Generator, larger: float) -> None:
    """Put the UAS at rest at a drawn place, its battery full."""
    scenario, state = world.scenario, world.state
    corners_m = scenario.fence.vertices_m
    world.reset()
    while True:
        place_m = rng.uniform(corners_m.min(axis=0), corners_m.max(axis=0))
        place_m[2] = -larger * rng.uniform(*_ALTITUDES_M)
        from_home_m = np.linalg.norm((place_m - scenario.uas[0].start_m)[:2])
        if (
            from_home_m > larger * _NEAREST_M
            and scenario.fence.signed_distance(place_m) < -larger * _FROM_WALLS_M
            and all(h.signed_distance(place_m) > larger * _FROM_WALLS_M for h in scenario.hulls)
        ):
            break
    state.x[0, :3], state.x[0, DOD], state.uas[0].departed = place_m, 0.0, True


def _any_velocity(world: World, rng: np.random.Generator, speed_mps: float) -> Velocity:
    heading = rng.uniform(0.0, 2.0 * np.pi)
    altitude_m = -float(world.state.x[0, Z])
    return Velocity(speed_mps * math.cos(heading), speed_mps * math.sin(heading), altitude_m)


def _almost_called(world: World, rng: np.random.Generator) -> bool:
    """Take charge until return mode is about to call; whether the battery holds as much."""
    arena, state = world.arena, world.state
    x, belief, dod_max = state.x[0], state.uas[0].belief[:], float(arena.uas["dod_max"][0])
    per_s = float(arena.uas["dod_per_s"][0]) * (1.0 + max(float(belief[CONSUMPTION]), 0.0))
    state.uas[0].returning = False
    for spare_s in _SPARE_S:
        keep_s = max(seconds_home(arena, 0, x), seconds_to_keep(arena, 0, x, math.inf, belief))
        x[DOD] = dod_max - per_s * (keep_s + spare_s * rng.uniform(0.5, 1.0))
        if x[DOD] < 0.0:
            return False
        if not has_to_return(arena, state, 0):
            return True
    return False


def _state(world: World, rng: np.random.Generator, larger: float) -> bool:
    """Bring the UAS into a state, if this draw gives one."""
    name, top_mps = world.names[0], world.scenario.vehicles[0].limits.v_xy_max_mps
    _put_anywhere(world, rng, larger)
    command = _any_velocity(world, rng, rng.uniform(0.0, top_mps))
    for _ in range(round(rng.uniform(*_LEARNS_S) / world.scenario.dt_s)):
        if world.done:
            return False
        world.state.uas[0].returning = False
        world.step({name: command})
    return not world.done and _almost_called(world, rng)


def _fly(world: World, command: Command) -> Returned:
    name, state, called_at_m = world.names[0], world.state, None
    lost_to = None
    while not world.done:
        outcome = world.step({name: command})
        if state.uas[0].returning and called_at_m is None:
            called_at_m = state.x[0, :3].copy()
        if outcome["contact"][0]:
            lost_to = CONTACT_NAMES[outcome["contact"][0]]
    if state.uas[0].status != LANDED and lost_to is None:
        lost_to = "the clock"
    dod_max = float(world.arena.uas["dod_max"][0])
    return Returned(lost_to, called_at_m, 1.0 - float(state.x[0, DOD]) / dod_max)


def flown_states(
    seed: int, vehicle: str, dynamics: DynamicsName, wind_mps: float
) -> Iterator[Returned]:
    """The flights from the states of a town, return mode and safety filter on.

    Args:
        seed: Of everything.
        vehicle: Name or file.
        dynamics: The model that is flown.
        wind_mps: Of a steady wind from a drawn direction, or as much as the vehicle can fly against
            [m/s].
    """
    scenario = town_for(seed, vehicle, wind_mps)
    larger = max(1.0, stopping_of(scenario.vehicles[0], scenario.dt_s).way_m / _STOPS_M)
    world = World(scenario, dynamics=dynamics, return_mode=True, safety_filter=True, seed=seed)
    rng = np.random.default_rng([seed, 17])
    for _ in range(STATES_OF_A_TOWN):
        while not _state(world, rng, larger):
            pass
        top_mps = scenario.vehicles[0].limits.v_xy_max_mps
        command: Command = GoTo(int(rng.integers(len(scenario.waypoints))))
        if rng.random() < 0.5:
            command = _any_velocity(world, rng, top_mps)
        yield _fly(world, command)

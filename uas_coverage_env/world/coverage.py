"""Which waypoints are covered at a sample, and which UAS have come home."""

import math

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import inlined_kernel, rarely
from uas_coverage_env.entities.outcome import NONE
from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle.layout import DOD, VX, VY, VZ, X, Y, Z
from uas_coverage_env.world.waypoints import DOWN_M, EAST_M, NORTH_M, REACH_M2, WEIGHT


@inlined_kernel
def _reaches(columns, w, x, y, z):
    """Whether a place is within the radius of a waypoint."""
    dx = x - columns[NORTH_M, w]
    dy = y - columns[EAST_M, w]
    dz = z - columns[DOWN_M, w]
    return dx * dx + dy * dy + dz * dz <= columns[REACH_M2, w]


@inlined_kernel
def can_cover(arena, i, w):
    """Whether UAS i carries the sensor that waypoint w asks for."""
    return arena.waypoints[w].sensor & ~arena.uas[i].sensors == 0


@inlined_kernel
def speed_of(x):
    """Magnitude of the velocity of a state [m/s]."""
    return math.sqrt(x[VX] * x[VX] + x[VY] * x[VY] + x[VZ] * x[VZ])


@inlined_kernel
def _is_as_asked(arena, i, w, x):
    """Whether UAS i covers waypoint w from where it is: with its sensor, height and speed."""
    waypoint = arena.waypoints[w]
    if not waypoint.asks:
        return True
    return (
        can_cover(arena, i, w)
        and waypoint.lowest_m <= -x[Z] <= waypoint.highest_m
        and speed_of(x) <= waypoint.max_speed_mps
    )


def covering_samples(scenario: Scenario, w: int, x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Where a record of states covers a waypoint, by the rule of `cover`.

    Args:
        scenario: The mission.
        w: Index of the waypoint.
        x: (T, U, 14) states; whether a UAS was flying is left to the caller.

    Returns:
        (T, U).
    """
    waypoint = scenario.waypoints[w]
    away_m = np.linalg.norm(x[..., :3] - np.array(waypoint.position_m), axis=-1)
    covers = (away_m <= waypoint.radius_m) & scenario.can_cover[:, w]
    if waypoint.heights_m is not None:
        lowest_m, highest_m = waypoint.heights_m
        covers &= (lowest_m <= -x[..., Z]) & (-x[..., Z] <= highest_m)
    if waypoint.max_speed_mps is not None:
        covers &= np.linalg.norm(x[..., VX : VZ + 1], axis=-1) <= waypoint.max_speed_mps
    return covers


@inlined_kernel
def cover(arena, state, sample, outcome):
    """Cover the waypoints within reach of a flying UAS as it is now, see `_is_as_asked`.

    A lost UAS covers nothing at the sample of its loss. Where several UAS reach a waypoint at
    the same sample, it counts for the first of them.

    Args:
        arena: The arena.
        state: The state; what is uncovered and due is written.
        sample: Number of the sample.
        outcome: (U,) of OUTCOME_DTYPE; what was covered is written.
    """
    for i in range(state.uas.shape[0]):
        event = outcome[i]
        if state.uas[i].status != FLYING or event.contact != NONE:
            continue
        x = state.x[i, X]
        y = state.x[i, Y]
        z = state.x[i, Z]
        columns = arena.waypoint_columns
        within = 0
        for w in range(state.uncovered.shape[0]):
            within += _reaches(columns, w, x, y, z) & state.uncovered[w]
        if within == 0:
            continue
        for w in range(state.uncovered.shape[0]):
            if _reaches(columns, w, x, y, z) & state.uncovered[w]:
                if not _is_as_asked(arena, i, w, state.x[i]):
                    continue
                state.uncovered[w] = False
                if rarely(state.due_step.shape[0] > 0) and arena.again_steps[w] > 0:
                    state.due_step[w] = sample + arena.again_steps[w]
                event.newly_covered += 1
                event.newly_covered_weight += columns[WEIGHT, w]


@inlined_kernel
def away_from_home_m(uas, x):
    """Distance of a state from the home of a UAS, a record of the arena [m]."""
    home_m = uas.home_m
    dx = x[X] - home_m[0]
    dy = x[Y] - home_m[1]
    dz = x[Z] - home_m[2]
    return math.sqrt(dx * dx + dy * dy + dz * dz)


@inlined_kernel
def land(arena, state, outcome):
    """Land the UAS that are slow and near their homes, and have left before or return.

    With less charge than the reserve, that is a breach.

    A landed UAS rests: no speed, no tilt, no rates; its battery stays as it is.
    """
    rules = arena.rules[0]
    for i in range(state.uas.shape[0]):
        if state.uas[i].status != FLYING or outcome[i].contact != NONE:
            continue
        slow = speed_of(state.x[i]) < rules.landing_speed_mps
        if away_from_home_m(arena.uas[i], state.x[i]) > rules.landing_distance_m:
            state.uas[i].departed = True
        elif slow and (state.uas[i].departed or outcome[i].returning):
            state.uas[i].status = LANDED
            outcome[i].landed = True
            if state.x[i, DOD] > arena.uas[i].dod_max:
                outcome[i].below_reserve = True
                outcome[i].breaches += 1
            state.uas[i].reference_mps[0] = 0.0
            state.uas[i].reference_mps[1] = 0.0
            for k in range(VX, DOD):
                state.x[i, k] = 0.0

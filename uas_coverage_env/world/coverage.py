"""Which waypoints are covered at a sample, and who has come home."""

import math

from numba import njit

from uas_coverage_env.vehicle import DOD, VX, VY, VZ, X, Y, Z
from uas_coverage_env.world.outcome import NONE
from uas_coverage_env.world.state import FLYING, LANDED


@njit(cache=True, error_model="numpy")
def cover(arena, state, outcome):
    """Cover the waypoints within reach of a flying UAS at its position now.

    A lost UAS covers nothing at the sample of its loss. Where several UAS reach a waypoint at
    the same sample, it counts for the first of them.
    """
    for w in range(state.uncovered.shape[0]):
        if not state.uncovered[w]:
            continue
        waypoint = arena.waypoints[w]
        for i in range(state.status.shape[0]):
            if state.status[i] != FLYING or outcome[i].contact != NONE:
                continue
            dx = state.x[i, X] - waypoint.position_m[0]
            dy = state.x[i, Y] - waypoint.position_m[1]
            dz = state.x[i, Z] - waypoint.position_m[2]
            if dx * dx + dy * dy + dz * dz <= waypoint.radius_m * waypoint.radius_m:
                state.uncovered[w] = False
                outcome[i].newly_covered += 1
                outcome[i].newly_covered_weight += waypoint.weight
                break


@njit(cache=True, error_model="numpy")
def land(arena, state, outcome):
    """Land the UAS that are slow and near their starts, and have left before or return.

    A landed UAS rests: no speed, no tilt, no rates; its battery stays as it is.
    """
    rules = arena.rules[0]
    for i in range(state.status.shape[0]):
        if state.status[i] != FLYING or outcome[i].contact != NONE:
            continue
        home_m = arena.uas[i].home_m
        dx = state.x[i, X] - home_m[0]
        dy = state.x[i, Y] - home_m[1]
        dz = state.x[i, Z] - home_m[2]
        away = math.sqrt(dx * dx + dy * dy + dz * dz) > rules.landing_distance_m
        vx = state.x[i, VX]
        vy = state.x[i, VY]
        vz = state.x[i, VZ]
        slow = math.sqrt(vx * vx + vy * vy + vz * vz) < rules.landing_speed_mps
        if away:
            state.departed[i] = True
        elif slow and (state.departed[i] or outcome[i].returning):
            state.status[i] = LANDED
            outcome[i].landed = True
            state.reference[i, 0] = 0.0
            state.reference[i, 1] = 0.0
            for k in range(VX, DOD):
                state.x[i, k] = 0.0

"""Small compiled functions that every part of the observation is made of."""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.env.observation.scales import NEARBY_M
from uas_coverage_env.vehicle.layout import DOD

STRAIGHT_M = 1e-6
"""What is nearer than this horizontally is straight above or below [m]."""


@inlined_kernel
def within(value, low, high):
    """The value, kept between two bounds; NaN becomes the lower one and does not travel."""
    if value > low:
        return value if value < high else high
    return low


@inlined_kernel
def close(distance_m):
    """1 at the place itself, 1/2 at NEARBY_M, towards 0 far away."""
    return NEARBY_M / (NEARBY_M + distance_m)


@inlined_kernel
def level_m(dx, dy):
    """Length of a horizontal vector [m]."""
    return math.sqrt(dx * dx + dy * dy)


@inlined_kernel
def direction(dx, dy, row, k):
    """Write the horizontal unit vector towards a place; returns the next column."""
    distance_m = level_m(dx, dy)
    per_m = 1.0 / distance_m if distance_m > STRAIGHT_M else 0.0
    row[k] = within(dx * per_m, -1.0, 1.0)
    row[k + 1] = within(dy * per_m, -1.0, 1.0)
    return k + 2


@inlined_kernel
def apart_m(dx, dy, dz):
    """Length of a vector [m]."""
    return math.sqrt(dx * dx + dy * dy + dz * dz)


@inlined_kernel
def charge_left(arena, state, i):
    """Share of the usable charge of UAS i that is left; negative once overdrawn."""
    dod_max = arena.uas[i].dod_max
    return within((dod_max - state.x[i, DOD]) / dod_max, -1.0, 1.0)

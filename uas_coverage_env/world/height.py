"""The least height above ground and roofs, and where it does not hold: near start and home."""

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.entities.outcome import BREACH_TOLERANCE_M
from uas_coverage_env.world.routes import box_apart

CRUISE_ALTITUDE_M = 8.0
"""On a longer way UAS do not sink below this altitude above the floor, at scale 1 [m]."""

HEIGHT_MARGIN_M = 0.5
"""Commands stay this much above the least height, at scale 1: altitudes are not held to the
centimetre [m]."""


@inlined_kernel
def in_landing_zone(arena, i, x, y):
    """Whether a place is so near to the start or home of UAS i that it may fly low there."""
    zone_m = arena.rules[0].landing_zone_m
    return _is_within(arena.uas[i].home_m, x, y, zone_m) or _is_within(
        arena.uas[i].start_m, x, y, zone_m
    )


@inlined_kernel
def _is_within(place_m, x, y, distance_m):
    dx = x - place_m[0]
    dy = y - place_m[1]
    return dx * dx + dy * dy <= distance_m * distance_m


@inlined_kernel
def lowest_altitude(arena, i, x, y):
    """The lowest altitude [m] at which a UAS is guided at a place."""
    rules = arena.rules[0]
    floor_m = rules.floor_m
    if rules.min_height_m > 0.0 and not in_landing_zone(arena, i, x, y):
        floor_m = max(floor_m, rules.min_height_m + rules.length_scale * HEIGHT_MARGIN_M)
    return floor_m


@kernel
def _over_roof(arena, obstacle, x, y, z):
    """Whether a place lies in the hull with its upper faces raised by the least height."""
    height_m = arena.rules[0].min_height_m
    normals = arena.normals
    for h in range(obstacle.first_face, obstacle.last_face):
        away_m = normals[h, 0] * x + normals[h, 1] * y + normals[h, 2] * z + arena.offsets_m[h]
        if away_m >= height_m * max(0.0, -normals[h, 2]) - BREACH_TOLERANCE_M:
            return False
    return True


@kernel
def is_too_low(arena, i, x, y, z):
    """Whether UAS i is below the least height at a place, outside of its landing zone."""
    if in_landing_zone(arena, i, x, y):
        return False
    if -z < arena.rules[0].min_height_m - BREACH_TOLERANCE_M:
        return True
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        if not box_apart(obstacle, x, y, z, x, y, z) and _over_roof(arena, obstacle, x, y, z):
            return True
    return False

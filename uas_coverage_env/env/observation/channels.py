"""A picture of what lies around a UAS, for convolutional networks: north is up, itself the middle.

Five channels of n x n cells, from 0 to 1. As a group it is a row of numbers like any other; with
`images_apart` environments show it as a uint8 `Box` (channels, rows, columns).
"""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env.observation.block import Feature, ObservationBlock
from uas_coverage_env.geometry.segments import signed_distance
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world.coverage import can_cover

_CHANNELS = (
    ("open", "open waypoints that it can cover: weight / heaviest of the scenario"),
    ("blocked", "1 for fixed obstacles at its height, and outside of the fence"),
    ("others", "1 for other flying UAS"),
    ("moving", "1 for moving obstacles at its height, 0.5 for those above or below"),
    ("home", "1 for its start; at the edge where that is beyond"),
)
_OPEN, _BLOCKED, _OTHERS, _MOVING, _HOME = range(len(_CHANNELS))
_LEAST, _MOST = 4, 128


@inlined_kernel
def _index(away_m, cell_m, n):
    """The row or column of what lies so far from the first edge, or beyond: -1 or n."""
    return int(min(max(math.floor(away_m / cell_m), -1), n))


@inlined_kernel
def _mark(row, channel, n, r, c, value):
    """Write a cell, if it is one; the larger value stays."""
    if 0 <= r < n and 0 <= c < n:
        at = (channel * n + r) * n + c
        row[at] = max(row[at], value)


@kernel
def _block(arena, i, n, cell_m, top_m, left_m, z, row):
    """Mark fixed obstacles and the outside of the fence."""
    radius_m = arena.uas[i].radius_m
    rules = arena.rules[0]
    for r in range(n):
        north_m = top_m - (r + 0.5) * cell_m
        for c in range(n):
            east_m = left_m + (c + 0.5) * cell_m
            outside_m = signed_distance(
                arena.normals, arena.offsets_m, rules.fence_first, rules.fence_last,
                north_m, east_m, z,
            )  # fmt: skip
            if outside_m > 0.0:
                _mark(row, _BLOCKED, n, r, c, 1.0)
    # half a cell more: what is narrower than a cell does not fall between two centres
    reach_m = radius_m + 0.5 * cell_m
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        middle_m = obstacle.hull_middle_m
        half_m = obstacle.hull_half_m
        if abs(z - middle_m[2]) > half_m[2] + radius_m:
            continue
        first_r = max(0, _index(top_m - middle_m[0] - half_m[0] - reach_m, cell_m, n))
        last_r = min(n - 1, _index(top_m - middle_m[0] + half_m[0] + reach_m, cell_m, n))
        first_c = max(0, _index(middle_m[1] - half_m[1] - reach_m - left_m, cell_m, n))
        last_c = min(n - 1, _index(middle_m[1] + half_m[1] + reach_m - left_m, cell_m, n))
        for r in range(first_r, last_r + 1):
            north_m = top_m - (r + 0.5) * cell_m
            for c in range(first_c, last_c + 1):
                east_m = left_m + (c + 0.5) * cell_m
                away_m = signed_distance(
                    arena.normals, arena.offsets_m, obstacle.first_face, obstacle.last_face,
                    north_m, east_m, z,
                )  # fmt: skip
                if away_m < reach_m:
                    _mark(row, _BLOCKED, n, r, c, 1.0)


@kernel
def _write(arena, state, tables, learners, i, parameters, row):
    n = int(parameters[0])
    cell_m = parameters[1] / n
    x = state.x[i]
    top_m = x[S.X] + 0.5 * parameters[1]
    left_m = x[S.Y] - 0.5 * parameters[1]
    for k in range(row.shape[0]):
        row[k] = 0.0
    for w in range(state.uncovered.shape[0]):
        if state.uncovered[w] and can_cover(arena, i, w):
            waypoint = arena.waypoints[w]
            r = _index(top_m - waypoint.position_m[0], cell_m, n)
            c = _index(waypoint.position_m[1] - left_m, cell_m, n)
            _mark(row, _OPEN, n, r, c, min(1.0, waypoint.weight * tables.scales[i].per_heaviest))
    _block(arena, i, n, cell_m, top_m, left_m, x[S.Z], row)
    for j in range(state.uas.shape[0]):
        if j != i and state.uas[j].status == FLYING:
            r = _index(top_m - state.x[j, S.X], cell_m, n)
            c = _index(state.x[j, S.Y] - left_m, cell_m, n)
            _mark(row, _OTHERS, n, r, c, 1.0)
    sample = min(state.step[0], arena.moving_path_m.shape[0] - 1)
    for m in range(arena.moving.shape[0]):
        centre_m = arena.moving_path_m[sample, m]
        body = arena.moving[m]
        beside_m = body.radius_m + arena.uas[i].radius_m + 0.5 * cell_m
        level = abs(x[S.Z] - centre_m[2]) <= body.half_height_m + arena.uas[i].radius_m
        first_r = max(0, _index(top_m - centre_m[0] - beside_m, cell_m, n))
        last_r = min(n - 1, _index(top_m - centre_m[0] + beside_m, cell_m, n))
        first_c = max(0, _index(centre_m[1] - beside_m - left_m, cell_m, n))
        last_c = min(n - 1, _index(centre_m[1] + beside_m - left_m, cell_m, n))
        for r in range(first_r, last_r + 1):
            dx = top_m - (r + 0.5) * cell_m - centre_m[0]
            for c in range(first_c, last_c + 1):
                dy = left_m + (c + 0.5) * cell_m - centre_m[1]
                if dx * dx + dy * dy < beside_m * beside_m:
                    _mark(row, _MOVING, n, r, c, 1.0 if level else 0.5)
    home_m = arena.uas[i].home_m
    r = min(max(_index(top_m - home_m[0], cell_m, n), 0), n - 1)
    c = min(max(_index(home_m[1] - left_m, cell_m, n), 0), n - 1)
    _mark(row, _HOME, n, r, c, 1.0)


def grid(cells: int = 36, span_m: float = 180.0) -> ObservationBlock:
    """A picture around the UAS.

    Args:
        cells: Rows and columns, 4 to 128; 36 are the fewest that `CnnPolicy` of Stable-Baselines3
            takes.
        span_m: Side of the picture on the ground [m].

    Raises:
        ValueError: A number is not what it should be.
    """
    if type(cells) is not int or not _LEAST <= cells <= _MOST:
        raise ValueError(f"cells is {cells!r}; give a whole number from {_LEAST} to {_MOST}")
    if not isinstance(span_m, int | float) or not span_m > 0.0:
        raise ValueError(f"span_m is {span_m!r}; give metres above zero")
    return ObservationBlock(
        "grid",
        1,
        tuple(Feature(name, cells * cells, 0, 1, meaning) for name, meaning in _CHANNELS),
        _write,
        (float(cells), float(span_m)),
        shape=(len(_CHANNELS), cells, cells),
    )

"""The observations of all UAS, compiled; what the numbers mean is in `layout`.

One function per group of `OBSERVATION_LAYOUT`, in its order. Each writes its numbers into a row
from column k on and returns the column after its last.
"""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.borrow import part
from uas_coverage_env.env.layout import FAR_M, HEIGHT_M, MARGIN, OBSERVATION_LAYOUT
from uas_coverage_env.env.nearest import moving_obstacles, nearest_waypoints, others, waypoints
from uas_coverage_env.env.relative import charge_left, close, direction, within
from uas_coverage_env.env.surroundings import surroundings
from uas_coverage_env.kernels import counting_kernel, inlined_kernel, kernel, room
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import (
    DOD,
    PHI,
    PSI,
    THETA,
    U_TH,
    VX,
    VY,
    VZ,
    WX,
    WY,
    WZ,
    X,
    Y,
    Z,
)
from uas_coverage_env.world import FLYING, HOME
from uas_coverage_env.world.arena import ALL_SHARES
from uas_coverage_env.world.guidance import target_position
from uas_coverage_env.world.routes import shortest_way

_OWN_SIZE = OBSERVATION_LAYOUT[0].size
_HOME_SIZE = OBSERVATION_LAYOUT[1].size
_REMAINING_SIZE = OBSERVATION_LAYOUT[2].size
_N_SECTORS = 8
_N_SUMS = _N_SECTORS + 2

SCALES_DTYPE = np.dtype(
    (
        np.record,
        np.dtype(
            [
                # one over the limits of the vehicle
                ("per_v_xy", "f8"),
                ("per_v_z", "f8"),
                ("per_tilt", "f8"),
                ("per_yaw", "f8"),
                ("per_rate", "f8"),
                ("per_yaw_rate", "f8"),
                ("rank", "f8"),
                # the box around the fence: its centre and one over half its sides
                ("centre_m", "f8", (3,)),
                ("per_half_side", "f8", (3,)),
                # one over the heaviest weight
                ("per_heaviest", "f8"),
            ],
            align=True,
        ),
    )
)
"""What one UAS's numbers are divided by."""


def scales_of(scenario: Scenario) -> NDArray[np.void]:
    """The scales of all UAS.

    Returns:
        (U,) of SCALES_DTYPE.
    """
    corners_m = scenario.fence.vertices_m
    low_m, high_m = corners_m.min(axis=0), corners_m.max(axis=0)
    weights = [waypoint.weight for waypoint in scenario.waypoints]
    scales = np.zeros(len(scenario.uas), dtype=SCALES_DTYPE)
    for i, (scale, vehicle) in enumerate(zip(scales, scenario.vehicles, strict=True)):
        limits = vehicle.limits
        scale["per_v_xy"] = 1 / limits.v_xy_max_mps
        scale["per_v_z"] = 1 / max(limits.v_up_max_mps, limits.v_down_max_mps)
        scale["per_tilt"] = 1 / limits.tilt_max_rad
        scale["per_yaw"] = 1 / limits.yaw_max_rad
        scale["per_rate"] = 1 / limits.rate_max_radps
        scale["per_yaw_rate"] = 1 / limits.yaw_rate_max_radps
        scale["rank"] = i / max(1, len(scales) - 1)
        scale["centre_m"] = (low_m + high_m) / 2
        scale["per_half_side"] = 2 / (high_m - low_m)
        scale["per_heaviest"] = 1 / max(weights)
    return scales


@kernel
def observe(arena, state, scales, company, sees, targets, max_cycles, candidates, observation):
    """Write the observations of those UAS that are to see.

    Args:
        arena: The arena.
        state: The state of the world.
        scales: (U,) of SCALES_DTYPE.
        company: (W, 2) see `count_company`.
        sees: (U,) whose observations are written; those of the others stay.
        targets: (U,) where each is flying to; NO_TARGET where unknown.
        max_cycles: Steps after which the episode is cut.
        candidates: (U, K_WAYPOINTS) the open waypoints in the order of the observation; -1 where
            there is none; written.
        observation: (U, OBSERVATION_SIZE) float32; written.
    """
    for i in range(state.status.shape[0]):
        if sees[i]:
            look(
                arena, state, scales[i], company, i, targets, max_cycles, candidates[i],
                observation[i],
            )  # fmt: skip


@inlined_kernel
def look(arena, state, scale, company, i, targets, max_cycles, candidates, row):
    """Write the observation of UAS i; scale, candidates and row are its own, see `observe`."""
    nearest_waypoints(arena, state, i, candidates)
    home_dod = _home(arena, state, i, row, _OWN_SIZE)
    k = _OWN_SIZE + _HOME_SIZE
    left = _remaining(arena, state, i, row, k)
    k = _own(arena, state, scale, i, home_dod, left, max_cycles, row, 0)
    k += _HOME_SIZE + _REMAINING_SIZE
    k = surroundings(arena, state, i, row, k)
    k = waypoints(arena, state, scale, company, i, targets, candidates, row, k)
    k = others(arena, state, scale, i, row, k)
    moving_obstacles(arena, state, scale, i, row, k)


@inlined_kernel
def _own(arena, state, scale, i, home_dod, left, max_cycles, row, k):
    x = state.x[i]
    row[k] = within((x[X] - scale.centre_m[0]) * scale.per_half_side[0], -1.0, 1.0)
    row[k + 1] = within((x[Y] - scale.centre_m[1]) * scale.per_half_side[1], -1.0, 1.0)
    row[k + 2] = within((scale.centre_m[2] - x[Z]) * scale.per_half_side[2], -1.0, 1.0)
    row[k + 3] = within(x[VX] * scale.per_v_xy, -2.0, 2.0)
    row[k + 4] = within(x[VY] * scale.per_v_xy, -2.0, 2.0)
    row[k + 5] = within(x[VZ] * scale.per_v_z, -2.0, 2.0)
    row[k + 6] = within(x[PHI] * scale.per_tilt, -2.0, 2.0)
    row[k + 7] = within(x[THETA] * scale.per_tilt, -2.0, 2.0)
    row[k + 8] = within(x[PSI] * scale.per_yaw, -2.0, 2.0)
    row[k + 9] = within(x[WX] * scale.per_rate, -2.0, 2.0)
    row[k + 10] = within(x[WY] * scale.per_rate, -2.0, 2.0)
    row[k + 11] = within(x[WZ] * scale.per_yaw_rate, -2.0, 2.0)
    row[k + 12] = within(state.reference[i, 0] * scale.per_v_xy, -2.0, 2.0)
    row[k + 13] = within(state.reference[i, 1] * scale.per_v_xy, -2.0, 2.0)
    row[k + 14] = 1.0 if state.status[i] == FLYING else 0.0
    row[k + 15] = 1.0 if state.departed[i] else 0.0
    row[k + 16] = 1.0 if state.returning[i] else 0.0
    row[k + 17] = scale.rank
    row[k + 18] = within(x[DOD], 0.0, 1.0)
    row[k + 19] = within(x[U_TH], -1.0, 1.0)
    row[k + 20] = charge_left(arena, state, i)
    row[k + 21] = within((arena.uas[i].dod_max - x[DOD] - home_dod) / MARGIN, -1.0, 1.0)
    row[k + 22] = within((max_cycles - state.step[0]) / max_cycles, 0.0, 1.0)
    row[k + 23] = within(left, 0.0, 1.0)
    return k + 24


@inlined_kernel
def _home(arena, state, i, row, k):
    """Write where home is; returns the depth of discharge that the way there costs."""
    uas = arena.uas[i]
    x = state.x[i, X]
    y = state.x[i, Y]
    z = state.x[i, Z]
    target, x1, y1, z1 = target_position(arena, i, HOME)
    leg_x, leg_y, way_m = shortest_way(arena, target, x, y, z, x1, y1, z1)
    direction(leg_x - x, leg_y - y, row, k)
    row[k + 2] = close(way_m)
    row[k + 3] = within((z1 - z) * (1.0 / HEIGHT_M), -1.0, 1.0)
    return (way_m / uas.speed_mps + max(0.0, z1 - z) / uas.descent_mps) * uas.dod_per_s


@inlined_kernel
def _way(here_m, there_m):
    # not in `_add_open` itself: this is no whole number, and its order of operations has to stay
    return there_m - here_m


@counting_kernel
def _add_open(north_m, east_m, shares, shares_north, shares_east, uncovered, x, y, sums):
    """Add up the open waypoints: shares in each eighth of the horizon, and times north and east.

    The eighths go from north over east. Three questions tell in which one a waypoint lies: is it in
    the first half, in the first quarter of its half, in the first eighth of its quarter? To compare
    takes the processor longer than to add, so the sums are those over each combination of yes; the
    eighths follow from them.
    """
    every = half = quarter = eighth = half_quarter = half_eighth = quarter_eighth = all_three = 0.0
    north = east = 0.0
    for w in range(uncovered.shape[0]):
        share = shares[w] if uncovered[w] else 0.0
        dx = _way(x, north_m[w])
        dy = _way(y, east_m[w])
        in_half = dy >= 0.0
        in_quarter = (in_half & (dx > 0.0)) | ((dy < 0.0) & (dx < 0.0))
        in_eighth = (in_quarter & (abs(dy) < abs(dx))) | ((not in_quarter) & (abs(dx) < abs(dy)))
        every += share
        half += share if in_half else 0.0
        quarter += share if in_quarter else 0.0
        eighth += share if in_eighth else 0.0
        half_quarter += share if in_half & in_quarter else 0.0
        half_eighth += share if in_half & in_eighth else 0.0
        quarter_eighth += share if in_quarter & in_eighth else 0.0
        all_three += share if in_half & in_quarter & in_eighth else 0.0
        north += shares_north[w] if uncovered[w] else 0.0
        east += shares_east[w] if uncovered[w] else 0.0
    sums[0] = all_three
    sums[1] = half_quarter - all_three
    sums[2] = half_eighth - all_three
    sums[3] = half - half_quarter - half_eighth + all_three
    sums[4] = quarter_eighth - all_three
    sums[5] = quarter - half_quarter - quarter_eighth + all_three
    sums[6] = eighth - half_eighth - quarter_eighth + all_three
    sums[7] = every - half - quarter - eighth
    sums[7] += half_quarter + half_eighth + quarter_eighth - all_three
    sums[8] = north
    sums[9] = east


@inlined_kernel
def _remaining(arena, state, i, row, k):
    """Write where the open weight lies; returns its share of all weight."""
    x = state.x[i, X]
    y = state.x[i, Y]
    n = state.uncovered.shape[0]
    columns = arena.waypoint_columns
    sums = room(_N_SUMS)
    _add_open(
        part(columns, 0, n),
        part(columns, n, n),
        part(columns, 5 * n, n),
        part(columns, 6 * n, n),
        part(columns, 7 * n, n),
        state.uncovered, x, y, sums,
    )  # fmt: skip
    left = 0.0
    for s in range(_N_SECTORS):
        left += sums[s]
    per_share = 1.0 / left if left > 0.0 else 0.0
    for s in range(_N_SECTORS):
        row[k + s] = within(sums[s] * per_share, 0.0, 1.0)
    there = 1.0 if left > 0.0 else 0.0
    to_m = per_share * arena.rules[0].unit_m
    row[k + 8] = within((sums[8] * to_m - there * x) * (1.0 / FAR_M), -1.0, 1.0)
    row[k + 9] = within((sums[9] * to_m - there * y) * (1.0 / FAR_M), -1.0, 1.0)
    return left * (1.0 / ALL_SHARES)

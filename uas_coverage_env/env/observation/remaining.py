"""Where the weight of the open waypoints lies."""

from uas_coverage_env.compiled.kernels import counting_kernel, inlined_kernel
from uas_coverage_env.compiled.views import slice_view
from uas_coverage_env.env.observation.block import Feature, Group, ObservationBlock
from uas_coverage_env.env.observation.notes import EAST, N_SECTORS, NORTH
from uas_coverage_env.env.observation.relative import within
from uas_coverage_env.env.observation.scales import FAR_M
from uas_coverage_env.vehicle.layout import X, Y
from uas_coverage_env.world.waypoints import (
    ALL_SHARES,
    EAST_M,
    NORTH_M,
    SHARE,
    SHARE_EAST,
    SHARE_NORTH,
)

_N_NE, _NE_E, _E_SE, _SE_S, _S_SW, _SW_W, _W_NW, _NW_N = range(N_SECTORS)  # from, to

_FEATURES = (
    Feature("sectors", 8, 0, 1, "share of the open weight in 45° from north over east"),
    Feature("centre", 2, -1, 1, "north and east to the centre of the open weight / 250 m"),
)

_AT = Group("remaining", 1, _FEATURES).columns


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
    sums[_N_NE] = all_three
    sums[_NE_E] = half_quarter - all_three
    sums[_E_SE] = half_eighth - all_three
    sums[_SE_S] = half - half_quarter - half_eighth + all_three
    sums[_S_SW] = quarter_eighth - all_three
    sums[_SW_W] = quarter - half_quarter - quarter_eighth + all_three
    sums[_W_NW] = eighth - half_eighth - quarter_eighth + all_three
    sums[_NW_N] = every - half - quarter - eighth
    sums[_NW_N] += half_quarter + half_eighth + quarter_eighth - all_three
    sums[NORTH] = north
    sums[EAST] = east


@inlined_kernel
def note_open_weight(arena, state, tables, learners, i):
    """Note where the weight of the open waypoints lies, and what share of all it is."""
    notes = learners.notes[i]
    sums = notes.open_sums
    n = state.uncovered.shape[0]
    columns = arena.waypoint_columns
    _add_open(
        slice_view(columns[NORTH_M], 0, n),
        slice_view(columns[EAST_M], 0, n),
        slice_view(columns[SHARE], 0, n),
        slice_view(columns[SHARE_NORTH], 0, n),
        slice_view(columns[SHARE_EAST], 0, n),
        state.uncovered, state.x[i, X], state.x[i, Y], sums,
    )  # fmt: skip
    left = 0.0
    for s in range(N_SECTORS):
        left += sums[s]
    notes.open_share = left * (1.0 / ALL_SHARES)


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, row):
    """Write the group, see `ObservationBlock`."""
    sums = learners.notes[i].open_sums
    left = 0.0
    for s in range(N_SECTORS):
        left += sums[s]
    per_share = 1.0 / left if left > 0.0 else 0.0
    for s in range(N_SECTORS):
        row[_AT.sectors + s] = within(sums[s] * per_share, 0.0, 1.0)
    there = 1.0 if left > 0.0 else 0.0
    to_m = per_share * arena.rules[0].unit_m
    north_m = sums[NORTH] * to_m - there * state.x[i, X]
    east_m = sums[EAST] * to_m - there * state.x[i, Y]
    row[_AT.centre] = within(north_m * (1.0 / FAR_M), -1.0, 1.0)
    row[_AT.centre + 1] = within(east_m * (1.0 / FAR_M), -1.0, 1.0)


REMAINING = ObservationBlock("remaining", 1, _FEATURES, write, needs=(note_open_weight,))

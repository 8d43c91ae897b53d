"""What it costs to land while there is work that one could have done."""

from uas_coverage_env.compiled.kernels import inlined_kernel, rare_kernel
from uas_coverage_env.env.ways import seconds_home_from, seconds_there
from uas_coverage_env.world.coverage import can_cover


@inlined_kernel
def left_open(arena, state, tables, learners, scratch, i, parameters):
    """Minus the share of all weight that is open when it lands, and in reach of its start."""
    return -_share_in_reach(arena, state, tables, i) if scratch.outcome[i].landed else 0.0


@rare_kernel
def _share_in_reach(arena, state, tables, i):
    """Share of all weight that is open, and where it could have flown from its start and back.

    With the charge of its start, whatever is left of it: so it does not pay to hover until there is
    none.
    """
    uas = arena.uas[i]
    start_m = uas.home_m
    charge_s = (uas.dod_max - tables.scales[i].start_dod) / uas.dod_per_s
    total = 0.0
    in_reach = 0.0
    for w in range(state.uncovered.shape[0]):
        weight = arena.waypoints[w].weight
        total += weight
        if state.uncovered[w] and can_cover(arena, i, w):
            _, there_s = seconds_there(arena, i, w, start_m[0], start_m[1], start_m[2])
            if there_s + seconds_home_from(arena, i, w) <= charge_s:
                in_reach += weight
    return in_reach / total

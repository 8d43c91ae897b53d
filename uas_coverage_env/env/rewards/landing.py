"""What landing is worth: what the swarm has covered in the end, whichever UAS lands first.

A UAS that lands is paid at once for what is covered, and pays for what is open; then its flight is
over. Who covers a waypoint later is paid that share once more for each UAS that is home. So the sum
over the swarm depends on how the mission ends, not on the order in which its UAS come home.
"""

from uas_coverage_env.compiled.kernels import inlined_kernel, rare_kernel
from uas_coverage_env.entities.state import LANDED
from uas_coverage_env.env.rewards.terms import covered_share
from uas_coverage_env.env.ways import seconds_home_from, seconds_there
from uas_coverage_env.world.coverage import can_cover


@inlined_kernel
def home_in_the_end(arena, state, tables, learners, scratch, i, parameters):
    """Share covered when it lands; and what it covers, for each that was home before."""
    value = covered_share(arena, state) if scratch.outcome[i].landed else 0.0
    return value + _covered_for_those_home(arena, state, scratch, i)


@inlined_kernel
def left_open(arena, state, tables, learners, scratch, i, parameters):
    """Minus the share open and in reach when it lands; what it covers, for each home before."""
    value = _covered_for_those_home(arena, state, scratch, i)
    if scratch.outcome[i].landed:
        value -= _share_in_reach(arena, state, tables)
    return value


@inlined_kernel
def _covered_for_those_home(arena, state, scratch, i):
    """Share of all weight that it covered in this step, times the UAS that were home before."""
    weight = scratch.outcome[i].newly_covered_weight
    return _times_home(arena, state, scratch, weight) if weight > 0.0 else 0.0


@rare_kernel
def _times_home(arena, state, scratch, weight):
    n_home = 0
    for j in range(state.uas.shape[0]):
        n_home += state.uas[j].status == LANDED and not scratch.outcome[j].landed
    total = 0.0
    for w in range(state.uncovered.shape[0]):
        total += arena.waypoints[w].weight
    return n_home * weight / total


@rare_kernel
def _share_in_reach(arena, state, tables):
    """Share of all weight that is open, and where a UAS could have flown from its start and back.

    With the charge of its start, whatever is left of it: so it does not pay to hover until there is
    none.
    """
    total = 0.0
    in_reach = 0.0
    for w in range(state.uncovered.shape[0]):
        weight = arena.waypoints[w].weight
        total += weight
        if state.uncovered[w] and _is_in_reach(arena, state, tables, w):
            in_reach += weight
    return in_reach / total


@rare_kernel
def _is_in_reach(arena, state, tables, w):
    for i in range(state.uas.shape[0]):
        uas = arena.uas[i]
        start_m = uas.start_m
        charge_s = (uas.dod_max - tables.scales[i].start_dod) / uas.dod_per_s
        if can_cover(arena, i, w):
            _, there_s = seconds_there(arena, i, w, start_m[0], start_m[1], start_m[2])
            if there_s + seconds_home_from(arena, i, w) <= charge_s:
                return True
    return False

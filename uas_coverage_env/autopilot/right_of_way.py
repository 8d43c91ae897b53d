"""Right of way: UAS in return mode go first, and the others keep their paths clear.

A UAS that only waits until the others let it pass may wait until its battery is empty. So the UAS
decide in a fixed order, those on their way home first, by index; and each of these claims the way
that it would fly if no other UAS were there: its command held for some seconds, then braking. Those
that decide later keep out of the claimed ways as well as they safely can (`safety`); those that are
on their way home themselves only out of that of one that is held up. A claim is no obstacle: no UAS
gives up its room for braking because of it.
"""

import math

from uas_coverage_env.autopilot.evasion import LINGERING
from uas_coverage_env.autopilot.lookahead import fly_and_brake, separation_at
from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.entities.state import FLYING

CLAIMED_S = 5.0
"""For how long a UAS on its way home claims to go on as it wishes now [s]; then it brakes. Chosen
by hand; `benchmarks/right_of_way.py` shows which UAS come home."""

ELBOW_ROOM_M = 1.0
"""What claimed ways are kept clear of, beyond the distance that counts as a breach, at scale 1 [m]:
the next command home is not quite the one that was claimed."""


@kernel
def decision_order(state, order):
    """The order in which UAS decide.

    Written to `order` (U,): the indices of the flying UAS, those in return mode first.

    Returns:
        (flying, returning): how many they are.
    """
    n_flying = 0
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == FLYING and state.uas[i].returning:
            order[n_flying] = i
            n_flying += 1
    n_returning = n_flying
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == FLYING and not state.uas[i].returning:
            order[n_flying] = i
            n_flying += 1
    return n_flying, n_returning


@kernel
def claim_way(arena, state, i, command, nonlinear, claim_m):
    """Write the way (N+1, 3) [m] that UAS i would fly now if no other UAS were there."""
    n_held = max(1, round(CLAIMED_S / arena.rules[0].dt_s))
    x, reference, belief = state.x[i], state.uas[i].reference_mps[:], state.uas[i].belief[:]
    fly_and_brake(arena, i, x, reference, command, nonlinear, claim_m, belief, n_held, -math.inf)


@kernel
def room_beside(arena, i, path_m, claimants, n_claims, claims_m):
    """How well a path keeps clear of the claimed ways, flown at the same time [m].

    Room is to be made for the first n_claims of the claimants (U,), whose ways are claims_m
    (U, N+1, 3), by the index of the UAS.

    Returns:
        The least room to spare along the path, at most the elbow room; where it is negative, less a
        little for every step with too little room, so that leaving early is better than late.
    """
    n_steps = path_m.shape[0] - 1
    elbow_room_m = arena.rules[0].length_scale * ELBOW_ROOM_M
    least_m, shortfall_m = elbow_room_m, 0.0
    for c in range(n_claims):
        other = claimants[c]
        way_m = claims_m[other]
        radii_m = arena.uas[i].radius_m + arena.uas[other].radius_m
        required_m = radii_m + arena.rules[0].uas_safe_distance_m + elbow_room_m
        for k in range(n_steps):
            room_m = separation_at(path_m, way_m, k) - required_m
            least_m = min(least_m, room_m)
            shortfall_m += min(room_m, 0.0)
    return least_m + LINGERING * shortfall_m / n_steps

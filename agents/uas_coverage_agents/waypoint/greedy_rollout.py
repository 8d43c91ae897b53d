"""How a mission would continue if all UAS acted greedily: the cost-to-go of a choice.

A UAS that becomes free takes the nearest waypoint that is left, or flies home where its battery
and the clock leave no other. Reckoned with leg times alone, it takes microseconds, and it tells
one choice from another the better the fewer waypoints are left.
"""

import math

from uas_coverage_env.compiled.kernels import allocating_kernel

ABSENT = -2
"""Place of a UAS that covers no more."""

IN_THE_AIR = -1
"""Place of a UAS that covers, but has no target yet."""


@allocating_kernel
def greedy_rollout(legs, from_s, here_home_s, budget_s, ready_s, place, todo, n_todo):
    """Let every UAS go on greedily until nothing is left.

    Args:
        legs: `Legs`.
        from_s: (U, W) [s] to the waypoints, of those that are IN_THE_AIR.
        here_home_s: (U,) [s] home, of those that are IN_THE_AIR.
        budget_s: (U,) [s] flying time that battery and clock still allow.
        ready_s: (U,) [s] until each is free; of those that are ABSENT, until they land; written.
        place: (U,) waypoint at which each is free, IN_THE_AIR or ABSENT; written.
        todo: (W,) waypoints that are left; written.
        n_todo: How many of them.

    Returns:
        (flying time of all [s], longest flight [s], number of waypoints that no UAS reaches).
    """
    total_s = 0.0
    longest_s = 0.0
    n_uas = place.shape[0]
    for j in range(n_uas):
        if place[j] == ABSENT:
            total_s += ready_s[j]
            longest_s = max(longest_s, ready_s[j])
    while n_todo > 0:
        j = -1
        soonest_s = math.inf
        for k in range(n_uas):
            if place[k] != ABSENT and ready_s[k] < soonest_s:
                soonest_s = ready_s[k]
                j = k
        if j < 0:
            break
        row = from_s[j] if place[j] == IN_THE_AIR else legs.between_s[place[j]]
        nearest_s = math.inf
        at = -1
        for t in range(n_todo):
            if row[todo[t]] < nearest_s:
                nearest_s = row[todo[t]]
                at = t
        w = todo[at]
        if ready_s[j] + nearest_s + legs.return_s[j, w] > budget_s[j]:
            home_s = here_home_s[j] if place[j] == IN_THE_AIR else legs.home_s[j, place[j]]
            total_s += ready_s[j] + home_s
            longest_s = max(longest_s, ready_s[j] + home_s)
            place[j] = ABSENT
            continue
        ready_s[j] += nearest_s
        place[j] = w
        n_todo -= 1
        todo[at] = todo[n_todo]
    for j in range(n_uas):
        if place[j] != ABSENT:
            home_s = here_home_s[j] if place[j] == IN_THE_AIR else legs.home_s[j, place[j]]
            total_s += ready_s[j] + home_s
            longest_s = max(longest_s, ready_s[j] + home_s)
    return total_s, longest_s, n_todo

"""Routes made cheaper, by the clock by which they were built.

A change turns a part of a route round, or moves up to three waypoints to another place in their
route or in that of another UAS. What makes the mission cheaper is kept; so is, less and less often,
what makes it a little costlier (simulated annealing). The network builds routes one choice after
the other; a change is judged by whole routes.
"""

import math

import numpy as np

from uas_coverage_agents.route.clock import IN_THE_AIR, home_seconds, leg_seconds
from uas_coverage_env.compiled.kernels import allocating_kernel

CHANGES = 20_000
"""Changes that are tried."""

_TURNED = 0.4  # how often a change turns a part round
_MOST_MOVED = 3
_PLACES = 6  # that are drawn; the nearest of them is tried
_HEAT = 0.3  # of the mean leg to a nearest neighbour, at first


@allocating_kernel
def _route_s(mission, u, route, n, spare_s):
    """Time [s] of a whole route; inf if it lasts too long, or what is late does not come last."""
    if n == 0:
        return mission.here_home_s[u] if mission.may[u] else 0.0
    place, before_m, late, time_s = IN_THE_AIR, mission.here_m[u], False, 0.0
    for k in range(n):
        w = route[k]
        if late and not mission.late[w]:
            return np.inf
        late = mission.late[w]
        time_s += leg_seconds(mission, u, place, before_m, w)
        before_m = mission.here_m[u] if place == IN_THE_AIR else mission.place_m[place]
        place = w
    time_s += home_seconds(mission, u, place, before_m)
    return time_s if time_s + spare_s <= mission.budget_s[u] else np.inf


@allocating_kernel
def _turn_round(route, n, first, rng, changed):
    """Write a route with a part from `first` on turned round; short parts are likelier."""
    last = min(n - 1, first + 1 + int(rng.random() ** 2 * n))
    changed[:n] = route[:n]
    for k in range(last - first + 1):
        changed[first + k] = route[last - k]


@allocating_kernel
def _near_place(mission, v, route, n, w, rng):
    """A place in the route of UAS v before which waypoint w is not far from where it comes from."""
    found, found_s = 0, np.inf
    for _ in range(_PLACES):
        at = int(rng.random() * (n + 1))
        leg_s = mission.from_s[v, w] if at == 0 else mission.between_s[route[at - 1], w]
        if leg_s < found_s:
            found, found_s = at, leg_s
    return found


@allocating_kernel
def _insert(route, n, part, size, at, rng, changed):
    """Write a route with a part inserted at a place, in one direction or the other."""
    turned = rng.random() < 0.5
    changed[:at] = route[:at]
    for k in range(size):
        changed[at + k] = part[size - 1 - k] if turned else part[k]
    changed[at + size : n + size] = route[at:n]


@allocating_kernel
def _cost_s(mission, time_s, u, u_s, v, v_s):
    """Cost [s] of the mission if the routes of UAS u and v took so long."""
    longest_s, total_s = 0.0, 0.0
    for j in range(time_s.shape[0]):
        this_s = u_s if j == u else (v_s if j == v else time_s[j])
        longest_s = max(longest_s, this_s)
        total_s += this_s
    return longest_s + mission.weight * total_s


@allocating_kernel
def improve(mission, changes, spare_s, rng, routes, lengths):
    """Make the routes of all UAS cheaper.

    Args:
        mission: `Mission`.
        changes: How many are tried.
        spare_s: Flying time [s] that is left at least.
        rng: Of the changes.
        routes: (U, W) the first `lengths` of each, written.
        lengths: (U,) written.
    """
    n_uas = routes.shape[0]
    time_s = np.empty(n_uas)
    for u in range(n_uas):
        time_s[u] = _route_s(mission, u, routes[u], lengths[u], spare_s)
    cost_s = best_s = _cost_s(mission, time_s, 0, time_s[0], 0, time_s[0])
    if cost_s == np.inf:
        return
    best_routes, best_lengths = routes.copy(), lengths.copy()
    rest, longer, part = routes[0].copy(), routes[0].copy(), np.empty(_MOST_MOVED, np.int64)
    for change in range(changes):
        u = int(rng.random() * n_uas)
        n = lengths[u]
        if n == 0:
            continue
        first, v = int(rng.random() * n), u
        if rng.random() < _TURNED:
            size, n_longer = 0, n
            _turn_round(routes[u], n, first, rng, longer)
        else:
            if rng.random() < 0.5:
                v = int(rng.random() * n_uas)
            if not mission.may[v]:
                continue
            size = min(1 + int(rng.random() * _MOST_MOVED), n - first)
            part[:size] = routes[u, first : first + size]
            rest[:first] = routes[u, :first]
            rest[first : n - size] = routes[u, first + size : n]
            into, n_into = (rest, n - size) if v == u else (routes[v], lengths[v])
            at = _near_place(mission, v, into, n_into, part[0], rng)
            _insert(into, n_into, part, size, at, rng, longer)
            n_longer = n_into + size
        v_s = _route_s(mission, v, longer, n_longer, spare_s)
        u_s = v_s if v == u else _route_s(mission, u, rest, n - size, spare_s)
        new_s = _cost_s(mission, time_s, u, u_s, v, v_s)
        heat_s = _HEAT * mission.unit_s * (1.0 - change / changes)
        if new_s > cost_s and rng.random() >= math.exp((cost_s - new_s) / heat_s):
            continue
        cost_s, time_s[u], time_s[v] = new_s, u_s, v_s
        if v != u:
            routes[u, : n - size], lengths[u] = rest[: n - size], n - size
        routes[v, :n_longer], lengths[v] = longer[:n_longer], n_longer
        if cost_s < best_s:
            best_s = cost_s
            best_routes[:], best_lengths[:] = routes, lengths
    routes[:], lengths[:] = best_routes, best_lengths

"""The routes of all UAS, built together: whoever is free first takes its next waypoint.

The clock runs in estimated leg times, not in flights, so that whole routes are built in about a
millisecond. All UAS share it: each choice sees where the others will be, and what they have left.
A network scores each of the nearest waypoints, and home. `trajectory`'s routes, replayed by the
same clock, are what it was trained on.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.route.layers import value_of
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.planning.reserves import LEARNED_ROUTE
from uas_coverage_env.planning.routing.route_time import turn_s

DONE, IN_THE_AIR = -2, -1
"""Places: of a UAS that flies home and no more, and of one that is at no waypoint."""

WEIGHT = 0.6
"""Of a second of any flight against one of the longest: the default of `trajectory`."""

K = 12
"""Nearest open waypoints that are scored; the last choice is home."""

HOME_CHOICE = K

(
    N_OPEN, PER_UAS, MATES, ALONE, OTHERS_FREE, IN_AIR, MORE_TOTAL, MORE_LONGEST, FIRST_LEG,
    OFF_CENTRE,
) = range(10)  # fmt: skip
"""Columns of what is read about each choice; `layout` says what they mean."""

(
    LEG, MORE_LEG, COSINE, SINE, LEG_HOME, MATE_LATER, NEAREST, SECOND_NEAREST, NEAR, AROUND,
    ONE_SIDED, FROM_CENTRE, BEHIND, IS_NEAREST, IS_BEST, RANK, TWO_LEGS, MATE_SOONER,
    MORE_LEFT, CLOSER_HOME,
) = range(10, 30)  # fmt: skip
"""The others of a waypoint."""

WAY_HOME, MATE_FREE, TIME_LEFT, ENOUGH_MATES = range(10, 14)
"""The others of home, where the rest is 0."""

N_ORDER = CLOSER_HOME + 1
"""Numbers that are read about each choice."""

_SPARE_S = LEARNED_ROUTE.spare_s  # not counted in the time left that the networks read
_LEFT_OUT_S = 300.0


@allocating_kernel
def leg_seconds(task, u, place, before, w):
    """Time [s] of UAS u from its place to waypoint w, the turn at the place included.

    Args:
        task: `RoutingArrays`.
        u: Index of the UAS.
        place: Waypoint where it is, or IN_THE_AIR.
        before: Where it comes from, a row of `task.place`.
        w: The waypoint.
    """
    if place == IN_THE_AIR:
        return task.first[u, w]
    return max(task.between[task.uas[u].kind, place, w] + turn_s(task, u, before, place, w), 0.1)


@allocating_kernel
def home_seconds(task, u, place, before):
    """Time [s] of UAS u from its place home; arguments as of `leg_seconds`."""
    if place == IN_THE_AIR:
        return task.uas[u].idle_s
    start = task.place.shape[0] - len(task.uas) + u
    return task.home[u, place] + turn_s(task, u, before, place, start)


@allocating_kernel
def _straight_on_s(task, u, place):
    """(W,) times [s] of UAS u from its place to all waypoints, no turn counted."""
    return task.first[u] if place == IN_THE_AIR else task.between[task.uas[u].kind, place]


@allocating_kernel
def next_free(place, ready_s):
    """The UAS that is free first; -1 where none covers any more."""
    j = -1
    for k in range(place.shape[0]):
        if place[k] != DONE and (j < 0 or ready_s[k] < ready_s[j]):
            j = k
    return j


@allocating_kernel
def _greedy_rollout(task, u, first, ready_s, place, before, open_, trial_ready, trial_place, todo):
    """(total, longest, left) if UAS u flies to `first` (-1: home), and all go on to the nearest."""
    n_uas = ready_s.shape[0]
    total_s, longest_s = 0.0, 0.0
    n_todo = 0
    for w in range(open_.shape[0]):
        if open_[w] and w != first:
            todo[n_todo] = w
            n_todo += 1
    trial_ready[:] = ready_s
    trial_place[:] = place
    if first < 0:
        trial_ready[u] += home_seconds(task, u, place[u], before[u])
        trial_place[u] = DONE
    else:
        trial_ready[u] += leg_seconds(task, u, place[u], before[u], first)
        trial_place[u] = first
    while n_todo > 0:
        j = next_free(trial_place, trial_ready)
        if j < 0:
            break
        row = _straight_on_s(task, j, trial_place[j])
        at = 0
        for t in range(1, n_todo):
            if row[todo[t]] < row[todo[at]]:
                at = t
        w = todo[at]
        if trial_ready[j] + row[w] + task.home[j, w] > task.uas[j].budget_s:
            if trial_place[j] == IN_THE_AIR:
                trial_ready[j] += task.uas[j].idle_s
            else:
                trial_ready[j] += task.home[j, trial_place[j]]
            trial_place[j] = DONE
            continue
        trial_ready[j] += row[w]
        trial_place[j] = w
        n_todo -= 1
        todo[at] = todo[n_todo]
    for j in range(n_uas):
        if trial_place[j] >= 0:
            trial_ready[j] += task.home[j, trial_place[j]]
        total_s += trial_ready[j]
        longest_s = max(longest_s, trial_ready[j])
    return total_s, longest_s, n_todo


@allocating_kernel
def _nearest(task, u, place, before, open_, candidates, leg_s):
    """The nearest open waypoints in order; how many."""
    n = 0
    for w in range(open_.shape[0]):
        if not open_[w]:
            continue
        seconds = leg_seconds(task, u, place, before, w)
        if n == K and seconds >= leg_s[K - 1]:
            continue
        n = min(n + 1, K)
        at = n - 1
        while at > 0 and leg_s[at - 1] > seconds:
            leg_s[at] = leg_s[at - 1]
            candidates[at] = candidates[at - 1]
            at -= 1
        leg_s[at] = seconds
        candidates[at] = w
    return n


class RouteWorkspace(NamedTuple):
    """Arrays that the construction of routes writes to.

    Attributes:
        candidates: (K,) waypoints of the choice.
        rows: (K+1, N_ORDER) what is read about each.
        legal: (K+1,).
    """

    candidates: NDArray[np.int64]
    rows: NDArray[np.float64]
    legal: NDArray[np.bool_]


def route_workspace() -> RouteWorkspace:
    """An empty one."""
    return RouteWorkspace(np.full(K, -1), np.zeros((K + 1, N_ORDER)), np.zeros(K + 1, np.bool_))


@allocating_kernel
def observe_choices(task, unit_s, u, ready_s, place, before, open_, workspace):
    """Write what UAS u may choose and what is read about each choice.

    Args:
        task: `RoutingArrays`.
        unit_s: Mean leg time from a waypoint to its nearest neighbour.
        u: Index of the UAS.
        ready_s: (U,) when each UAS is free.
        place: (U,) waypoint where it is then, IN_THE_AIR or DONE.
        before: (U,) where it comes from, rows of `task.place`.
        open_: (W,) waypoints to choose from.
        workspace: `RouteWorkspace`, written.

    Returns:
        How many waypoints there are to choose from.
    """
    candidates, rows, legal = workspace.candidates, workspace.rows, workspace.legal
    n_uas, unit, place_m = ready_s.shape[0], unit_s, task.place
    leg_s = np.empty(K)
    n = _nearest(task, u, place[u], before[u], open_, candidates, leg_s)
    candidates[n:] = -1
    rows[:] = 0.0
    legal[:] = False
    room_ready, room_place = np.empty(n_uas), np.empty(n_uas, np.int64)
    room_todo = np.empty(open_.shape[0], np.int64)
    n_open, cx, cy = 0, 0.0, 0.0
    for w in range(open_.shape[0]):
        if open_[w]:
            n_open += 1
            cx += place_m[w, 0]
            cy += place_m[w, 1]
    cx /= max(n_open, 1)
    cy /= max(n_open, 1)
    mates, others_s, ahead_s = 0, 0.0, 1e9
    for j in range(n_uas):
        if j != u and place[j] != DONE:
            mates += 1
            others_s += ready_s[j]
            ahead_s = min(ahead_s, ready_s[j])
    uas = task.uas[u]
    px, py = uas.position_m[0], uas.position_m[1]
    vx, vy = uas.velocity_mps[0] / uas.speed_mps, uas.velocity_mps[1] / uas.speed_mps
    if place[u] >= 0:
        px, py = place_m[place[u], 0], place_m[place[u], 1]
        vx, vy = px - place_m[before[u], 0], py - place_m[before[u], 1]
        length = math.hypot(vx, vy) + 1e-9
        vx, vy = vx / length, vy / length
    total_s, longest_s, left = np.zeros(K + 1), np.zeros(K + 1), np.zeros(K + 1)
    best, n_legal = -1, 0
    for k in range(n):
        w = candidates[k]
        legal[k] = ready_s[u] + leg_s[k] + task.home[u, w] <= uas.budget_s
        n_legal += legal[k]
        total_s[k], longest_s[k], left[k] = _greedy_rollout(
            task, u, w, ready_s, place, before, open_, room_ready, room_place, room_todo
        )
        cost = longest_s[k] + WEIGHT * total_s[k] + 60.0 * left[k]
        if best < 0 or cost < longest_s[best] + WEIGHT * total_s[best] + 60.0 * left[best]:
            best = k
    total_s[K], longest_s[K], left[K] = _greedy_rollout(
        task, u, -1, ready_s, place, before, open_, room_ready, room_place, room_todo
    )
    legal[K] = n_legal == 0 or (mates > 0 and left[K] <= (left[best] if best >= 0 else 0.0))
    share = n_open / (mates + 1.0)
    for k in range(n + 1):
        r = rows[k] if k < n else rows[K]
        c = k if k < n else K
        r[N_OPEN] = n_open / 25.0
        r[PER_UAS] = share / 15.0
        r[MATES] = min(mates, 4) / 4.0
        r[ALONE] = mates == 0
        r[OTHERS_FREE] = (
            (others_s / max(mates, 1) - ready_s[u]) / (5.0 * unit) if mates > 0 else 0.0
        )
        r[IN_AIR] = place[u] == IN_THE_AIR
        r[MORE_TOTAL] = (total_s[c] - total_s[best]) / (2.0 * unit) if best >= 0 else 0.0
        r[MORE_LONGEST] = (longest_s[c] - longest_s[best]) / (2.0 * unit) if best >= 0 else 0.0
        r[FIRST_LEG] = (leg_s[0] if n > 0 else 0.0) / (2.0 * unit)
        r[OFF_CENTRE] = math.hypot(px - cx, py - cy) / 100.0
    home = rows[K]
    home[WAY_HOME] = home_seconds(task, u, place[u], before[u]) / (10.0 * unit)
    home[MATE_FREE] = min(ahead_s, 1e3) / (20.0 * unit) if mates > 0 else 0.0
    home[TIME_LEFT] = (uas.budget_s + _SPARE_S - ready_s[u]) / 300.0
    home[ENOUGH_MATES] = n_open <= mates
    for k in range(n):
        r, w = rows[k], candidates[k]
        r[LEG] = leg_s[k] / (2.0 * unit)
        r[MORE_LEG] = (leg_s[k] - leg_s[0]) / unit
        dx, dy = place_m[w, 0] - px, place_m[w, 1] - py
        length = math.hypot(dx, dy) + 1e-9
        r[COSINE] = (vx * dx + vy * dy) / length
        r[SINE] = abs(vx * dy - vy * dx) / length
        r[LEG_HOME] = task.home[u, w] / (10.0 * unit)
        lead_s = 1e6
        for j in range(n_uas):
            if j != u and place[j] != DONE:
                lead_s = min(lead_s, ready_s[j] + _straight_on_s(task, j, place[j])[w])
        r[MATE_LATER] = (
            (min(lead_s, 1e4) - ready_s[u] - leg_s[k]) / (3.0 * unit) if mates > 0 else 3.0
        )
        nearest, second = 1e3, 1e3
        near, around, side, sides, behind = 0, 0, 0.0, 0.0, 0
        for v in range(open_.shape[0]):
            if not open_[v] or v == w:
                continue
            on_s = task.between[uas.kind, w, v]
            near += on_s < 1.6 * unit
            around += on_s < 3.0 * unit
            if on_s < nearest:
                nearest, second = on_s, nearest
            elif on_s < second:
                second = on_s
            if on_s < 4.0 * unit:
                ex, ey = place_m[v, 0] - px, place_m[v, 1] - py
                side += 1.0 if dx * ey - dy * ex > 0.0 else -1.0
                sides += 1.0
                behind += (ex - dx) * dx + (ey - dy) * dy < 0.0
        r[NEAREST] = nearest / unit
        r[SECOND_NEAREST] = second / unit
        r[NEAR] = near / 6.0
        r[AROUND] = around / 15.0
        r[ONE_SIDED] = abs(side) / max(sides, 1.0)
        r[FROM_CENTRE] = math.hypot(place_m[w, 0] - cx, place_m[w, 1] - cy) / 100.0
        r[BEHIND] = behind / max(sides, 1.0)
        r[IS_NEAREST] = k == 0
        r[IS_BEST] = k == best
        r[RANK] = k / K
        # is it nearest to where it would be taken from, and by whom
        r[TWO_LEGS] = (leg_s[k] + nearest) / (3.0 * unit)
        r[MATE_SOONER] = lead_s < ready_s[u] + leg_s[k]
        r[MORE_LEFT] = left[k] - (left[best] if best >= 0 else 0.0)
        r[CLOSER_HOME] = home[WAY_HOME] - r[LEG_HOME]
    for k in range(K + 1):
        for f in range(N_ORDER):
            rows[k, f] = min(max(rows[k, f], -3.0), 3.0)
    return n


@allocating_kernel
def move(task, u, w, ready_s, place, before, open_):
    """UAS u takes waypoint w next (-1: flies home)."""
    if w < 0:
        stays = place[u] == IN_THE_AIR and task.uas[u].idle_s <= 0.0
        ready_s[u] = 0.0 if stays else ready_s[u] + home_seconds(task, u, place[u], before[u])
        place[u] = DONE
        return
    ready_s[u] += leg_seconds(task, u, place[u], before[u], w)
    if place[u] != IN_THE_AIR:
        before[u] = place[u]
    place[u] = w
    open_[w] = False


class Record(NamedTuple):
    """What was decided while routes were built, for learning; rows beyond `n` mean nothing.

    Attributes:
        rows: (N, K+1, N_ORDER) what was read.
        legal: (N, K+1).
        choice: (N,).
        n: (1,) how many; only choices among several count.
    """

    rows: NDArray[np.float32]
    legal: NDArray[np.bool_]
    choice: NDArray[np.int64]
    n: NDArray[np.int64]


def no_record(size: int = 0) -> Record:
    """An empty record of so many decisions."""
    return Record(
        np.zeros((size, K + 1, N_ORDER), np.float32),
        np.zeros((size, K + 1), np.bool_),
        np.zeros(size, np.int64),
        np.zeros(1, np.int64),
    )


@allocating_kernel
def note(record, workspace, choice):
    """Note a decision, if there is room and there was a choice."""
    n = record.n[0]
    if n < record.choice.shape[0] and workspace.legal.sum() > 1:
        record.rows[n] = workspace.rows
        record.legal[n] = workspace.legal
        record.choice[n] = choice
        record.n[0] = n + 1


@allocating_kernel
def build(task, unit_s, score, home_score, stages, noise, rng, workspace, record, routes, lengths):
    """Build the routes of all UAS.

    Args:
        task: `RoutingArrays`.
        unit_s: Mean leg time from a waypoint to its nearest neighbour.
        score: `Layers` that score a waypoint.
        home_score: `Layers` that score home.
        stages: (S, W) waypoints to be visited, those of the first row before all others.
        noise: Scale of Gumbel noise on scores; 0: always the best.
        rng: Of the noise.
        workspace: `RouteWorkspace`.
        record: `Record`, written.
        routes: (U, W) written.
        lengths: (U,) written.

    Returns:
        Estimated cost [s]: the longest flight and the weighted sum, and what is left out.
    """
    n_uas = routes.shape[0]
    ready_s, place = np.zeros(n_uas), np.full(n_uas, IN_THE_AIR)
    before = stages.shape[1] + np.arange(n_uas)
    lengths[:] = 0
    left = 0
    for j in range(n_uas):
        if task.uas[j].budget_s == -np.inf:
            place[j] = DONE
    for stage in range(stages.shape[0]):
        open_ = stages[stage].copy()
        while open_.any():
            u = next_free(place, ready_s)
            if u < 0:
                break
            observe_choices(task, unit_s, u, ready_s, place, before, open_, workspace)
            best, best_score = -1, -np.inf
            for k in range(K + 1):
                if not workspace.legal[k]:
                    continue
                if k < K:
                    value = value_of(score, workspace.rows[k])
                else:
                    value = value_of(home_score, workspace.rows[K])
                if noise > 0.0:
                    value -= noise * math.log(-math.log(rng.random() + 1e-300) + 1e-300)
                if value > best_score:
                    best, best_score = k, value
            note(record, workspace, best)
            if best == K or best < 0:
                move(task, u, -1, ready_s, place, before, open_)
                continue
            w = workspace.candidates[best]
            routes[u, lengths[u]] = w
            lengths[u] += 1
            move(task, u, w, ready_s, place, before, open_)
        left += open_.sum()
    total_s, longest_s = 0.0, 0.0
    for j in range(n_uas):
        if place[j] != DONE and lengths[j] > 0:
            ready_s[j] += home_seconds(task, j, place[j], before[j])
        elif place[j] != DONE:
            ready_s[j] = task.uas[j].idle_s
        total_s += ready_s[j]
        longest_s = max(longest_s, ready_s[j])
    return longest_s + WEIGHT * total_s + _LEFT_OUT_S * left

"""The observation of a UAS that needs a target, and which choices it has; compiled."""

import math

import numpy as np

from uas_coverage_agents.waypoint.greedy_rollout import ABSENT, IN_THE_AIR, greedy_rollout
from uas_coverage_agents.waypoint.layout import (
    CANDIDATE_AT,
    CANDIDATE_TABLE,
    HIGH,
    HOME_CHOICE,
    LOW,
    N_CANDIDATE,
    N_TEAM,
    SCALE,
    TEAM_AT,
    TEAM_TABLE,
    UNIT,
    K,
)
from uas_coverage_agents.waypoint.legs import home_leg_s, leg_s
from uas_coverage_env.autopilot.guidance import path_length_home_m
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.entities.commands import HOME
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.planning.reserves import LEARNED_CLOCK_RESERVE
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world.routes import route

NO_TARGET = -2
"""Target of a UAS that has none; home is world's HOME, waypoints are their indices."""

_TURN_MPS2 = 3.0


@allocating_kernel
def covers(state, targets, i):
    """Whether a UAS flies and is not on its way home."""
    return state.uas[i].status == FLYING and not state.uas[i].returning and targets[i] != HOME


@allocating_kernel
def claimed_by_mates(state, targets, i, claimed):
    """Mark in `claimed` (W,) the open waypoints to which other UAS fly."""
    claimed[:] = False
    for j in range(targets.shape[0]):
        if j != i and covers(state, targets, j) and targets[j] >= 0:
            claimed[targets[j]] = state.uncovered[targets[j]]


@allocating_kernel
def allowed(state, blocked, claimed, may):
    """Mark in `may` (W,) what may be chosen: free and unassigned waypoints; else the next best.

    The last waypoints are shared, as in the planner `nearest-waypoint`: a UAS that is called home
    may never reach its target. What a moving obstacle covers comes last of all.

    Returns:
        How many are marked.
    """
    for stage in range(3):
        n = 0
        for w in range(may.shape[0]):
            may[w] = (
                state.uncovered[w]
                and (stage > 1 or not blocked[w])
                and (stage > 0 or not claimed[w])
            )
            n += may[w]
        if n > 0:
            return n
    return 0


@allocating_kernel
def budget_s(arena, state, i):
    """Flying time [s] that battery and clock still allow."""
    uas = arena.uas[i]
    rules = arena.rules[0]
    battery_s = (uas.dod_max - state.x[i, S.DOD]) / uas.dod_per_s
    clock_s = (rules.max_steps - state.step[0]) * rules.dt_s - LEARNED_CLOCK_RESERVE.kept_s
    return min(battery_s, clock_s)


@allocating_kernel
def _nearest_by_way(arena, state, i, may, candidates, way_m, towards):
    """The K waypoints to which the ways are shortest, and the directions of their first legs.

    A way is not shorter than the straight line: ways are looked up in the order of straight lines
    until no later one can be shorter.
    """
    x = state.x[i]
    n_waypoints = may.shape[0]
    straight_m = np.empty(n_waypoints)
    for w in range(n_waypoints):
        straight_m[w] = math.inf
        if may[w]:
            position_m = arena.waypoints[w].position_m
            straight_m[w] = math.hypot(position_m[0] - x[S.X], position_m[1] - x[S.Y])
    n = 0
    while True:
        w = straight_m.argmin()
        if straight_m[w] == math.inf or (n == K and straight_m[w] >= way_m[K - 1]):
            return n
        straight_m[w] = math.inf
        position_m = arena.waypoints[w].position_m
        end_x, end_y, length_m, _ = route(
            arena, w, x[S.X], x[S.Y], x[S.Z], position_m[0], position_m[1], position_m[2]
        )
        if n == K and length_m >= way_m[K - 1]:
            continue
        n = min(n + 1, K)
        at = n - 1
        while at > 0 and way_m[at - 1] > length_m:
            way_m[at] = way_m[at - 1]
            candidates[at] = candidates[at - 1]
            towards[at] = towards[at - 1]
            at -= 1
        way_m[at] = length_m
        candidates[at] = w
        towards[at, 0] = end_x - x[S.X]
        towards[at, 1] = end_y - x[S.Y]


@allocating_kernel
def _turning_s(cruise_mps, vx, vy, towards):
    """Time [s] lost until the velocity points along the first leg."""
    length_m = math.hypot(towards[0], towards[1]) + 1e-9
    dx = vx - cruise_mps * towards[0] / length_m
    dy = vy - cruise_mps * towards[1] / length_m
    return (dx * dx + dy * dy) / (2.0 * _TURN_MPS2 * cruise_mps)


@allocating_kernel
def _team(arena, legs, state, targets, from_s, here_home_s, budgets_s, ready_s, place):
    """Where and when each UAS is free, see `greedy_rollout`."""
    for j in range(targets.shape[0]):
        place[j] = ABSENT
        ready_s[j] = 0.0
        if state.uas[j].status != FLYING:
            continue
        x = state.x[j]
        uas = arena.uas[j]
        way_m = path_length_home_m(arena, j, x)
        here_home_s[j] = home_leg_s(uas, way_m, max(uas.home_m[2] - x[S.Z], 0.0))
        budgets_s[j] = budget_s(arena, state, j)
        if not covers(state, targets, j):
            ready_s[j] = here_home_s[j]
            continue
        w = targets[j]
        if w >= 0 and state.uncovered[w]:
            to_m = arena.waypoints[w].position_m
            way_m = route(arena, w, x[S.X], x[S.Y], x[S.Z], to_m[0], to_m[1], to_m[2])[2]
            ready_s[j] = leg_s(uas, way_m, x[S.Z] - to_m[2], arena.waypoints[w].radius_m)
            place[j] = w
            continue
        place[j] = IN_THE_AIR
        for w in range(state.uncovered.shape[0]):
            if state.uncovered[w]:
                to_m = arena.waypoints[w].position_m
                way_m = math.hypot(to_m[0] - x[S.X], to_m[1] - x[S.Y])
                from_s[j, w] = leg_s(uas, way_m, x[S.Z] - to_m[2], arena.waypoints[w].radius_m)


@allocating_kernel
def observe(arena, legs, state, blocked, targets, i, candidates, legal, row):
    """Write what UAS i sees and may choose; the numbers are those of `layout`.

    Args:
        arena: The arena.
        legs: `Legs`.
        state: The state of the world.
        blocked: (W,) inside of a moving obstacle's keep-out.
        targets: (U,) where each flies to.
        i: Index of the UAS.
        candidates: (K,) waypoints, -1 where there are no more; written.
        legal: (K+1,) choices that exist and that battery and clock allow; home last; written.
        row: (OBSERVATION_SIZE,) written.

    Returns:
        Number of legal choices; at least one.
    """
    n_uas = targets.shape[0]
    n_waypoints = state.uncovered.shape[0]
    x = state.x[i]
    uas = arena.uas[i]
    unit_m = legs.unit[0]
    unit_s = legs.unit[1]
    cruise_mps = unit_m / unit_s
    claimed = np.empty(n_waypoints, dtype=np.bool_)
    may = np.empty(n_waypoints, dtype=np.bool_)
    claimed_by_mates(state, targets, i, claimed)
    allowed(state, blocked, claimed, may)
    way_m = np.empty(K)
    towards = np.empty((K, 2))
    n_candidates = _nearest_by_way(arena, state, i, may, candidates, way_m, towards)
    candidates[n_candidates:] = -1

    from_s = np.zeros((n_uas, n_waypoints))
    here_home_s = np.zeros(n_uas)
    budgets_s = np.zeros(n_uas)
    ready_s = np.empty(n_uas)
    place = np.empty(n_uas, dtype=np.int64)
    _team(arena, legs, state, targets, from_s, here_home_s, budgets_s, ready_s, place)

    todo = np.empty(n_waypoints, dtype=np.int64)
    n_todo = 0
    n_open = 0
    n_blocked = 0
    centre_x = 0.0
    centre_y = 0.0
    for w in range(n_waypoints):
        if not state.uncovered[w]:
            continue
        n_open += 1
        n_blocked += blocked[w]
        centre_x += arena.waypoints[w].position_m[0]
        centre_y += arena.waypoints[w].position_m[1]
        if not claimed[w]:
            todo[n_todo] = w
            n_todo += 1
    centre_x /= max(n_open, 1)
    centre_y /= max(n_open, 1)

    team = np.empty(N_TEAM)
    rows = np.empty((n_candidates, N_CANDIDATE))
    legal[:] = False
    n_legal = 0
    total_s = np.zeros(K + 1)
    longest_s = np.zeros(K + 1)
    left = np.zeros(K + 1)
    trial_ready_s = np.empty(n_uas)
    trial_place = np.empty(n_uas, dtype=np.int64)
    trial_todo = np.empty(n_waypoints, dtype=np.int64)
    best = -1
    for k in range(n_candidates + 1):
        trial_ready_s[:] = ready_s
        trial_place[:] = place
        n_trial = 0
        if k == n_candidates:  # home
            k = K
            trial_place[i] = ABSENT
            trial_ready_s[i] = here_home_s[i]
            trial_todo[:n_todo] = todo[:n_todo]
            n_trial = n_todo
        else:
            w = candidates[k]
            waypoint = arena.waypoints[w]
            flying_s = leg_s(uas, way_m[k], x[S.Z] - waypoint.position_m[2], waypoint.radius_m)
            turning_s = _turning_s(cruise_mps, x[S.VX], x[S.VY], towards[k])
            to_spare_s = budgets_s[i] - flying_s - legs.return_s[i, w]
            legal[k] = to_spare_s > 0.0
            n_legal += legal[k]
            trial_place[i] = w
            trial_ready_s[i] = flying_s + turning_s
            for t in range(n_todo):
                if todo[t] != w:
                    trial_todo[n_trial] = todo[t]
                    n_trial += 1
            values = rows[k]
            values[CANDIDATE_AT.there] = 1.0
            values[CANDIDATE_AT.way] = way_m[k]
            values[CANDIDATE_AT.time] = flying_s + turning_s
            values[CANDIDATE_AT.turn] = turning_s
            values[CANDIDATE_AT.home] = legs.home_s[i, w]
            values[CANDIDATE_AT.margin] = to_spare_s
            values[CANDIDATE_AT.blocked] = blocked[w]
            values[CANDIDATE_AT.claimed] = claimed[w]
            _write_around(legs, state, w, values)
            first_s = math.inf
            for j in range(n_uas):
                if j != i and place[j] != ABSENT:
                    on_s = from_s[j, w] if place[j] == IN_THE_AIR else legs.between_s[place[j], w]
                    first_s = min(first_s, ready_s[j] + on_s)
            values[CANDIDATE_AT.lead] = min(first_s, 1e6) - flying_s - turning_s
            values[CANDIDATE_AT.outside] = math.hypot(
                waypoint.position_m[0] - centre_x, waypoint.position_m[1] - centre_y
            )
            speed_mps = math.hypot(x[S.VX], x[S.VY])
            length_m = math.hypot(towards[k, 0], towards[k, 1])
            along = x[S.VX] * towards[k, 0] + x[S.VY] * towards[k, 1]
            values[CANDIDATE_AT.ahead] = along / max(speed_mps * length_m, 1e-6)
        total_s[k], longest_s[k], left[k] = greedy_rollout(
            legs, from_s, here_home_s, budgets_s, trial_ready_s, trial_place, trial_todo, n_trial
        )
        if k < K and (best < 0 or _worth(total_s, longest_s, left, k, best)):
            best = k

    if best < 0:
        best = K
    fewest = left[best]
    for k in range(n_candidates):
        values = rows[k]
        values[CANDIDATE_AT.total] = total_s[k] - total_s[best]
        values[CANDIDATE_AT.longest] = longest_s[k] - longest_s[best]
        values[CANDIDATE_AT.left] = left[k] - fewest
        values[CANDIDATE_AT.first] = k == best

    n_mates = 0
    n_away = 0
    mates_s = 600.0
    mate_m = math.inf
    for j in range(n_uas):
        if j == i or state.uas[j].status != FLYING:
            continue
        if place[j] == ABSENT:
            n_away += 1
            continue
        n_mates += 1
        mates_s = min(mates_s, budgets_s[j] - here_home_s[j])
        mate_m = min(mate_m, math.hypot(state.x[j, S.X] - x[S.X], state.x[j, S.Y] - x[S.Y]))
    # no UAS leaves waypoints behind that the others are not expected to finish
    legal[HOME_CHOICE] = n_legal == 0 or (n_mates > 0 and left[K] <= left[best])
    n_legal += legal[HOME_CHOICE]
    team[TEAM_AT.speed] = math.hypot(x[S.VX], x[S.VY]) / uas.speed_mps
    team[TEAM_AT.way_home] = here_home_s[i]
    team[TEAM_AT.margin] = budgets_s[i] - here_home_s[i]
    team[TEAM_AT.time_left] = (arena.rules[0].max_steps - state.step[0]) * arena.rules[0].dt_s
    team[TEAM_AT.open] = n_open
    team[TEAM_AT.share] = n_open / (n_mates + 1)
    team[TEAM_AT.mates] = n_mates
    team[TEAM_AT.alone] = n_mates == 0
    team[TEAM_AT.away] = n_away
    team[TEAM_AT.blocked] = n_blocked / max(n_open, 1)
    team[TEAM_AT.mates_margin] = mates_s
    team[TEAM_AT.nearest_mate] = mate_m
    team[TEAM_AT.total] = total_s[best]
    team[TEAM_AT.longest] = longest_s[best]
    team[TEAM_AT.left] = left[best]
    team[TEAM_AT.home_total] = total_s[K] - total_s[best]
    team[TEAM_AT.home_longest] = longest_s[K] - longest_s[best]
    team[TEAM_AT.home_left] = left[K] - left[best]
    spread_m = 0.0
    for w in range(n_waypoints):
        if state.uncovered[w]:
            position_m = arena.waypoints[w].position_m
            spread_m += math.hypot(position_m[0] - centre_x, position_m[1] - centre_y)
    team[TEAM_AT.spread] = spread_m / max(n_open, 1)
    team[TEAM_AT.centre] = math.hypot(x[S.X] - centre_x, x[S.Y] - centre_y)
    _scale(TEAM_TABLE, legs.unit, team, row[:N_TEAM])
    for k in range(n_candidates):
        first = N_TEAM + k * N_CANDIDATE
        _scale(CANDIDATE_TABLE, legs.unit, rows[k], row[first : first + N_CANDIDATE])
    row[N_TEAM + n_candidates * N_CANDIDATE :] = 0.0
    return n_legal


@allocating_kernel
def _scale(table, unit, numbers, row):
    """Write numbers as the policy reads them: in units of their scales, within their bounds."""
    for f in range(numbers.shape[0]):
        scale = table[f, SCALE]
        if table[f, UNIT] > 0.0:
            scale *= unit[int(table[f, UNIT]) - 1]
        row[f] = min(max(numbers[f] / scale, table[f, LOW]), table[f, HIGH])


@allocating_kernel
def _worth(total_s, longest_s, left, k, best):
    """Whether the greedy rollout of choice k is better than that of the best so far."""
    cost_s = total_s[k] + longest_s[k] + 120.0 * left[k]
    return cost_s < total_s[best] + longest_s[best] + 120.0 * left[best]


@allocating_kernel
def _write_around(legs, state, w, values):
    """Write what is open around waypoint w."""
    unit_s = legs.unit[1]
    nearest_s = math.inf
    second_s = math.inf
    near = 0
    around = 0
    n = 0
    sum_s = 0.0
    for other in range(state.uncovered.shape[0]):
        if other == w or not state.uncovered[other]:
            continue
        on_s = legs.between_s[w, other]
        n += 1
        sum_s += on_s
        near += on_s < 1.6 * unit_s
        around += on_s < 3.0 * unit_s
        if on_s < nearest_s:
            second_s = nearest_s
            nearest_s = on_s
        elif on_s < second_s:
            second_s = on_s
    values[CANDIDATE_AT.next] = nearest_s
    values[CANDIDATE_AT.after_next] = second_s
    values[CANDIDATE_AT.near] = near
    values[CANDIDATE_AT.around] = around
    values[CANDIDATE_AT.remote] = sum_s / max(n, 1)

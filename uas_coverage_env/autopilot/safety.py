"""The safety filter: a command is flown only if the UAS can still brake clear of everything.

A command is safe if it can be flown for one step, and braking then keeps the UAS at the distances
that count as a breach: from the geofence, fixed obstacles, moving obstacles that go on as they go
now, and the paths of the other UAS. UAS decide in order; those that have decided are committed to
what they chose, the later ones to braking. So every UAS always has a safe choice, braking, except
where a moving obstacle comes at it; then it gets out of the way as best it can (`evasion`), but
never at the cost of what can be proved: one step of the evasive flight, and braking after it, is
clear of all that stands still and of the other UAS.

Whom return mode brings home decides first, and the others leave its way (`right_of_way`): among
the safe commands they fly the nearest that keeps clear of it.
"""

import math

import numpy as np

from uas_coverage_env.autopilot.control import write_brake, write_command
from uas_coverage_env.autopilot.evasion import evade
from uas_coverage_env.autopilot.lookahead import (
    TOLERANCE_M,
    braking_slack,
    fly_and_brake,
)
from uas_coverage_env.autopilot.right_of_way import claim_way, decision_order, room_beside
from uas_coverage_env.compiled.kernels import allocating_kernel, kernel
from uas_coverage_env.entities.commands import ACCELERATION, CLIMB, N_VALUES, VELOCITY
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.scale import SLOW_SHARE

_AS_WISHED, _CLIMBING, _SINKING, _LEVEL = range(4)
_TURN_RAD, _SPEED_SHARE, _HEIGHT = range(3)
_NOTICEABLE_M = 1e-3  # less room to claims makes no difference


def _deflections() -> np.ndarray:
    """(D, 3) columns `_TURN_RAD`, `_SPEED_SHARE` and one of the four heights: nearest first.

    How near is chosen by hand: a turn by 60°, five sixths of the speed and two heights count alike.

    Instead of braking, last, come level flight, straight up or down, and creeping: a UAS wedged in
    between others may have room for no more.
    """
    turns_deg = (0, 25, -25, 50, -50, 80, -80, 110, -110, 150, -150, 180)
    rows = [
        (turn_deg, share, height)
        for share in (1.0, 0.6, 0.3)
        for turn_deg in turns_deg
        for height in (_AS_WISHED, _CLIMBING, _SINKING)
    ]
    rows.sort(key=lambda r: abs(r[0]) / 60 + (1 - r[1]) * 1.2 + (r[2] != _AS_WISHED) * 0.45)
    rows += [(turn_deg, share, _LEVEL) for share in (1.0, 0.3) for turn_deg in turns_deg]
    rows += [(0, 0.0, _CLIMBING), (0, 0.0, _SINKING)]
    rows += [
        (turn_deg, 0.1, height)
        for turn_deg in turns_deg
        for height in (_LEVEL, _CLIMBING, _SINKING)
    ]
    return np.array([(np.deg2rad(turn_deg), share, height) for turn_deg, share, height in rows])


_DEFLECTIONS = _deflections()


@kernel
def _wish(arena, state, i, command):
    """The velocity (north, east, down) [m/s] that a command is after."""
    uas = arena.uas[i]
    x = state.x[i]
    kind = command.kind
    values = command.values
    if kind == VELOCITY:
        down_mps = -values[2] - x[S.Z]
        return values[0], values[1], min(max(down_mps, -uas.climb_mps), uas.descent_mps)
    if kind == CLIMB:
        return values[0], values[1], values[2]
    if kind == ACCELERATION:
        dt_s = arena.rules[0].dt_s
        north_mps = state.uas[i].reference_mps[0] + values[0] * dt_s
        east_mps = state.uas[i].reference_mps[1] + values[1] * dt_s
        return north_mps, east_mps, 0.0
    return x[S.VX], x[S.VY], 0.0


@kernel
def _deflect(arena, i, wish_mps, d, command):
    """Write the d-th nearest alternative to a velocity (north, east, down)."""
    uas = arena.uas[i]
    speed_mps = math.hypot(wish_mps[0], wish_mps[1])
    heading = math.atan2(wish_mps[1], wish_mps[0]) + _DEFLECTIONS[d, _TURN_RAD]
    # deflections of a wish to go slower are as fast as is slow
    speed_mps = min(max(speed_mps, SLOW_SHARE * uas.speed_mps), uas.speed_mps)
    share_mps = speed_mps * _DEFLECTIONS[d, _SPEED_SHARE]
    height = _DEFLECTIONS[d, _HEIGHT]
    down_mps = wish_mps[2]
    if height == _CLIMBING:
        down_mps = -uas.climb_mps
    elif height == _SINKING:
        down_mps = uas.descent_mps
    elif height == _LEVEL:
        down_mps = 0.0
    write_command(
        command, CLIMB, share_mps * math.cos(heading), share_mps * math.sin(heading), down_mps
    )


@allocating_kernel
def _replace(arena, state, i, command, nonlinear, path_m, committed_m):
    """Put the nearest safe command in the place of an unsafe one, or else the least harmful.

    The order is: the deflections; braking; where even braking is not safe, because something
    moving comes near, an evasive flight; and where not even what stands still is far enough away,
    whatever keeps most distance. `path_m` is left as the path to which the UAS is then committed.
    """
    n_deflections = _DEFLECTIONS.shape[0]
    wish_mps = _wish(arena, state, i, command)
    for d in range(n_deflections):
        _deflect(arena, i, wish_mps, d, command)
        slack_m = braking_slack(
            arena, state, i, command, nonlinear, 0.0, path_m, committed_m, True, True
        )
        if slack_m >= 0.0:
            return
    write_brake(command)
    best_m = braking_slack(
        arena, state, i, command, nonlinear, -math.inf, path_m, committed_m, True
    )
    if best_m >= -TOLERANCE_M:
        return
    heading_rad = math.atan2(wish_mps[1], wish_mps[0])
    if evade(arena, state, i, heading_rad, nonlinear, command, path_m, committed_m):
        return
    best = -1
    for d in range(n_deflections):
        _deflect(arena, i, wish_mps, d, command)
        slack_m = braking_slack(
            arena, state, i, command, nonlinear, best_m, path_m, committed_m, True, True
        )
        if slack_m > best_m:
            best_m = slack_m
            best = d
    if best < 0:
        write_brake(command)
    else:
        _deflect(arena, i, wish_mps, best, command)
    braking_slack(arena, state, i, command, nonlinear, -math.inf, path_m, committed_m)


@kernel
def _make_way(
    arena, state, i, command, nonlinear, path_m, committed_m, claimants, n_claims, claims_m
):  # fmt: skip
    """Write the nearest safe command that keeps clear of the claimed ways.

    Where none does, the safe one that leaves them most room: the command itself, a deflection, or
    braking. `path_m` is left as in `_replace`.

    Returns:
        Whether there is a safe command; if not, `command` is what it was.
    """
    n_deflections = _DEFLECTIONS.shape[0]
    own_kind = command.kind
    own = command.values[0], command.values[1], command.values[2], command.values[N_VALUES - 1]
    wish_mps = _wish(arena, state, i, command)
    n_options = n_deflections + 2
    best, best_m = n_options, -math.inf
    for option in range(n_options):
        enough_m = 0.0
        if 0 < option <= n_deflections:
            _deflect(arena, i, wish_mps, option - 1, command)
        elif option > n_deflections:
            write_brake(command)
            enough_m = -TOLERANCE_M
        slack_m = braking_slack(
            arena, state, i, command, nonlinear, enough_m, path_m, committed_m, True, True
        )
        if slack_m < enough_m:
            continue
        room_m = room_beside(arena, i, path_m, claimants, n_claims, claims_m)
        if room_m > best_m + _NOTICEABLE_M:
            best, best_m = option, room_m
        if room_m >= 0.0:
            break
    if 0 < best <= n_deflections:
        _deflect(arena, i, wish_mps, best - 1, command)
    elif best == n_deflections + 1:
        write_brake(command)
    else:
        write_command(command, own_kind, own[0], own[1], own[2])
        command.values[N_VALUES - 1] = own[N_VALUES - 1]
    braking_slack(arena, state, i, command, nonlinear, -math.inf, path_m, committed_m)
    return best < n_options


@allocating_kernel
def filter_commands(arena, state, nonlinear, outcome):
    """Replace the unsafe ones among the commands in `outcome` and mark them as filtered."""
    n_uas = state.uas.shape[0]
    n_steps = arena.rules[0].lookahead_steps
    committed_m = np.empty((n_uas, n_steps + 1, 3))
    claims_m = np.empty((n_uas, n_steps + 1, 3))
    order = np.empty(n_uas, np.int64)
    n_flying, n_returning = decision_order(state, order)
    held_up = np.empty(n_uas, np.int64)
    n_held_up = 0
    brake = arena.rules[0].brake
    # the first UAS decides before any other asks where it would brake
    for rank in range(1, n_flying):
        i = order[rank]
        x = state.x[i]
        reference = state.uas[i].reference_mps[:]
        fly_and_brake(
            arena, i, x, reference, brake, nonlinear, committed_m[i], state.uas[i].belief[:]
        )
    for i in range(n_uas):
        state.uas[i].filtered = False
    for rank in range(n_flying):
        i = order[rank]
        command = outcome[i].applied_command
        path_m = committed_m[i]
        claimants, n_claims = order, n_returning
        slack_m = braking_slack(arena, state, i, command, nonlinear, 0.0, path_m, committed_m)
        if rank < n_returning:
            claimants, n_claims = held_up, n_held_up
            claim_way(arena, state, i, command, nonlinear, claims_m[i])
            if slack_m < 0.0:
                held_up[n_held_up] = i
                n_held_up += 1
        room_m = room_beside(arena, i, path_m, claimants, n_claims, claims_m)
        if slack_m >= 0.0 and room_m >= 0.0:
            continue
        if n_claims == 0 or not _make_way(
            arena, state, i, command, nonlinear, path_m, committed_m, claimants, n_claims, claims_m
        ):
            _replace(arena, state, i, command, nonlinear, path_m, committed_m)
        # only the filter gives this kind of command
        state.uas[i].filtered = outcome[i].filtered = command.kind == CLIMB

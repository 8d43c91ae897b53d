"""The safety filter: a command is flown only if the UAS can still brake clear of everything.

A command is safe if it can be flown for one step, and braking then keeps the UAS at the distances
that count as a breach: from the geofence, fixed obstacles, moving obstacles that go on as they go
now, and the paths of the other UAS. UAS decide in order; those that have decided are committed to
what they chose, the later ones to braking. So every UAS always has a safe choice, braking, except
where a moving obstacle comes at it; then it tries to get out of the way.
"""

import math

import numpy as np
from numba import njit

from uas_coverage_env.vehicle import VX, VY, Z
from uas_coverage_env.world.commands import ACCELERATION, CLIMB, VELOCITY
from uas_coverage_env.world.lookahead import (
    TOLERANCE_M,
    fixed_slack,
    fly_and_brake,
    moving_slack,
    peer_slack,
)
from uas_coverage_env.world.state import FLYING

EVADE_S = 4.0
"""Out of the way of a moving obstacle, a deflected command may be held this long [s]."""

_LEAST_SPEED_MPS = 3.0


def _deflections() -> np.ndarray:
    """(D, 3) turn [rad], share of the speed, whether to climb (1) or sink (-1): nearest first."""
    turns_deg = (0, 25, -25, 50, -50, 80, -80, 110, -110, 150, -150, 180)
    ranked = [
        (abs(turn_deg) / 60 + (1 - share) * 1.2 + abs(climb) * 0.45, turn_deg, share, climb)
        for share in (1.0, 0.6, 0.3)
        for turn_deg in turns_deg
        for climb in (0, 1, -1)
    ]
    ranked.sort(key=lambda entry: entry[0])
    return np.array([(np.deg2rad(turn), share, climb) for _, turn, share, climb in ranked])


_DEFLECTIONS = _deflections()


@njit(cache=True, error_model="numpy")
def _slack(arena, state, i, kind, values, hold_steps, margin_m, enough_m, path_m, committed_m):
    """Least distance to spare from everything when a command is flown and then braked [m]."""
    n_flown, slack_m = fly_and_brake(
        arena, i, state.x[i], state.reference[i], kind, values, hold_steps, path_m
    )
    if slack_m >= enough_m:
        slack_m = fixed_slack(arena, i, path_m, n_flown, margin_m, enough_m, slack_m)
    if slack_m >= enough_m:
        slack_m = moving_slack(arena, state.step[0], i, path_m, margin_m, enough_m, slack_m)
    if slack_m >= enough_m:
        slack_m = peer_slack(
            arena, state.status, i, path_m, committed_m, margin_m, enough_m, slack_m
        )
    return slack_m


@njit(cache=True, error_model="numpy")
def _wish(arena, state, i, kind, values, wish):
    """The velocity (north, east, down) that a command is after."""
    uas = arena.uas[i]
    x = state.x[i]
    wish[2] = 0.0
    if kind == VELOCITY:
        wish[0] = values[0]
        wish[1] = values[1]
        climb_mps = min(max(values[2] + x[Z], -uas.descent_mps), uas.climb_mps)
        wish[2] = -climb_mps
    elif kind == CLIMB:
        wish[0] = values[0]
        wish[1] = values[1]
        wish[2] = values[2]
    elif kind == ACCELERATION:
        wish[0] = state.reference[i, 0] + values[0] * arena.rules[0].dt_s
        wish[1] = state.reference[i, 1] + values[1] * arena.rules[0].dt_s
    else:
        wish[0] = x[VX]
        wish[1] = x[VY]


@njit(cache=True, error_model="numpy")
def _deflect(arena, i, wish, d, values):
    """Write the d-th nearest alternative to a velocity."""
    uas = arena.uas[i]
    speed_mps = math.hypot(wish[0], wish[1])
    heading = math.atan2(wish[1], wish[0]) + _DEFLECTIONS[d, 0]
    share_mps = min(max(speed_mps, _LEAST_SPEED_MPS), uas.speed_mps) * _DEFLECTIONS[d, 1]
    values[0] = share_mps * math.cos(heading)
    values[1] = share_mps * math.sin(heading)
    if _DEFLECTIONS[d, 2] > 0.0:
        values[2] = -uas.climb_mps
    elif _DEFLECTIONS[d, 2] < 0.0:
        values[2] = uas.descent_mps
    else:
        values[2] = wish[2]
    values[3] = 0.0


@njit(cache=True, error_model="numpy")
def _replace(arena, state, i, command, margin_m, path_m, committed_m):
    """Put the nearest safe command in the place of an unsafe one, or else the least harmful.

    The order is: the deflections, held for a step; braking; where there are moving obstacles,
    the deflections held for longer; at last whatever keeps the largest distances.
    """
    n_deflections = _DEFLECTIONS.shape[0]
    wish = np.empty(3)
    _wish(arena, state, i, command.kind, command.values, wish)
    values = np.zeros(4)
    command.kind = CLIMB
    for d in range(n_deflections):
        _deflect(arena, i, wish, d, values)
        slack_m = _slack(arena, state, i, CLIMB, values, 1, margin_m, 0.0, path_m, committed_m)
        if slack_m >= 0.0:
            command.values[:] = values
            return
    values[:] = 0.0
    slack_m = _slack(arena, state, i, CLIMB, values, 1, margin_m, -TOLERANCE_M, path_m, committed_m)
    command.values[:] = values
    if slack_m >= -TOLERANCE_M:
        return
    evade_steps = max(1, int(EVADE_S / arena.rules[0].dt_s))
    best_m = _slack(arena, state, i, CLIMB, values, 1, margin_m, -math.inf, path_m, committed_m)
    best_steps = 1
    for hold_steps in (evade_steps, 1):
        for d in range(n_deflections):
            _deflect(arena, i, wish, d, values)
            slack_m = _slack(
                arena, state, i, CLIMB, values, hold_steps, margin_m, best_m, path_m, committed_m
            )
            if slack_m > best_m:
                best_m = slack_m
                best_steps = hold_steps
                command.values[:] = values
                if best_m >= 0.0:
                    break
        if best_m >= 0.0:
            break
    # once more, for the path to which this UAS is now committed
    _slack(
        arena, state, i, CLIMB, command.values, best_steps, margin_m, -math.inf, path_m,
        committed_m,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def filter_commands(arena, state, margin_m, outcome):
    """Replace the unsafe ones among the commands in `outcome` and mark them as filtered.

    Args:
        arena: The arena.
        state: The state from which the commands are flown.
        margin_m: Distance to keep in addition to what would be a breach [m].
        outcome: (U,) of OUTCOME_DTYPE; applied_command and filtered are written.
    """
    n_uas = state.status.shape[0]
    n_steps = arena.rules[0].lookahead_steps
    committed_m = np.empty((n_uas, n_steps + 1, 3))
    path_m = np.empty((n_steps + 1, 3))
    brake = np.zeros(4)
    # the first UAS decides before anybody asks where it would brake
    for i in range(1, n_uas):
        if state.status[i] == FLYING:
            fly_and_brake(arena, i, state.x[i], state.reference[i], CLIMB, brake, 1, committed_m[i])
    for i in range(n_uas):
        if state.status[i] != FLYING:
            continue
        command = outcome[i].applied_command
        slack_m = _slack(
            arena, state, i, command.kind, command.values, 1, margin_m, 0.0, path_m, committed_m
        )
        if slack_m < 0.0:
            outcome[i].filtered = True
            _replace(arena, state, i, command, margin_m, path_m, committed_m)
        committed_m[i] = path_m

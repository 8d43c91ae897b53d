"""Getting out of the way of what moves, where braking does not help.

Braking proves a UAS safe from what stands still and from the other UAS, which brake too. It proves
nothing about an obstacle that comes at a UAS that hovers. Then the filter looks for an evasive
flight: a velocity held for some seconds and braked, that stays out of the space which the moving
obstacle sweeps at its present velocity. Its first step must leave room to brake clear of everything
that stands still and of the others, so that the proof about these goes on.

In the open, full speed for some seconds leads out of the way. Where no such flight has room enough,
in a corridor or below a ceiling, slower and shorter ones are tried: to one side, or over what
comes.

Constants were chosen by hand; `benchmarks/safety_filter.py` shows how many UAS are hit.
"""

import math

import numpy as np

from uas_coverage_env.autopilot.control import write_brake, write_command
from uas_coverage_env.autopilot.lookahead import (
    PLENTY_M,
    TOLERANCE_M,
    braking_slack,
    fixed_slack,
    fly_and_brake,
    peer_slack,
    required_from,
)
from uas_coverage_env.compiled.kernels import allocating_kernel, kernel, stack_array
from uas_coverage_env.entities.commands import CLIMB
from uas_coverage_env.geometry.segments import cylinder_clearance

_ROOM, _NORTH, _EAST, _DOWN = range(4)
"""Of the best flight so far: its room [m] and its velocity [m/s]."""

_TURNS = 12  # directions that are tried, and straight up or down
_HELD_S = (8.0, 3.0)  # at full speed [s]
_SHARES = (1.0, 0.35, 0.1)  # of it, where full speed for so long has not room enough [-]
_ENOUGH_M = 3.0  # more room than this is not looked for [m]
_HIT_M = -1e6  # less room than any flight has that only comes too near [m]

LINGERING = 0.05
"""Weight of the mean shortfall of clearance beside the largest: a UAS inside leaves early [-]."""


@kernel
def room_from_movers(arena, step, i, path_m):
    """How well a path keeps clear of moving obstacles that go on as they go now [m].

    The least room to spare along the path, at most _ENOUGH_M; where it is negative, less a little
    for every step with too little room. A path that ends in a contact is worth less than any that
    does not, and the less the sooner: what comes may turn, and a way aside may open.
    """
    dt_s = arena.rules[0].dt_s
    step = min(step, arena.moving_path_m.shape[0] - 1)
    n_steps = path_m.shape[0] - 1
    least_m, shortfall_m = _ENOUGH_M, 0.0
    hit = n_steps
    for m in range(arena.moving.shape[0]):
        obstacle = arena.moving[m]
        required_m = required_from(arena, step, i, m)
        north_m, east_m, down_m = arena.moving_path_m[step, m]
        north_mps, east_mps, down_mps = arena.moving_velocity_mps[step, m]
        for k in range(n_steps):
            now_s, next_s = k * dt_s, (k + 1) * dt_s
            clearance_m = cylinder_clearance(
                obstacle.radius_m,
                obstacle.half_height_m,
                path_m[k, 0] - north_m - now_s * north_mps,
                path_m[k, 1] - east_m - now_s * east_mps,
                path_m[k, 2] - down_m - now_s * down_mps,
                path_m[k + 1, 0] - north_m - next_s * north_mps,
                path_m[k + 1, 1] - east_m - next_s * east_mps,
                path_m[k + 1, 2] - down_m - next_s * down_mps,
            )
            room_m = clearance_m - required_m
            least_m = min(least_m, room_m)
            shortfall_m += min(room_m, 0.0)
            if clearance_m < arena.uas[i].radius_m:
                hit = min(hit, k)
    if hit < n_steps:
        return _HIT_M + hit * dt_s
    return least_m + LINGERING * shortfall_m / n_steps


@kernel
def _is_provable(arena, state, i, command, nonlinear, path_m, committed_m):
    """Whether braking after one step of a command is clear of all that stands still or brakes."""
    slack_m = braking_slack(
        arena, state, i, command, nonlinear, -TOLERANCE_M, path_m, committed_m, False, True
    )
    return slack_m >= -TOLERANCE_M


@kernel
def _is_open(arena, state, i, command, n_held, nonlinear, path_m, committed_m):
    """Whether an evasive flight meets nothing that stands still and no path of another UAS."""
    x, reference, belief = state.x[i], state.uas[i].reference_mps[:], state.uas[i].belief[:]
    _, rest_m = fly_and_brake(
        arena, i, x, reference, command, nonlinear, path_m, belief, n_held, 0.0
    )
    if rest_m == -math.inf:
        return False
    slack_m = fixed_slack(arena, i, path_m, path_m.shape[0] - 1, 0.0, PLENTY_M)
    if slack_m >= 0.0:
        slack_m = peer_slack(arena, state.uas, i, path_m, committed_m, 0.0, slack_m)
    return slack_m >= 0.0


@kernel
def _write_flight(arena, i, heading_rad, turn, climb, share, command):
    """Write the velocity of an evasive flight at a share of full speed.

    Nearest to the heading first: turns 0, 1, -1, 2, -2, ...; the last one goes straight up or down.
    """
    uas = arena.uas[i]
    turns = (turn + 1) // 2 * (1 if turn % 2 else -1)
    heading = heading_rad + turns * 2.0 * math.pi / _TURNS
    speed_mps = uas.speed_mps if turn < _TURNS else 0.0
    down_mps = (0.0, -uas.climb_mps, uas.descent_mps)[climb]
    north_mps, east_mps = speed_mps * math.cos(heading), speed_mps * math.sin(heading)
    write_command(command, CLIMB, share * north_mps, share * east_mps, share * down_mps)


@kernel
def _keep_better(arena, state, i, command, tail_m, best):
    """Keep a flight if it has more room than the best so far, in the columns _ROOM to _DOWN."""
    room_m = room_from_movers(arena, state.step[0], i, tail_m)
    if room_m > best[_ROOM]:
        best[_ROOM] = room_m
        for axis in range(3):
            best[_NORTH + axis] = command.values[axis]


@kernel
def _look_far(arena, state, i, heading_rad, nonlinear, command, path_m, tail_m, committed_m, best):
    """Look for the best flight at full speed, held for some seconds."""
    for turn in range(_TURNS + 1):
        for climb in range(3):
            _write_flight(arena, i, heading_rad, turn, climb, 1.0, command)
            if not _is_provable(arena, state, i, command, nonlinear, path_m, committed_m):
                continue
            for held_s in _HELD_S:
                n_held = max(1, round(held_s / arena.rules[0].dt_s))
                if _is_open(arena, state, i, command, n_held, nonlinear, tail_m, committed_m):
                    _keep_better(arena, state, i, command, tail_m, best)


@kernel
def _look_near(arena, state, i, heading_rad, nonlinear, command, path_m, tail_m, committed_m, best):
    """Look for the best flight as far as there is room, slower ones too, by halving."""
    longest = max(1, round(_HELD_S[0] / arena.rules[0].dt_s))
    for turn in range(_TURNS + 1):
        for climb in range(3):
            for share in _SHARES:
                _write_flight(arena, i, heading_rad, turn, climb, share, command)
                if not _is_provable(arena, state, i, command, nonlinear, path_m, committed_m):
                    continue
                fits, at_most = 0, longest
                while fits < at_most:
                    n_held = (fits + at_most + 1) // 2
                    if _is_open(arena, state, i, command, n_held, nonlinear, tail_m, committed_m):
                        _keep_better(arena, state, i, command, tail_m, best)
                        fits = n_held
                    else:
                        at_most = n_held - 1


@allocating_kernel
def evade(arena, state, i, heading_rad, nonlinear, command, path_m, committed_m):
    """Write the command that gets a UAS best out of the way of what moves.

    Directions near to `heading_rad`, where it would like to fly, come first. Written are `command`
    and `path_m`: the command flown for one step and braked.

    Returns:
        Whether braking after the command is clear of all that stands still; if not, nothing is.
    """
    write_brake(command)
    if not _is_provable(arena, state, i, command, nonlinear, path_m, committed_m):
        return False
    tail_m = np.empty(path_m.shape)
    best = stack_array(4)
    best[_ROOM] = room_from_movers(arena, state.step[0], i, path_m)
    best[_NORTH] = best[_EAST] = best[_DOWN] = 0.0
    _look_far(
        arena, state, i, heading_rad, nonlinear, command, path_m, tail_m, committed_m, best
    )  # fmt: skip
    if best[_ROOM] < 0.0:
        _look_near(
            arena, state, i, heading_rad, nonlinear, command, path_m, tail_m, committed_m, best
        )  # fmt: skip
    write_command(command, CLIMB, best[_NORTH], best[_EAST], best[_DOWN])
    _is_provable(arena, state, i, command, nonlinear, path_m, committed_m)
    return True

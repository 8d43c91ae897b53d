"""Flying along a route without stopping: the velocities of the next steps, searched past obstacles.

A plan is a velocity and an altitude for each of the next steps, until the next waypoint is covered.
It is simulated with the vehicle's own inner loop. It counts only if it, with braking after its last
step, is clear of what is fixed and of what moves as now, and if braking after its first step is
clear of what is fixed. A network says how long the two waypoints after it take from the state
reached. The search begins with the plan of the step before, with the velocity that `leg_flight`
would choose, and with ways straight, over and round; then parts of the best plan are changed at
random. Its first velocity is flown, so nothing that the network gets wrong misses a waypoint.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.route.layers import value_of
from uas_coverage_agents.route.leg_flight import (
    AHEAD,
    EAST,
    MOST_HELD,
    N_FLIGHT,
    NORTH,
    aim_ahead,
    covers,
    observe_places,
    over_roofs,
    spare_distance,
    steer_to,
)
from uas_coverage_agents.route.places import detour_s, places_along, write_place
from uas_coverage_env.autopilot.control import write_brake, write_command
from uas_coverage_env.autopilot.lookahead import (
    PLENTY_M,
    fixed_slack,
    fly_kinematically,
    moving_slack,
)
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.entities.commands import COMMAND_DTYPE, VELOCITY
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world.height import lowest_altitude
from uas_coverage_env.world.routes import NO_WAY, route

HORIZON = 24
"""Steps of a plan at most."""

TRIES = 300
"""Changes that are tried in each step of a flight."""

STRAIGHT, OVER, ROUND = range(3)
"""Ways to aim: at the place itself, as the world's routes lead, or round what could be passed
over."""

_MISSED_S = 20.0  # what a plan costs that does not cover the waypoint
_BRAKING, _STANDS_MPS = 12, 0.1
_LEAD_S = 1.2
_BEGIN_SPEEDS = (1.0, 0.7)
_BASE_HELD = 3
_BRAKED, _SLOW_SPEEDS = 5, (1.0, 0.4)  # where nothing else is clear
_LONGEST = 4  # steps that a change concerns
_DECADES = 1.5  # over which the sizes of changes are spread
_TURN_RAD, _RISE_M = 1.5, 3.0  # largest changes
_SPEED, _ALTITUDE, _ANEW = 0.4, 0.2, 0.1  # how often they concern speed, altitude, what follows


class Workspace(NamedTuple):
    """How long a search goes on, and arrays that it writes to.

    Attributes:
        tries: Changes that are tried in each step.
        slow_starts: Whether plans may begin slowly or with braking where none else is clear.
        x: (14,) a state.
        reference: (2,) of the inner loop.
        u: (5,) inputs.
        command: (1,) of COMMAND_DTYPE.
        row: (N_FLIGHT,) what the network reads.
        path_m: (N, 3) positions of a plan and of braking after it.
        braking_m: (N, 3) positions of braking after its first step.
        trial: (HORIZON, 3) a plan that is tried.
        best: (HORIZON, 3) the best so far.
        aims_m: (AHEAD, 3) where the coming spheres are touched on a short way.
        ahead: (AHEAD, 5) the next waypoints, home repeated at the end.
        rows: (AHEAD,) their rows in `route`.
        places: (AHEAD, 5) the same with the corners on the way.
        base: (3,) what `leg_flight` would fly.
    """

    tries: int
    slow_starts: bool
    x: NDArray[np.float64]
    reference: NDArray[np.float64]
    u: NDArray[np.float64]
    command: NDArray[np.void]
    row: NDArray[np.float64]
    path_m: NDArray[np.float64]
    braking_m: NDArray[np.float64]
    trial: NDArray[np.float64]
    best: NDArray[np.float64]
    aims_m: NDArray[np.float64]
    ahead: NDArray[np.float64]
    rows: NDArray[np.int64]
    places: NDArray[np.float64]
    base: NDArray[np.float64]


def search_workspace(
    lookahead_steps: int, tries: int = TRIES, *, slow_starts: bool = False
) -> Workspace:
    """An empty one; `lookahead_steps` are those of the arena's rules."""
    return Workspace(
        tries=tries,
        slow_starts=slow_starts,
        x=np.zeros(S.N_STATES),
        reference=np.zeros(2),
        u=np.zeros(S.N_INPUTS),
        command=np.zeros(1, COMMAND_DTYPE),
        row=np.zeros(N_FLIGHT),
        path_m=np.zeros((HORIZON + _BRAKING + 1, 3)),
        braking_m=np.zeros((lookahead_steps + MOST_HELD, 3)),
        trial=np.zeros((HORIZON, 3)),
        best=np.zeros((HORIZON, 3)),
        aims_m=np.zeros((AHEAD, 3)),
        ahead=np.zeros((AHEAD, 5)),
        rows=np.zeros(AHEAD, np.int64),
        places=np.zeros((AHEAD, 5)),
        base=np.zeros(3),
    )


@allocating_kernel
def _step(vehicle, values, workspace, belief):
    """Fly `workspace.x` on for a step."""
    write_command(workspace.command[0], VELOCITY, values[0], values[1], values[2])
    fly_kinematically(
        vehicle, workspace.x, workspace.reference, workspace.command[0], workspace.u, belief
    )


@allocating_kernel
def _note(workspace, n):
    workspace.path_m[n, 0], workspace.path_m[n, 1], workspace.path_m[n, 2] = (
        workspace.x[S.X],
        workspace.x[S.Y],
        workspace.x[S.Z],
    )


@allocating_kernel
def _is_clear(arena, i, x, reference, first, steps, workspace, belief):
    """Whether the plan just flown, and braking after its first and last step, is clear."""
    command, n = workspace.command[0], steps
    write_brake(command)
    while n < steps + _BRAKING:
        fly_kinematically(
            arena.vehicles[i], workspace.x, workspace.reference, command, workspace.u, belief
        )
        n += 1
        _note(workspace, n)
        if math.hypot(workspace.x[S.VX], workspace.x[S.VY]) < _STANDS_MPS:
            break
    slack_m = fixed_slack(arena, i, workspace.path_m[: n + 1], n, 0.0, PLENTY_M)
    if moving_slack(arena, 0, i, workspace.path_m[: n + 1], 0.0, slack_m) < 0.0:
        return False
    write_command(command, VELOCITY, first[0], first[1], first[2])
    spare_m = spare_distance(arena, i, x, reference, command, 1, 0.0, workspace.braking_m, belief)
    return spare_m >= 0.0


@allocating_kernel
def _weigh(arena, around, i, x, reference, plan, layers, best_s, workspace, belief):
    """Time [s] of a plan and of what comes after it, inf if not clear or not below `best_s`.

    Returns:
        The time, and the steps of the plan.
    """
    uas, there, ahead = arena.uas[i], workspace.x, workspace.ahead
    there[:] = x
    workspace.reference[:] = reference
    _note(workspace, 0)
    steps, covered = 0, False
    while steps < HORIZON and not covered:
        _step(arena.vehicles[i], plan[steps], workspace, belief)
        steps += 1
        _note(workspace, steps)
        covered = covers(there, ahead[0])
    cost_s = steps * arena.vehicles[i].dt_s
    if covered:
        cost_s += observe_places(
            there,
            workspace.reference,
            uas.speed_mps,
            ahead[1],
            ahead[2],
            ahead[AHEAD - 1],
            workspace.row,
        )
        cost_s += value_of(layers, workspace.row)
    else:
        # with the places after it, as in the time of a plan that covers it
        way_m = math.hypot(ahead[0, NORTH] - there[S.X], ahead[0, EAST] - there[S.Y])
        for k in range(1, AHEAD):
            way_m += math.hypot(
                ahead[k, NORTH] - ahead[k - 1, NORTH], ahead[k, EAST] - ahead[k - 1, EAST]
            )
        cost_s += _MISSED_S + way_m / uas.speed_mps
    if cost_s >= best_s:
        return np.inf, steps
    k = 1 if covered else 0
    cost_s += detour_s(arena, around, i, workspace.rows[k], there, ahead[k])
    if cost_s >= best_s or not _is_clear(arena, i, x, reference, plan[0], steps, workspace, belief):
        return np.inf, steps
    return cost_s, steps


@allocating_kernel
def _aim(arena, around, i, x, reference, plan, first, way, share, workspace, belief):
    """Fill a plan from step `first` on: towards the next waypoint, and then the one after it."""
    uas, there, k = arena.uas[i], workspace.x, 0
    there[:] = x
    workspace.reference[:] = reference
    for step in range(HORIZON):
        if step >= first:
            north_m, east_m, down_m = workspace.aims_m[k]
            altitude_m, speed_mps = -down_m, share * uas.speed_mps
            if way != STRAIGHT:
                known = around if way == ROUND else arena
                north_m, east_m, _, leg = route(
                    known,
                    workspace.rows[k],
                    there[S.X],
                    there[S.Y],
                    there[S.Z],
                    north_m,
                    east_m,
                    down_m,
                )
                needed_m, most_mps = over_roofs(known, there, north_m, east_m, -down_m, uas, leg)
                altitude_m, speed_mps = max(altitude_m, needed_m), min(speed_mps, most_mps)
            north_m, east_m = north_m - there[S.X], east_m - there[S.Y]
            now_mps = math.hypot(there[S.VX], there[S.VY])
            lead_s = min(_LEAD_S, math.hypot(north_m, east_m) / (2.0 * now_mps + 1e-9))
            north_m, east_m = north_m - lead_s * there[S.VX], east_m - lead_s * there[S.VY]
            length_m = math.hypot(north_m, east_m) + 1e-9
            plan[step, 0] = speed_mps * north_m / length_m
            plan[step, 1] = speed_mps * east_m / length_m
            plan[step, 2] = max(altitude_m, lowest_altitude(arena, i, there[S.X], there[S.Y]))
        _step(arena.vehicles[i], plan[step], workspace, belief)
        if k == 0 and covers(there, workspace.ahead[0]):
            k = 1


@allocating_kernel
def _change(plan, used, speed_mps, rng):
    """Change a part of the steps that are used at random; the step after it."""
    first = int(rng.random() * used)
    end = min(used, first + 1 + int(rng.random() * _LONGEST))
    size = 10.0 ** (-_DECADES * rng.random())
    angle = (2.0 * rng.random() - 1.0) * _TURN_RAD * size
    factor = 1.0 + (rng.random() - 0.6) * size if rng.random() < _SPEED else 1.0
    rise_m = (2.0 * rng.random() - 1.0) * _RISE_M * size if rng.random() < _ALTITUDE else 0.0
    cosine, sine = factor * math.cos(angle), factor * math.sin(angle)
    for step in range(first, end):
        north, east = plan[step, 0], plan[step, 1]
        north, east = cosine * north - sine * east, sine * north + cosine * east
        share = min(1.0, speed_mps / (math.hypot(north, east) + 1e-9))
        plan[step, 0], plan[step, 1] = share * north, share * east
        plan[step, 2] += rise_m
    return end


@allocating_kernel
def _begin(arena, around, i, x, reference, layers, plan, kept, has_base, workspace, belief):
    """Write the best plan to begin with to `workspace.best`: (time [s], steps used, its way)."""
    trial, best = workspace.trial, workspace.best
    best_s, used, way = np.inf, HORIZON, OVER
    if kept:
        best[:] = plan
        best_s, used = _weigh(
            arena, around, i, x, reference, plan, layers, best_s, workspace, belief
        )
    for begins in (OVER, ROUND, STRAIGHT):
        for share in _BEGIN_SPEEDS:
            _aim(arena, around, i, x, reference, trial, 0, begins, share, workspace, belief)
            cost_s, steps = _weigh(
                arena, around, i, x, reference, trial, layers, best_s, workspace, belief
            )
            if cost_s < best_s:
                best_s, used, way = cost_s, steps, begins
                best[:] = trial
    for held in range(1, _BASE_HELD + 1 if has_base else 0):
        trial[:held] = workspace.base
        _aim(arena, around, i, x, reference, trial, held, OVER, 1.0, workspace, belief)
        cost_s, steps = _weigh(
            arena, around, i, x, reference, trial, layers, best_s, workspace, belief
        )
        if cost_s < best_s:
            best_s, used = cost_s, steps
            best[:] = trial
    if best_s < np.inf or not workspace.slow_starts:
        return best_s, used, way
    for held in range(_BRAKED):
        trial[:held, :2] = 0.0
        trial[:held, 2] = -x[S.Z]
        for begins in (OVER, ROUND, STRAIGHT):
            for share in _SLOW_SPEEDS:
                _aim(arena, around, i, x, reference, trial, held, begins, share, workspace, belief)
                cost_s, steps = _weigh(
                    arena, around, i, x, reference, trial, layers, best_s, workspace, belief
                )
                if cost_s < best_s:
                    best_s, used, way = cost_s, steps, begins
                    best[:] = trial
    return best_s, used, way


@allocating_kernel
def _search(arena, around, i, x, reference, layers, plan, kept, has_base, rng, workspace, belief):
    """Write the best plan found to the first of `workspace.ahead`; whether there is one."""
    trial, best, speed_mps = workspace.trial, workspace.best, arena.uas[i].speed_mps
    aim_ahead(arena.vehicles[i], x, workspace.ahead, workspace.aims_m)
    best_s, used, way = _begin(
        arena, around, i, x, reference, layers, plan, kept, has_base, workspace, belief
    )
    if best_s == np.inf:
        return False
    for _ in range(workspace.tries):
        trial[:] = best
        end = _change(trial, used, speed_mps, rng)
        if rng.random() < _ANEW:
            _aim(arena, around, i, x, reference, trial, end, way, 1.0, workspace, belief)
        cost_s, steps = _weigh(
            arena, around, i, x, reference, trial, layers, best_s, workspace, belief
        )
        if cost_s < best_s:
            best_s, used = cost_s, steps
            best[:] = trial
    plan[:] = best
    return True


@allocating_kernel
def search_along(
    arena, around, i, x, reference, targets, layers, plan, kept, rng, workspace, belief
):
    """Write the plan whose first row is to be flown by UAS i.

    Args:
        arena: The arena.
        around: The same with its obstacles raised, see `places`.
        i: Index of the UAS.
        x: (14,) its state.
        reference: (2,) [m/s] of its inner loop.
        targets: At most AHEAD, the next waypoints of its route; after them comes home.
        layers: `Layers`.
        plan: (HORIZON, 3) velocity north and east [m/s] and altitude [m]; what is left of the plan
            of the step before, written.
        kept: Whether there is one.
        rng: Of the changes.
        workspace: `Workspace`.
        belief: (N_BELIEF,) of its inner loop, where a wind is known; None: in still air.

    Returns:
        Whether there is one that is clear. Where not, the world's guidance knows better.
    """
    n_targets = len(targets)
    leg, needed_m, speed_mps = places_along(
        arena, around, i, x, targets, n_targets, workspace.places
    )
    command = workspace.command[0]
    has_base = leg != NO_WAY and steer_to(
        arena, i, x, reference, workspace.places, needed_m, speed_mps, layers, 1, 0.0, command
    )
    workspace.base[:] = command.values[:3]
    if n_targets > 0:
        for k in range(AHEAD):
            workspace.rows[k] = write_place(arena, i, targets, n_targets, k, workspace.ahead[k])
        if _search(
            arena, around, i, x, reference, layers, plan, kept, has_base, rng, workspace, belief
        ):
            return True
    plan[:] = workspace.base
    # of one step only, weighed as in still air
    return has_base and belief is None

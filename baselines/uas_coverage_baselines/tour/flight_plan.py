"""Flight plans: how to fly the coming waypoints of a route, improved by trying it out.

A local search changes the plan, simulates the flight with the inner loop and the dynamics that the
world flies, and keeps what comes home earlier. So turning before a waypoint is reached, cutting
through its sphere and landing without hesitation come out of the search.
"""

from __future__ import annotations

import math

from uas_coverage_baselines.tour.cost import SAFE_BELOW_S, cost_s, distances_kept, surroundings_cost
from uas_coverage_baselines.tour.pursuit import (
    LEGS,
    aim,
    begin,
    pull_clear,
    push_to,
    push_to_guidance,
)
from uas_coverage_env.compiled.kernels import allocating_kernel

_STRETCH_S = 5.0  # the longest stretch that a change touches


@allocating_kernel
def _change(arena, i, task, plan, rng, spread):
    """Change a plan in place; the step from which on it is another flight."""
    n_steps = plan.commands.shape[0]
    n_legs = min(len(task.route), LEGS)
    kind = rng.random()
    if n_legs == 0 or kind < 0.45:
        longest = max(1, min(n_steps, round(_STRETCH_S / arena.rules[0].dt_s)))
        first = int(n_steps * rng.random() * rng.random())
        last = min(n_steps, first + rng.integers(1, longest + 1))
        kept = 0.0 if rng.random() < 0.15 else 1.0
        north_mps, east_mps, up_m, speed = 0.0, 0.0, 0.0, 1.0
        what = rng.random()
        if what < 0.6:
            north_mps, east_mps = rng.normal() * 5.0 * spread, rng.normal() * 5.0 * spread
        elif what < 0.8:
            speed = rng.random()
        elif what < 0.95:
            up_m = rng.normal() * 8.0 * spread
        for k in range(first, last):
            plan.push[k, 0] = kept * plan.push[k, 0] + north_mps
            plan.push[k, 1] = kept * plan.push[k, 1] + east_mps
            plan.push[k, 2] = kept * plan.push[k, 2] + up_m
            if what >= 0.6:
                plan.share[k] = speed
        return first
    leg = int(n_legs * rng.random() * rng.random())
    first = 0
    while first < n_steps and plan.leg[first] < leg:
        first += 1
    if kind < 0.85:
        sigma_m = 0.5 * arena.waypoints[task.route[leg]].radius_m * spread
        level = rng.random() < 0.7
        for axis in range(3):
            if (axis < 2) == level:
                plan.aim_m[leg, axis] += rng.normal() * sigma_m
        pull_clear(arena, i, task, plan, leg)
    else:
        plan.early_m[leg] = max(0.0, plan.early_m[leg] + rng.normal() * 12.0 * spread)
    return first


@allocating_kernel
def _copy(plan, other, first):
    plan.aim_m[:] = other.aim_m
    plan.share[:] = other.share
    plan.early_m[:] = other.early_m
    plan.push[:] = other.push
    plan.commands[first:] = other.commands[first:]
    plan.x[first:] = other.x[first:]
    plan.reference[first:] = other.reference[first:]
    plan.covered[first:] = other.covered[first:]
    plan.leg[first:] = other.leg[first:]
    plan.path_m[first:] = other.path_m[first:]


@allocating_kernel
def improve(
    arena, i, task, others_m, plan, trial, n_kept, n_changes, rng, command, belief=None, led=None
):
    """Plan the coming seconds of a UAS.

    Args:
        arena: The arena; its moving obstacles are where they are now, in row 0.
        i: Index of the UAS.
        task: What it has to do.
        others_m: (U, N+1, 3) [m] where the others are going; NaN where none is flying.
        plan: What is left of the plan before is tried; written. Its first state, and reference of
            the inner loop, are those of now.
        trial: Another plan of the same size, written.
        n_kept: How many legs of the plan before are left; the others are aimed anew.
        n_changes: How many changes are tried.
        rng: Source of random numbers.
        command: A record of COMMAND_DTYPE, written.
        belief: (N_BELIEF,) of its inner loop; None: in still air.
        led: (N, 3) commands that are flown as they are where they are safe; None, or none: those
            found here.

    Returns:
        Estimated flight time to the end [s]; above SAFE_BELOW_S where the plan is not safe.
    """
    x, reference = plan.x[0], plan.reference[0]
    around = distances_kept(arena, i, x, others_m)
    n_legs = min(len(task.route), LEGS)
    begin(plan, x, reference)
    begin(trial, x, reference)
    for leg in range(n_legs):
        aim(arena, i, task, trial, leg)
        if leg >= n_kept:
            aim(arena, i, task, plan, leg)
    if led is not None and len(led):
        trial.share[:] = 1.0
        push_to(arena, i, task, trial, led, command, belief)
        cost = cost_s(arena, i, task, trial, 0, around, command, math.inf, belief)
        n_steps = len(led)
        if (
            cost < SAFE_BELOW_S
            and surroundings_cost(arena, i, task, trial, n_steps, others_m) <= 0.0
        ):
            _copy(plan, trial, 0)
            return cost
    trial.push[:] = 0.0
    trial.share[:] = 1.0
    best = cost_s(arena, i, task, trial, 0, around, command, math.inf, belief)
    cost = cost_s(arena, i, task, plan, 0, around, command, math.inf, belief)
    if cost >= SAFE_BELOW_S:  # what is new is its last step: brake there
        plan.share[-1] = 0.0
        cost = cost_s(arena, i, task, plan, 0, around, command, math.inf, belief)
    if cost < best:
        best = cost
        _copy(trial, plan, 0)
    _copy(plan, trial, 0)
    push_to_guidance(arena, i, task, trial, command, belief)
    cost = cost_s(arena, i, task, trial, 0, around, command, best, belief)
    if cost < best:
        best = cost
        _copy(plan, trial, 0)
    _copy(trial, plan, 0)
    for change in range(n_changes):
        spread = 1.0 - 0.8 * change / n_changes
        first = _change(arena, i, task, trial, rng, spread)
        # steps before the change are known to be clear, unless the plan so far is unflyable
        since = first if best < SAFE_BELOW_S else 0
        cost = cost_s(arena, i, task, trial, since, around, command, best, belief)
        if cost < best - 1e-9:
            best = cost
            _copy(plan, trial, since)
        else:
            _copy(trial, plan, since)
    return best

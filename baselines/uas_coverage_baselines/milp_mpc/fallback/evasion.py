"""Getting out of the way: what is flown when no plan has come and hovering would end in harm.

A backup trajectory ends in a hover, and it is verified for as long as it lasts. Something that
moves may come to a UAS that hovers longer than that, or change its velocity towards it. Then each
UAS, in turn, brakes, flies what is left of its backup trajectory, or flies some seconds in one of a
few directions and brakes, with the vehicle's inner loop. Of these flights it takes the one that
comes least too close to anything; of those that are clear one that keeps the vehicle's limits, and
of them the shortest. No solver is asked.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.fallback.backup import course_of, prolonged
from uas_coverage_baselines.milp_mpc.model.height import too_low_m
from uas_coverage_baselines.milp_mpc.model.norm_bounds import exceeds_limits
from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem
from uas_coverage_env.geometry.round_shapes import outside_upright_m
from uas_coverage_env.planning.backup.braking import pushed
from uas_coverage_env.planning.backup.course import braked
from uas_coverage_env.vehicle import compile_vehicle
from uas_coverage_env.vehicle.scale import braking_s

FloatArray = NDArray[np.float64]
_PUSHES_S = (2.0, 5.0, 10.0)  # how long a direction is held
_HEADINGS = 12
_BETWEEN = np.linspace(0.0, 1.0, 4, endpoint=False)[:, None]  # points measured of each step


def evasion(problem: PlanningProblem, dt_s: float, backup: Plan | None = None) -> Plan | None:
    """A flight of all UAS out of the way of everything, or as far as that is possible.

    None where no UAS can do better than to brake at once.

    Args:
        problem: the decision; moving obstacles keep their velocities.
        dt_s: sampling time.
        backup: what is left of the last backup trajectory, beginning now; None where there is none.
    """
    longest_s = max(_PUSHES_S) + braking_s(problem.vehicles, dt_s)
    steps = int(np.ceil(longest_s / dt_s))
    ahead = replace(problem, moving=prolonged(problem, steps))
    flights = [_flights(problem, uas, backup, steps, dt_s) for uas in range(problem.n_uas)]
    # the first flight of each is braking at once, which is kept where it is clear
    chosen = [0] * problem.n_uas
    alone = [_too_close(ahead, uas, x) for uas, (x, _) in enumerate(flights)]
    for uas in np.argsort([cost[0] for cost in alone], kind="stable"):
        x, _ = flights[uas]
        cost = alone[uas].copy()
        for other in range(problem.n_uas):
            if other != uas:
                apart = _dense(x[..., :3] - flights[other][0][chosen[other], :, :3])
                cost += _squared(problem.separation_m[uas, other] - outside_upright_m(apart))
        moved_m = np.linalg.norm(x[:, -1, :3] - x[0, -1, :3], axis=1)
        # the inner loop may take over in the middle of a planned manoeuvre
        vehicle, bounds = problem.vehicles[uas], problem.norm_bounds[uas]
        exceeds = [exceeds_limits(vehicle, bounds, each[1:]) for each in x]
        # of directions that are as good the first, whatever the last digits say
        chosen[uas] = int(np.lexsort((moved_m.round(6), exceeds, cost.round(6)))[0])
    if not any(chosen):
        return None
    rows = [flights[uas][0][chosen[uas]] for uas in range(problem.n_uas)]
    inputs = [flights[uas][1][chosen[uas]] for uas in range(problem.n_uas)]
    covers = np.zeros((problem.n_uas, steps, problem.n_scenario_waypoints), bool)
    return Plan(problem.names, np.array(rows), np.array(inputs), covers, 0.0, -np.inf)


def _flights(
    problem: PlanningProblem, uas: int, backup: Plan | None, steps: int, dt_s: float
) -> tuple[FloatArray, FloatArray]:
    """States (C, steps+1, 14) and inputs (C, steps, 5): braking, the backup, other directions."""
    limits = problem.vehicles[uas].limits
    record = compile_vehicle(problem.vehicles[uas], dt_s)[()]
    angles = 2.0 * np.pi * np.arange(_HEADINGS) / _HEADINGS
    level = [(0.0, 0.0)]
    level += [(limits.v_xy_max_mps * np.cos(a), limits.v_xy_max_mps * np.sin(a)) for a in angles]
    down = (0.0,) if problem.planar else (0.0, -limits.v_up_max_mps, limits.v_down_max_mps)
    pushes = [int(np.ceil(push_s / dt_s)) for push_s in _PUSHES_S]
    ways = [(0.0, 0.0, 0.0, 0)]
    ways += [(*a, d, push) for a, d, push in product(level, down, pushes) if (*a, d) != (0, 0, 0)]
    flown = [pushed(record, problem.x0[uas], *way, steps) for way in ways]
    if backup is not None and problem.names[uas] in backup.names:
        left = course_of(backup, problem.names[uas])
        followed = min(len(left.u), steps)
        held = braked(record, left, followed, steps - followed)
        flown.insert(1, (held.x, held.u))
    return np.array([x for x, _ in flown]), np.array([u for _, u in flown])


def _too_close(problem: PlanningProblem, uas: int, x: FloatArray) -> FloatArray:
    """(C,) how far flights are too close to anything, or too low, squared and summed.

    Where a UAS is too close already, getting out sooner is better.
    """
    path = _dense(x[..., :3])
    cost = _squared(problem.fence.signed_distance(path) + problem.fence_margin_m)
    cost += (too_low_m(problem, uas, x[..., :3]) ** 2).sum(axis=1)
    for (_, hull), clearance in zip(
        problem.obstacles, problem.obstacle_clearance_m[uas], strict=True
    ):
        cost += _squared(clearance - hull.signed_distance(path))
    for moving, clearance in zip(problem.moving, problem.moving_clearance_m[uas], strict=True):
        away = path - _dense(moving.position_m[None, : x.shape[1]])
        size_m = moving.radius_m, moving.half_height_m
        cost += _squared(clearance - outside_upright_m(away, *size_m))
    return cost


def _dense(path: FloatArray) -> FloatArray:
    """(C, 4 steps + 1, 3) points of straight segments; the path's own among them."""
    start, way = path[:, :-1, None], np.diff(path, axis=1)[:, :, None]
    between = (start + _BETWEEN * way).reshape(len(path), -1, 3)
    return np.concatenate([between, path[:, -1:]], axis=1)


def _squared(short_m: FloatArray) -> FloatArray:
    return (np.maximum(short_m, 0.0) ** 2).sum(axis=1)

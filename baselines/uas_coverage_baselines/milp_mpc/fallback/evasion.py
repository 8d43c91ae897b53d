"""Getting out of the way: what is flown when no plan has come and hovering would end in harm.

A backup trajectory ends in a hover, and it is verified for as long as it lasts. Something that
moves may come to a UAS that hovers longer than that, or change its velocity towards it. Then each
UAS, in turn, brakes, flies what is left of its backup trajectory, or flies some seconds in one of a
few directions and brakes, with the vehicle's inner loop. That loop takes over from the backup
trajectory as soon as it keeps the vehicle's limits: in the middle of a planned manoeuvre it may
not. Each UAS takes a flight without a contact, of these one that keeps the limits, of these the one
that is least in breach, then the one that comes least too close to anything, and of those that are
clear the shortest. No solver is asked.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.margins import Margins
from uas_coverage_baselines.milp_mpc.fallback.backup import course_of, prolonged
from uas_coverage_baselines.milp_mpc.model.height import too_low_m
from uas_coverage_baselines.milp_mpc.model.norm_bounds import exceeds_limits
from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem
from uas_coverage_env.geometry.round_shapes import outside_upright_m
from uas_coverage_env.planning.backup.braking import pushed
from uas_coverage_env.planning.backup.course import Course, braked
from uas_coverage_env.vehicle import compile_vehicle
from uas_coverage_env.vehicle.governor import time_scale
from uas_coverage_env.vehicle.scale import braking_s

FloatArray = NDArray[np.float64]
_PUSHES_S = (2.0, 5.0, 10.0)  # how long a direction is held, at the time scale 1
_HEADINGS = 12
_BETWEEN = np.linspace(0.0, 1.0, 4, endpoint=False)[:, None]  # points measured of each step


@dataclass(frozen=True)
class Asked:
    """What the distances of a decision are made of.

    Attributes:
        radius_m: of UAS, by name.
        margins: that are added to what the rules ask for.
        fence_margin_m: that the rules ask for.
    """

    radius_m: Mapping[str, float]
    margins: Margins
    fence_margin_m: float

    def levels(self, problem: PlanningProblem) -> tuple[PlanningProblem, ...]:
        """The decision with the distances below which there is a contact, a breach, too little."""
        radius_m = np.array([self.radius_m[name] for name in problem.names])
        contact = replace(
            problem,
            obstacle_clearance_m=radius_m[:, None] + 0.0 * problem.obstacle_clearance_m,
            moving_clearance_m=radius_m[:, None] + 0.0 * problem.moving_clearance_m,
            separation_m=radius_m[:, None] + radius_m,
            fence_margin_m=0.0,
            min_height_m=0.0,
        )
        breach = replace(
            problem,
            obstacle_clearance_m=problem.obstacle_clearance_m - self.margins.fixed_m,
            moving_clearance_m=problem.moving_clearance_m - self.margins.moving_m,
            separation_m=problem.separation_m - self.margins.fixed_m,
            fence_margin_m=self.fence_margin_m,
        )
        return contact, breach, problem


def evasion(
    problem: PlanningProblem, dt_s: float, backup: Plan | None = None, asked: Asked | None = None
) -> Plan | None:
    """A flight of all UAS out of the way of everything, or as far as that is possible.

    None where no UAS can do better than to brake at once.

    Args:
        problem: the decision; moving obstacles keep their velocities.
        dt_s: sampling time.
        backup: what is left of the last backup trajectory, beginning now; None where there is none.
        asked: what its distances are made of; None: one distance is as bad as the other.
    """
    longest_s = max(_PUSHES_S) + braking_s(problem.vehicles, dt_s)
    steps = int(np.ceil(longest_s / dt_s))
    ahead = replace(problem, moving=prolonged(problem, steps))
    levels = (ahead,) if asked is None else asked.levels(ahead)
    flights = [_flights(problem, uas, backup, steps, dt_s) for uas in range(problem.n_uas)]
    # the first flight of each is braking at once, which is kept where it is clear
    chosen = [0] * problem.n_uas
    alone = [[_too_close(level, uas, x) for level in levels] for uas, (x, _) in enumerate(flights)]
    for uas in np.argsort([costs[-1][0] for costs in alone], kind="stable"):
        x, _ = flights[uas]
        costs = [cost.copy() for cost in alone[uas]]
        for other in range(problem.n_uas):
            if other != uas:
                apart = _dense(x[..., :3] - flights[other][0][chosen[other], :, :3])
                for level, cost in zip(levels, costs, strict=True):
                    cost += _squared(level.separation_m[uas, other] - outside_upright_m(apart))
        vehicle, bounds = problem.vehicles[uas], problem.norm_bounds[uas]
        exceeds = [exceeds_limits(vehicle, bounds, each[1:]) for each in x]
        # braking at once is how to move least, or else the backup
        moved_m = np.linalg.norm(x[:, -1, :3] - x[np.argmin(exceeds[:2]), -1, :3], axis=1)
        # of directions that are as good the first, whatever the last digits say
        contact, *others = [cost.round(6) for cost in costs]
        keys = (contact, exceeds, *others) if others else (exceeds, contact)
        chosen[uas] = int(np.lexsort((moved_m.round(6), *reversed(keys)))[0])
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
    vehicle, x0 = problem.vehicles[uas], problem.x0[uas]
    record = compile_vehicle(vehicle, dt_s)[()]
    flown = [pushed(record, x0, 0.0, 0.0, 0.0, 0, steps)]
    left = Course(0, x0[None], np.zeros((0, 5)), False)
    if backup is not None and problem.names[uas] in backup.names:
        left = course_of(backup, problem.names[uas])
        held = braked(record, left, len(left.u), max(steps - len(left.u), 0))
        flown.append((held.x[: steps + 1], held.u[:steps]))
    lag = _handed_over(problem, uas, left, flown[0][0], steps, dt_s)
    start = np.ascontiguousarray(left.x[lag]) if lag else x0
    for way in _ways(problem, uas, dt_s):
        x, u = pushed(record, start, *way, steps - lag)
        flown.append((np.vstack([left.x[:lag], x]), np.vstack([left.u[:lag], u])))
    return np.array([x for x, _ in flown]), np.array([u for _, u in flown])


def _handed_over(
    problem: PlanningProblem, uas: int, left: Course, braking: FloatArray, steps: int, dt_s: float
) -> int:
    """First step of a backup trajectory at which braking keeps the limits; 0 where none does."""
    vehicle, bounds = problem.vehicles[uas], problem.norm_bounds[uas]
    if not left.begins_at(problem.x0[uas]) or not exceeds_limits(vehicle, bounds, braking[1:]):
        return 0
    record = compile_vehicle(vehicle, dt_s)[()]
    for lag in range(1, min(len(left.u), steps) + 1):
        if not exceeds_limits(vehicle, bounds, braked(record, left, lag, steps - lag).x[1:]):
            return lag
    return 0


def _ways(problem: PlanningProblem, uas: int, dt_s: float) -> list[tuple[float, float, float, int]]:
    """Velocities north, east and down, and for how many steps they are held."""
    vehicle = problem.vehicles[uas]
    limits, scale = vehicle.limits, min(time_scale(vehicle, dt_s), 1.0)
    angles = 2.0 * np.pi * np.arange(_HEADINGS) / _HEADINGS
    level = [(0.0, 0.0)]
    level += [(limits.v_xy_max_mps * np.cos(a), limits.v_xy_max_mps * np.sin(a)) for a in angles]
    down = (0.0,) if problem.planar else (0.0, -limits.v_up_max_mps, limits.v_down_max_mps)
    pushes = [int(np.ceil(scale * push_s / dt_s)) for push_s in _PUSHES_S]
    return [
        (0.0, 0.0, 0.0, 0),
        *((*a, d, n) for a, d, n in product(level, down, pushes) if (*a, d) != (0, 0, 0)),
    ]


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

"""Construction: flights along short waypoint sequences, simulated with the world's inner loop.

A MILP solver finds its first good solution of the joint OCP late. Flying every short sequence of
reachable waypoints through the vehicle's own velocity loop takes milliseconds and says which
waypoints can be had when; around the best of these flights a restricted MILP is small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.appraisal import Appraisal, gains
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import (
    NEVER,
    PlanningProblem,
    TourSegment,
    Trajectories,
)
from uas_coverage_baselines.milp_mpc.search.trajectories import PlannedTrajectory
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.geometry.segments import signed_distance
from uas_coverage_env.vehicle import compile_vehicle
from uas_coverage_env.vehicle.inner_loop import velocity_climb_wrench
from uas_coverage_env.vehicle.layout import N_INPUTS, VX, VY, VZ, X, Y, Z
from uas_coverage_env.vehicle.lpv import fly_kinematics

FloatArray = NDArray[np.float64]
_DEPTH = 4
_TOUR_DEPTH = 6
_BRANCHES = (10, 5, 4, 3)
_LEADS_S = (1.0, 2.0)  # how far ahead of itself the UAS aims; which is better depends on the turn
_ROOF_LOOKAHEAD = 4
_SPARE_HEIGHT_M, _SOON_S = 0.3, 2.5


def construct(
    problem: PlanningProblem,
    uas: int,
    dt_s: float,
    keep: int = 40,
    blocks: Sequence[Block] = OCP,
) -> list[PlannedTrajectory]:
    """The most promising flights of one UAS, best first, no two covering the same waypoints.

    Args:
        problem: the decision.
        uas: row of the UAS.
        dt_s: sampling time.
        keep: how many at most.
        blocks: of the OCP.
    """
    appraisal = Appraisal(problem, blocks)
    sequences = _sequences(problem, uas)
    vehicle = compile_vehicle(problem.vehicles[uas], dt_s)[()]
    keep_out = _keep_out(problem, uas)
    target = problem.targets[uas]
    aim = np.full(3, np.nan) if target is None else target.position_m
    if problem.tours and (tour := problem.tours[uas]) is not None:
        turns_m = _turns_m(problem, uas)
        aim = tour.aims_m[-1] if turns_m is None else turns_m
    best: dict[bytes, tuple[float, PlannedTrajectory]] = {}
    for lead_s in _LEADS_S:
        positions, visits, depth = _fly_all(
            vehicle,
            problem.x0[uas],
            sequences,
            problem.waypoints_m,
            problem.waypoint_reach_m,
            problem.waypoint_faces,
            keep_out,
            aim,
            lead_s,
            problem.horizon,
        )
        visits[:, ~problem.assigned[uas]] = NEVER
        costs = appraisal.costs(uas, Trajectories(positions, visits))
        values = gains(problem, visits).sum(axis=1) - costs - depth
        for row in np.argsort(-values, kind="stable")[: 4 * keep]:
            key = (visits[row] < NEVER).tobytes()
            if key not in best or best[key][0] < values[row]:
                flight = PlannedTrajectory(
                    positions[row], visits[row], float(costs[row]), float(depth[row])
                )
                best[key] = (float(values[row]), flight)
    ranked = sorted(best.values(), key=lambda pair: -pair[0])
    return _priced(appraisal, uas, [flight for _, flight in ranked[:keep]], problem)


def _priced(
    appraisal: Appraisal, uas: int, found: Sequence[PlannedTrajectory], problem: PlanningProblem
) -> list[PlannedTrajectory]:
    """Flights with what blocks say of them that are priced by their rows, best first."""
    prices = appraisal.prices_of_paths(uas, [(one.positions_m, one.visit) for one in found])
    priced = [
        replace(one, cost=one.cost + price.cost, too_close_m=one.too_close_m + price.excess)
        for one, price in zip(found, prices, strict=True)
    ]
    # a stable sort: nothing moves where nothing is added
    value = [price.cost + price.excess for price in prices]
    if not any(value):
        return priced
    return sorted(
        priced,
        key=lambda one: one.cost + one.too_close_m - float(gains(problem, one.visit).sum()),
    )


def _sequences(problem: PlanningProblem, uas: int) -> NDArray[np.int64]:
    """(S, _DEPTH) waypoint sequences, padded with -1: near ones first, then their neighbours."""
    if not problem.n_waypoints:
        return np.full((1, _DEPTH), -1, np.int64)
    if problem.tours:
        along = _along(problem.tours[uas])
        # round a corner first: straight to the first waypoint the way is obstructed
        led = _turns_m(problem, uas) is not None
        return np.vstack([np.full((1, _TOUR_DEPTH), -1, np.int64), along]) if led else along
    waypoints = problem.waypoints_m
    ahead = problem.x0[uas, :3] + 1.5 * problem.x0[uas, VX : VZ + 1]
    near = np.argsort(_travel_m(waypoints - ahead), kind="stable")[: _BRANCHES[0]]
    between = _travel_m(waypoints[:, None] - waypoints[None])
    neighbours = np.argsort(between, axis=1, kind="stable")
    sequences: list[tuple[int, ...]] = [()]
    open_ends: list[tuple[int, ...]] = [(int(w),) for w in near]
    for branches in _BRANCHES[1:]:
        sequences += open_ends
        open_ends = [
            (*sequence, int(w))
            for sequence in open_ends
            for w in neighbours[sequence[-1]][: branches + len(sequence)]
            if w not in sequence
        ]
    sequences += open_ends
    padded = np.full((len(sequences), _DEPTH), -1, np.int64)
    for row, sequence in enumerate(sequences):
        padded[row, : len(sequence)] = sequence
    return padded


def _turns_m(problem: PlanningProblem, uas: int) -> FloatArray | None:
    """(3,) where the way to the first waypoint of a tour turns; None where it is straight."""
    tour = problem.tours[uas] if problem.tours else None
    return None if tour is None else tour.led_by_m(problem.waypoints_m)


def _along(tour: TourSegment | None) -> NDArray[np.int64]:
    """(S, _TOUR_DEPTH) a tour, without one of its waypoints, and with two neighbours exchanged."""
    order = [] if tour is None else tour.waypoints[:_TOUR_DEPTH].tolist()
    sequences = [order]
    for k in range(len(order)):
        sequences.append(order[:k] + order[k + 1 :])
        if k + 1 < len(order):
            sequences.append([*order[:k], order[k + 1], order[k], *order[k + 2 :]])
    padded = np.full((len(sequences), _TOUR_DEPTH), -1, np.int64)
    for row, sequence in enumerate(sequences):
        padded[row, : len(sequence)] = sequence
    return padded


def _travel_m(away: FloatArray) -> FloatArray:
    """Horizontal distance, or the height that takes as long to climb or descend."""
    return np.maximum(np.hypot(away[..., 0], away[..., 1]), 4.0 * np.abs(away[..., 2]))


class _KeepOut(NamedTuple):
    """Fixed obstacles, and as the last hull the fence, which is kept to from inside."""

    normals: FloatArray
    """(F, 3)."""
    offsets: FloatArray
    """(F,)."""
    first: NDArray[np.int64]
    """(O+1,) first face of each hull."""
    last: NDArray[np.int64]
    """(O+1,) the one after its last."""
    clearance: FloatArray
    """(O+1,) [m]."""
    min_height_m: float
    home: FloatArray
    """(3,) [m] around which it may be lower."""
    zone_m: float


def _keep_out(problem: PlanningProblem, uas: int) -> _KeepOut:
    hulls = [hull for _, hull in problem.obstacles]
    counts = np.array([hull.n_faces for hull in hulls], np.int64)
    last = np.cumsum(counts)
    normals = np.concatenate([hull.normals for hull in hulls] + [problem.fence.normals])
    offsets = np.concatenate([hull.offsets_m for hull in hulls] + [problem.fence.offsets_m])
    first = np.concatenate([last - counts, [last[-1] if len(last) else 0]]).astype(np.int64)
    last = np.concatenate([last, [len(offsets)]]).astype(np.int64)
    clearance = np.concatenate([problem.obstacle_clearance_m[uas], [problem.fence_margin_m]])
    ground = problem.min_height_m, problem.home_m[uas], problem.landing_zone_m
    return _KeepOut(normals, offsets, first, last, clearance, *ground)


@allocating_kernel
def _out_m(faces, x, center):
    """How far out a position is from the centre of a polyhedron, by its farthest face."""
    out = 0.0
    for f in range(len(faces)):
        along = 0.0
        for axis in range(3):
            along += faces[f, axis] * (x[axis] - center[axis])
        out = max(out, along)
    return out


@allocating_kernel
def _aim_at(center, reach_m, faces, x, following):
    """A point well inside the waypoint's polyhedron on the way to what follows."""
    point = np.empty(3)
    inner_m = 0.8 * reach_m
    for axis in range(3):
        middle = 0.5 * (x[axis] + following[axis])
        point[axis] = min(max(middle, center[axis] - inner_m), center[axis] + inner_m)
    out = _out_m(faces, point, center)
    if out > inner_m:  # a corner of the box beyond a rounder polyhedron
        point[:] = center + (point - center) * (inner_m / out)
    return point


@allocating_kernel
def _distance_m(keep_out, o, north, east, down):
    """Signed distance of a place from hull o [m]."""
    first, last = keep_out.first[o], keep_out.last[o]
    return signed_distance(keep_out.normals, keep_out.offsets, first, last, north, east, down)


@allocating_kernel
def _over_roofs(vehicle, x, down_mps, keep_out):
    """Climb instead where the way ahead leads into an obstacle."""
    for step in range(1, _ROOF_LOOKAHEAD + 1):
        north, east = x[X] + step * x[VX], x[Y] + step * x[VY]
        for o in range(len(keep_out.first) - 1):
            d = _distance_m(keep_out, o, north, east, x[Z] + step * down_mps)
            if d < keep_out.clearance[o] + 0.5:
                return -vehicle.v_up_max_mps
    return down_mps


@allocating_kernel
def _above_ground(x, down_mps, keep_out):
    """Sink no lower than the least height outside of the landing zone; climb where it is lower."""
    if keep_out.min_height_m <= 0.0:
        return down_mps
    north = x[X] + _SOON_S * x[VX] - keep_out.home[0]
    east = x[Y] + _SOON_S * x[VY] - keep_out.home[1]
    if np.hypot(north, east) <= keep_out.zone_m:
        return down_mps
    spare_m = -x[Z] - keep_out.min_height_m - _SPARE_HEIGHT_M
    return min(down_mps, (0.6 if spare_m > 0.0 else 2.0) * spare_m - 0.2 * x[VZ])


@allocating_kernel
def _depth_inside(x, keep_out):
    """How far the position is inside keep-out zones, too low, or outside the fence [m]."""
    depth = 0.0
    if keep_out.min_height_m > 0.0:
        away_m = np.hypot(x[X] - keep_out.home[0], x[Y] - keep_out.home[1])
        if away_m > keep_out.zone_m:
            depth += max(keep_out.min_height_m + x[Z], 0.0)
    fence = len(keep_out.first) - 1
    for o in range(fence):
        d = _distance_m(keep_out, o, x[X], x[Y], x[Z])
        depth += max(keep_out.clearance[o] - d, 0.0)
    d = _distance_m(keep_out, fence, x[X], x[Y], x[Z])
    return depth + max(d + keep_out.clearance[fence], 0.0)


@allocating_kernel(nogil=True)
def _fly_all(
    vehicle,
    x0,
    sequences,
    waypoints,
    reach_m,
    faces,
    keep_out,
    target,
    lead_s,
    horizon,
):
    """Fly every sequence; positions (S, N+1, 3), first visits (S, W), depth inside (S,)."""
    S, W = sequences.shape[0], waypoints.shape[0]
    positions = np.empty((S, horizon + 1, 3))
    visits = np.full((S, W), NEVER, np.int64)
    depths = np.zeros(S)
    x = np.empty(x0.shape[0])
    u = np.zeros(N_INPUTS)
    reference = np.empty(2)
    has_target = not np.isnan(target[0])
    for s in range(S):
        x[:] = x0
        reference[0], reference[1] = x0[VX], x0[VY]
        positions[s, 0] = x[:3]
        leg = 0
        for n in range(horizon):
            for w in range(W):
                if visits[s, w] == NEVER and _out_m(faces, x, waypoints[w]) <= reach_m[w]:
                    visits[s, w] = n
            while leg < sequences.shape[1] and (
                sequences[s, leg] >= 0 and visits[s, sequences[s, leg]] < NEVER
            ):
                leg += 1
            w = sequences[s, leg] if leg < sequences.shape[1] else -1
            speed = vehicle.v_xy_max_mps
            if w >= 0:
                nxt = sequences[s, leg + 1] if leg + 1 < sequences.shape[1] else -1
                following = waypoints[nxt] if nxt >= 0 else waypoints[w]
                aim = _aim_at(waypoints[w], reach_m[w], faces, x, following)
            elif has_target:
                aim = target.copy()
            else:
                # straight on and level; a UAS at rest stays where it is
                aim = x[:3] + 60.0 * x[VX : VZ + 1]
                aim[2] = x[Z]
                speed = min(speed, 2.0 * np.hypot(x[VX], x[VY]))
            dx, dy = aim[0] - x[X], aim[1] - x[Y]
            away = np.hypot(dx, dy) + 1e-9
            lead = lead_s if away > 15.0 else 0.0
            ex, ey = dx - lead * x[VX], dy - lead * x[VY]
            length = np.hypot(ex, ey) + 1e-9
            if w < 0 and has_target:
                speed = min(speed, 0.3 * away)
            down = _above_ground(x, 0.6 * (aim[2] - x[Z]) - 0.2 * x[VZ], keep_out)
            down = min(max(down, -vehicle.v_up_max_mps), vehicle.v_down_max_mps)
            down = _over_roofs(vehicle, x, down, keep_out)
            velocity_climb_wrench(
                vehicle, x, reference, speed * ex / length, speed * ey / length, down, u
            )
            fly_kinematics(vehicle, x, u)
            positions[s, n + 1] = x[:3]
            depths[s] += _depth_inside(x, keep_out)
    return positions, visits, depths

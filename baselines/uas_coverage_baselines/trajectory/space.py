"""What a UAS keeps clear of: fixed obstacles, the geofence, and bodies on known paths.

Convex programs know no hulls to stay outside of. For each step one face is taken that separates
both of its ends from an obstacle, chosen along the flight so far; by convexity the straight segment
between them is then clear, too. The faces are chosen anew as the flight changes (`program`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import allocating_kernel, inlined_kernel
from uas_coverage_env.geometry.segments import cylinder_clearance, segment_clearance
from uas_coverage_env.world import Arena

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

TALL_M = 1e9
"""Of what nothing passes over or under in a plane [m]."""

_BELOW = 0.7  # a face whose normal points down by more than this has the ground behind it, but
# for a lintel, below which routes lead
_NEAR_AT_LEAST_M = 2.5  # of what is planned round, however small the vehicle: between two guesses
# a flight moves as far as its rooms let it, and walls may be thinner than a step is long
# at scale 1
_NEAR_M = 16.0  # what is farther than this beyond its distance gets no rows
_FENCE_MARGIN_M = 0.1
_HEIGHT_MARGIN_M = 0.1
_ZONE_SIDES = 8
_ZONE_MARGIN_M = 0.1
_MAY_SINK_M = 0.5  # above the least height, within its landing zone, a UAS may go on sinking


class Space(NamedTuple):
    """Fixed planes as one UAS sees them; `normal . p + offset` grows outwards."""

    normals: FloatArray
    """(F, 3) faces of all obstacles."""
    offsets_m: FloatArray
    """(F,)"""
    first: IntArray
    """(O+1,) first face of each obstacle, and the end."""
    low_m: FloatArray
    """(O, 3) box around each hull."""
    high_m: FloatArray
    """(O, 3)"""
    has_way_below: NDArray[np.bool_]
    """(O,) whether routes lead below it: a lintel."""
    keep_m: FloatArray
    """(O,) planned distance."""
    least_m: FloatArray
    """(O,) distance at which the rules count a breach."""
    fence_normals: FloatArray
    """(H, 3)"""
    fence_offsets_m: FloatArray
    """(H,) a place is inside, with margin, where `normal . p + offset <= 0`."""
    fence_margin_m: float
    """Of the plan, in addition to that of the rules."""
    near_m: float
    """What is farther than this beyond its distance gets no rows."""
    length_scale: float
    """See `vehicle.scale`."""
    least_height_m: float
    """Above the ground, outside of the landing zones; 0: no such rule."""
    zone_middles_m: FloatArray
    """(2, 2) of the landing zones, upright cylinders around home and start."""
    zone_m: float
    """Their radius."""

    @property
    def planned_height_m(self) -> float:
        """The least height that is planned outside of the landing zones."""
        return (
            self.least_height_m + self.length_scale * _HEIGHT_MARGIN_M
            if self.least_height_m > 0.0
            else 0.0
        )

    def in_zones(self, path_m: FloatArray) -> NDArray[np.bool_]:
        """(2, N) whether places (N, 3) lie in the landing zone around home, around the start."""
        away_m = path_m[:, :2] - self.zone_middles_m[:, None]
        return np.hypot(away_m[..., 0], away_m[..., 1]) <= self.zone_m

    def is_in_zone(self, path_m: FloatArray) -> NDArray[np.bool_]:
        """(N,) whether places (N, 3) lie in a landing zone."""
        return np.asarray(self.in_zones(path_m).any(axis=0))


class Body(NamedTuple):
    """Something on a known path to stay clear of: a closed upright cylinder.

    Attributes:
        path_m: (T, 3) centres, at step 0 of the plan and after it; beyond its end it is gone.
        level_m: Horizontal distance to keep from the centre.
        height_m: Vertical distance to keep from the centre; one of both suffices.
    """

    path_m: FloatArray
    level_m: float
    height_m: float


def space_of(arena: Arena, uas: int, margin_m: float) -> Space:
    """The space of one UAS.

    Args:
        arena: The mission.
        uas: Index of the UAS.
        margin_m: Planned beyond the distances that count as a breach.
    """
    rules, obstacles = arena.rules[0], arena.obstacles
    planar = bool(arena.vehicles[uas]["holds_height"])
    first, last = ("first_kept", "last_kept") if planar else ("first_face", "last_face")
    rows = [np.arange(o[first], o[last]) for o in obstacles]
    faces = np.concatenate([np.zeros(0, np.int64), *rows])
    least_m = float(arena.uas[uas]["radius_m"]) + obstacles["safe_distance_m"]
    fence = slice(int(rules["fence_first"]), int(rules["fence_last"]))
    scale = float(rules["length_scale"])
    height_m = 0.0 if planar else float(rules["min_height_m"])
    # over roofs, what the distance to keep leaves of the least height raises the upper faces
    upward = np.maximum(-arena.normals[faces, 2], 0.0)
    of_obstacle = np.repeat(np.arange(len(rows)), [len(row) for row in rows])
    raised_m = np.maximum(height_m * upward - least_m[of_obstacle], 0.0)
    low_m = obstacles["hull_middle_m"] - obstacles["hull_half_m"]
    if planar:
        low_m[:, 2] = -TALL_M  # nothing is passed over
    np.minimum.at(low_m[:, 2], of_obstacle, low_m[of_obstacle, 2] - raised_m)
    return Space(
        normals=np.ascontiguousarray(arena.normals[faces]),
        offsets_m=arena.offsets_m[faces] - raised_m,
        first=np.cumsum([0, *(len(row) for row in rows)]),
        low_m=low_m,
        high_m=obstacles["hull_middle_m"] + obstacles["hull_half_m"],
        has_way_below=np.ascontiguousarray(obstacles["lintel"]),
        keep_m=least_m + margin_m,
        least_m=least_m,
        fence_normals=np.ascontiguousarray(arena.normals[fence]),
        fence_offsets_m=arena.offsets_m[fence] + float(rules["fence_margin_m"]),
        fence_margin_m=min(_FENCE_MARGIN_M, margin_m),
        near_m=max(scale * _NEAR_M, _NEAR_AT_LEAST_M),
        length_scale=scale,
        least_height_m=height_m,
        zone_middles_m=np.array([arena.uas[uas][end][:2] for end in ("home_m", "start_m")], float),
        zone_m=float(rules["landing_zone_m"]),
    )


def height_rows(space: Space, path_m: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Planes for the least height: above it, or within a landing zone where a UAS is low there.

    Args:
        space: Of the UAS.
        path_m: (N+1, 3) flight so far.

    Returns:
        Stages (m,), normals (m, 3) and bounds (m,) of rows `normal . p <= bound`.
    """
    stages = np.arange(1, max(len(path_m) - 1, 1))
    in_home, in_start = space.in_zones(path_m[stages])
    low = in_home | in_start
    low &= -path_m[stages, 2] < space.planned_height_m + space.length_scale * _MAY_SINK_M
    high = stages[~low]
    angle = 2.0 * np.pi / _ZONE_SIDES * np.arange(_ZONE_SIDES)
    sides = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_ZONE_SIDES)])
    within_m = (space.zone_m - space.length_scale * _ZONE_MARGIN_M) * np.cos(np.pi / _ZONE_SIDES)
    home_bounds, start_bounds = (
        within_m + sides[:, :2] @ middle_m for middle_m in space.zone_middles_m
    )
    side_bounds = np.where(in_home[low, None], home_bounds, start_bounds)
    return (
        np.concatenate([high, np.repeat(stages[low], _ZONE_SIDES)]),
        np.vstack([np.tile([0.0, 0.0, 1.0], (len(high), 1)), np.tile(sides, (int(low.sum()), 1))]),
        np.concatenate([np.full(len(high), -space.planned_height_m), side_bounds.ravel()]),
    )


def spare_height_m(space: Space, path_m: FloatArray) -> float:
    """Least height beyond what is planned, outside of the landing zones; start and end are free."""
    if space.least_height_m <= 0.0:
        return np.inf
    outside = path_m[1:-1][~space.is_in_zone(path_m[1:-1])]
    return float((-outside[:, 2] - space.planned_height_m).min(initial=np.inf))


@inlined_kernel
def _distance(space, f, p):
    """Signed distance of a point from face f."""
    faces = space.normals
    return faces[f, 0] * p[0] + faces[f, 1] * p[1] + faces[f, 2] * p[2] + space.offsets_m[f]


@inlined_kernel
def _is_far(space, o, p, q, beyond_m):
    """Whether a segment stays out of an obstacle's box widened by a distance."""
    for axis in range(3):
        if max(p[axis], q[axis]) < space.low_m[o, axis] - beyond_m:
            return True
        if min(p[axis], q[axis]) > space.high_m[o, axis] + beyond_m:
            return True
    return False


@allocating_kernel
def _separating(space, o, p, q):
    """The face with most distance to both ends of a segment, and that distance."""
    best_m, face = -np.inf, -1
    for f in range(space.first[o], space.first[o + 1]):
        if space.normals[f, 2] > _BELOW and not space.has_way_below[o]:
            continue
        distance_m = min(_distance(space, f, p), _distance(space, f, q))
        if distance_m > best_m:
            best_m, face = distance_m, f
    return best_m, face


@allocating_kernel
def separating_rows(space, path_m):
    """Planes that separate both ends of each step from each obstacle near it.

    Args:
        space: `Space` of the UAS.
        path_m: (N+1, 3) flight so far.

    Returns:
        Stages (m,), normals (m, 3) and bounds (m,) of rows `normal . p <= bound`.
    """
    n_obstacles, n_steps = len(space.keep_m), len(path_m) - 1
    stage, normal, bound = [0], [(0.0, 0.0, 0.0)], [0.0]
    for o in range(n_obstacles):
        reach_m = space.keep_m[o] + space.near_m
        for n in range(n_steps):
            if _is_far(space, o, path_m[n], path_m[n + 1], reach_m):
                continue
            distance_m, face = _separating(space, o, path_m[n], path_m[n + 1])
            if distance_m >= reach_m or face < 0:
                continue
            for end in range(n, n + 2):
                if end > 0:
                    a, b, c = space.normals[face]
                    stage.append(end)
                    normal.append((-a, -b, -c))
                    bound.append(space.offsets_m[face] - space.keep_m[o])
    m = len(stage) - 1
    stages, normals, bounds = np.empty(m, np.int64), np.empty((m, 3)), np.empty(m)
    for k in range(m):
        stages[k], bounds[k] = stage[k + 1], bound[k + 1]
        normals[k, 0], normals[k, 1], normals[k, 2] = normal[k + 1]
    return stages, normals, bounds


@allocating_kernel
def spare_fixed_m(space, path_m):
    """Least distance beyond what the plan keeps from obstacles, by one face for each step."""
    spare_m = np.inf
    for o in range(len(space.keep_m)):
        for n in range(len(path_m) - 1):
            if _is_far(space, o, path_m[n], path_m[n + 1], space.keep_m[o]):
                continue
            distance_m, _ = _separating(space, o, path_m[n], path_m[n + 1])
            spare_m = min(spare_m, distance_m - space.keep_m[o])
    return spare_m


@allocating_kernel
def spare_of_rules_m(space, path_m, lands):
    """Least distance beyond those of the rules, from obstacles, fence and least height: exact.

    Distances that are smaller at the start already are not to become smaller; where the flight
    ends in landing, the last sample is no sample of a flying UAS.

    Args:
        space: `Space` of the UAS.
        path_m: (N+1, 3).
        lands: Whether the flight ends with a landing.
    """
    spare_m = np.inf
    n_steps = len(path_m) - 1
    for h in range(len(space.fence_offsets_m)):
        normal, offset = space.fence_normals[h], space.fence_offsets_m[h]
        start_m = -(normal[0] * path_m[0, 0] + normal[1] * path_m[0, 1] + normal[2] * path_m[0, 2])
        least_m = min(0.0, start_m - offset)
        for n in range(1, n_steps + 1 - (1 if lands else 0)):
            p = path_m[n]
            inside_m = -(normal[0] * p[0] + normal[1] * p[1] + normal[2] * p[2]) - offset
            spare_m = min(spare_m, inside_m - least_m)
    if space.least_height_m > 0.0:
        least_m = min(space.least_height_m, -path_m[0, 2])
        for n in range(1, n_steps + 1 - (1 if lands else 0)):
            away_m2 = np.inf
            for zone in range(len(space.zone_middles_m)):
                north_m = path_m[n, 0] - space.zone_middles_m[zone, 0]
                east_m = path_m[n, 1] - space.zone_middles_m[zone, 1]
                away_m2 = min(away_m2, north_m * north_m + east_m * east_m)
            if away_m2 > space.zone_m * space.zone_m:
                spare_m = min(spare_m, -path_m[n, 2] - least_m)
    for o in range(len(space.least_m)):
        first, last = space.first[o], space.first[o + 1]
        start_m = -np.inf
        for f in range(first, last):
            start_m = max(start_m, _distance(space, f, path_m[0]))
        least_m = min(space.least_m[o], start_m)
        for n in range(n_steps):
            p, q = path_m[n], path_m[n + 1]
            if _is_far(space, o, p, q, space.least_m[o]):
                continue
            clearance_m = segment_clearance(
                space.normals, space.offsets_m, first, last, p[0], p[1], p[2], q[0], q[1], q[2]
            )
            spare_m = min(spare_m, clearance_m - least_m)
    return spare_m


@allocating_kernel
def spare_from_body_m(path_m, other_m, level_m, height_m):
    """Least distance beyond what a plan keeps from a body, between samples too."""
    smallest = np.inf
    for n in range(min(len(path_m), len(other_m)) - 1):
        a, b = path_m[n] - other_m[n], path_m[n + 1] - other_m[n + 1]
        clearance_m = cylinder_clearance(level_m, height_m, a[0], a[1], a[2], b[0], b[1], b[2])
        smallest = min(smallest, clearance_m)
    return smallest

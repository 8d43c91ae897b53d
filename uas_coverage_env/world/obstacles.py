"""The fixed obstacles as arrays, for the kernels: hulls, boxes around them, corners of routes."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.geometry.polytope import corners_of
from uas_coverage_env.scenario import NoFlyZone, Scenario
from uas_coverage_env.vehicle.scale import length_scale
from uas_coverage_env.world.broad_phase import EPS_M
from uas_coverage_env.world.overhangs import overhangs

NEAR_M = 20.0
"""Obstacles that are farther need no exact distance, unless nothing is nearer [m]."""

_ROUTE_MARGIN_M = 1.0
"""Routes keep this much more than the clearance that counts as a breach, at scale 1 [m]."""

NODE_MARGIN_M = 1.0
"""Corners of routes lie this much outside of what routes avoid, so that they see past it; at scale
1 [m]."""

_NOWHERE_M = 1e7
"""Added to how far a footprint is away: no route meets it [m]."""

_FIELDS = [
    # rows of `normals`: the hull, and the walls of its footprint widened by wall_m
    ("first_face", "i8"),
    ("last_face", "i8"),
    # what commands keep clear of: the hull again, or with its upper faces raised
    ("first_kept", "i8"),
    ("last_kept", "i8"),
    ("first_side", "i8"),
    ("last_side", "i8"),
    ("safe_distance_m", "f8"),
    # the box around the hull, by its middle and half its sides
    ("hull_middle_m", "f8", (3,)),
    ("hull_half_m", "f8", (3,)),
    # outside of this box every point is at least near_m away
    ("near_m", "f8"),
    ("lower_m", "f8", (3,)),
    ("upper_m", "f8", (3,)),
    # the same box by its middle and one over half its sides; beyond it, s times as far from
    # the middle as its walls, every point is at least near_m + rise_m (s - 1) away
    ("middle_m", "f8", (3,)),
    ("per_half_m", "f8", (3,)),
    ("rise_m", "f8"),
    # outside of this box every point is farther away than `rules.measured_m`
    ("measured_lower_m", "f8", (3,)),
    ("measured_upper_m", "f8", (3,)),
    # routes keep wall_m beside it, or pass over it at roof_m, positive up, unless it is tall
    ("wall_m", "f8"),
    ("roof_m", "f8"),
    ("tall", "?"),
    # the same without the margin of routes: lower is a breach
    ("top_m", "f8"),
    # there is room below a part of it
    ("overhangs", "?"),
    # all routes lead under it, through a door
    ("lintel", "?"),
    # nothing stands there: no contact
    ("no_fly_zone", "?"),
]

OBSTACLE_DTYPE = record_dtype(_FIELDS)


def route_margin_m(scenario: Scenario) -> float:
    """What routes keep beyond the clearance that counts as a breach [m]."""
    if scenario.route_margin_m is not None:
        return scenario.route_margin_m
    return _ROUTE_MARGIN_M * length_scale(scenario.vehicles, scenario.dt_s)


def overfly_limit(target_altitudes_m: NDArray[np.float64], ceiling_m: float) -> float:
    """Roofs up to here are flown over: 15 m above the usual target, below the ceiling [m]."""
    return min(float(np.median(target_altitudes_m)) + 15.0, ceiling_m)


def _widened(hull: ConvexPolytope, distance_m: float) -> NDArray[np.float64]:
    """Corners of {p : D(p) ≤ distance_m}: what the paper's clearance makes of a hull.

    Args:
        hull: The hull.
        distance_m: [m].

    Returns:
        (V, 3) [m].
    """
    inside_m = hull.vertices_m.mean(axis=0)
    return corners_of(hull.normals, hull.offsets_m - distance_m, inside_m)


def _footprint(corners_m: NDArray[np.float64]) -> ConvexHull:
    # to the micrometre: corners that differ by rounding only would make sides of no length
    return ConvexHull(np.unique(corners_m[:, :2].round(6), axis=0))


def _underside_m(hull: ConvexPolytope) -> float:
    """The altitude of the lowest corner [m]."""
    return -float(hull.vertices_m[:, 2].max())


def _is_lintel(scenario: Scenario, hull: ConvexPolytope) -> bool:
    """Whether the middle of a door lies below; in a planar mission what is kept tells."""
    z = float(hull.vertices_m[:, 2].mean())
    doors = np.array([(*door_m, z) for door_m in scenario.doors_m])
    if scenario.planar is not None or not len(doors):
        return False
    return bool((hull.signed_distance(doors) <= 0.0).any())


def obstacle_records(
    scenario: Scenario, radius_m: float, overfly_m: float, route_m: float, highest_m: float
) -> tuple[
    NDArray[np.void],
    list[tuple[NDArray[np.float64], NDArray[np.float64]]],
]:
    """The obstacles, and the planes of their hulls and footprints.

    Args:
        scenario: The scenario.
        radius_m: Of the largest UAS [m].
        overfly_m: Roofs up to here are flown over [m].
        route_m: What routes keep beyond a breach [m].
        highest_m: The highest altitude at which routes lead past what is not flown over [m].
    """
    records = np.zeros(len(scenario.obstacles), dtype=OBSTACLE_DTYPE)
    scale = length_scale(scenario.vehicles, scenario.dt_s)
    ground_m = float(-scenario.fence.vertices_m[:, 2].max())
    planes = []
    first = 0
    for record, obstacle, hull, kept in zip(
        records, scenario.obstacles, scenario.hulls, scenario.kept_hulls, strict=True
    ):
        wall_m = radius_m + obstacle.safe_distance_m + route_m
        near_m = max(NEAR_M, wall_m + 2 * NODE_MARGIN_M * scale)
        widened_m = _widened(kept, wall_m)
        footprint = _footprint(widened_m)
        sides = np.column_stack([footprint.equations[:, :2], np.zeros(len(footprint.equations))])
        planes.append((hull.normals, hull.offsets_m))
        lintel = _is_lintel(scenario, hull) and _underside_m(hull) - wall_m >= highest_m
        planes.append((sides, footprint.equations[:, 2] + (_NOWHERE_M if lintel else 0.0)))
        low_m, high_m = hull.vertices_m.min(axis=0), hull.vertices_m.max(axis=0)
        record["hull_middle_m"] = (low_m + high_m) / 2
        record["hull_half_m"] = (high_m - low_m) / 2 + EPS_M
        # in a planar mission what is kept may be far away, and is nowhere wider than the hull
        near = _widened(kept if scenario.planar is None else hull, near_m)
        record["first_face"] = first
        record["last_face"] = record["first_side"] = first + hull.n_faces
        first += hull.n_faces + len(sides)
        record["last_side"] = first
        record["first_kept"], record["last_kept"] = record["first_face"], record["last_face"]
        if kept is not hull:
            planes.append((kept.normals, kept.offsets_m))
            record["first_kept"] = first
            first += kept.n_faces
            record["last_kept"] = first
        record["safe_distance_m"] = obstacle.safe_distance_m
        record["near_m"] = near_m
        # the corners are rounded in the last digits: widen the box rather than miss a contact
        record["lower_m"] = near.min(axis=0) - EPS_M
        record["upper_m"] = near.max(axis=0) + EPS_M
        record["middle_m"] = (record["lower_m"] + record["upper_m"]) / 2
        record["per_half_m"] = 2 / (record["upper_m"] - record["lower_m"])
        record["rise_m"] = near_m - max(0.0, float(hull.signed_distance(record["middle_m"])))
        record["wall_m"] = wall_m
        record["roof_m"] = -widened_m[:, 2].min()
        record["lintel"] = lintel
        record["tall"] = record["roof_m"] > overfly_m and not lintel
        record["top_m"] = record["roof_m"] - route_m
        record["overhangs"] = overhangs(hull, ground_m, scale) and not lintel
        record["no_fly_zone"] = isinstance(obstacle, NoFlyZone)
    return records, planes


def corners_around(
    scenario: Scenario, obstacles: NDArray[np.void], margin_m: float
) -> NDArray[np.float64]:
    """(C, 2) [m] corners of the tall obstacles' footprints, widened by wall_m and a margin."""
    corners = [np.zeros((0, 2))]
    for record, kept in zip(obstacles, scenario.kept_hulls, strict=True):
        if record["tall"]:
            outline = _footprint(_widened(kept, record["wall_m"] + margin_m))
            corners.append(outline.points[outline.vertices])
    return np.concatenate(corners)


def measure(obstacles: NDArray[np.void], scenario: Scenario, measured_m: float) -> None:
    """Note around each obstacle the box outside of which it is farther away than measured_m."""
    obstacles["measured_lower_m"], obstacles["measured_upper_m"] = -math.inf, math.inf
    if measured_m < math.inf:
        for record, hull in zip(obstacles, scenario.hulls, strict=True):
            widened_m = _widened(hull, measured_m)
            record["measured_lower_m"] = widened_m.min(axis=0) - EPS_M
            record["measured_upper_m"] = widened_m.max(axis=0) + EPS_M

"""The corners at which routes turn, and the distances along them to every waypoint and start.

They lie a little outside of what routes avoid. A gap that is only just wide enough lies between two
such corners that do not see through it: where that leaves waypoints without a way home, they lie
nearer, by the first of a few distances with which the most have one. Routes also turn in the
middles of doors (`Scenario.doors_m`), as far as these are outside of what routes avoid.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle.scale import length_scale
from uas_coverage_env.world.obstacles import NODE_MARGIN_M, corners_around
from uas_coverage_env.world.routes import in_sight

FloatArray = NDArray[np.float64]

_NEARER_M = (0.5, 0.25, 0.1)  # at scale 1


class Corners(NamedTuple):
    """The visibility graph of the tall obstacles, as routes use it.

    Attributes:
        nodes_m: (K, 2) [m] the corners.
        distance_m: (P, K) [m] the shortest ways from each to every target; inf: there is none.
    """

    nodes_m: FloatArray
    distance_m: FloatArray


def route_corners(
    scenario: Scenario,
    obstacles: NDArray[np.void],
    normals: FloatArray,
    offsets_m: FloatArray,
    targets_m: FloatArray,
) -> Corners:
    """The corners of a scenario's routes.

    Args:
        scenario: The scenario.
        obstacles: (O,) of OBSTACLE_DTYPE.
        normals: (F, 3) all planes.
        offsets_m: (F,) [m].
        targets_m: (P, 3) [m] the W waypoints, then the U starts.
    """
    planes = obstacles, np.ascontiguousarray(normals), np.ascontiguousarray(offsets_m)
    level_m = np.ascontiguousarray(targets_m[:, :2])
    down_m = float(np.median(targets_m[:, 2]))

    def at(margin_m: float) -> tuple[int, Corners]:
        nodes_m = _free_corners(scenario, planes, down_m, margin_m)
        first_m, distance_m = _distances(planes, nodes_m, level_m)
        n_cut_off = _cut_off(planes, level_m, len(scenario.waypoints), first_m, distance_m)
        return n_cut_off, Corners(nodes_m, distance_m)

    scale = length_scale(scenario.vehicles, scenario.dt_s)
    fewest, best = at(scale * NODE_MARGIN_M)
    for margin_m in _NEARER_M:
        if not fewest:
            break
        n_cut_off, corners = at(scale * margin_m)
        if n_cut_off < fewest:
            fewest, best = n_cut_off, corners
    return best


_Planes = tuple[NDArray[np.void], FloatArray, FloatArray]


def _free_corners(
    scenario: Scenario, planes: _Planes, down_m: float, margin_m: float
) -> FloatArray:
    """(K, 2) the corners that lie inside the fence and outside of all other tall obstacles."""
    obstacles, normals, offsets_m = planes
    doors_m = np.reshape(scenario.doors_m, (-1, 2))
    nodes_m = np.concatenate([corners_around(scenario, obstacles, margin_m), doors_m])
    places_m = np.column_stack([nodes_m, np.full(len(nodes_m), down_m)])
    inset_m = scenario.geofence.margin_m + margin_m
    free = scenario.fence.signed_distance(places_m) <= -inset_m
    for obstacle in obstacles[obstacles["tall"]]:
        sides = slice(obstacle["first_side"], obstacle["last_side"])
        free &= (nodes_m @ normals[sides, :2].T + offsets_m[sides]).max(axis=1) > 0.0
    return np.ascontiguousarray(nodes_m[free])


@kernel
def _sight_distances(obstacles, normals, offsets_m, from_m, to_m, distance_m):
    for a in range(from_m.shape[0]):
        for b in range(to_m.shape[0]):
            seen = in_sight(
                obstacles, normals, offsets_m, from_m[a, 0], from_m[a, 1], to_m[b, 0], to_m[b, 1]
            )
            if seen:
                distance_m[a, b] = math.hypot(from_m[a, 0] - to_m[b, 0], from_m[a, 1] - to_m[b, 1])


def _in_sight_m(planes: _Planes, from_m: FloatArray, to_m: FloatArray) -> FloatArray:
    """(A, B) distances between places that see each other; inf between others."""
    distance_m = np.full((len(from_m), len(to_m)), np.inf)
    if distance_m.size:
        _sight_distances(*planes, from_m, to_m, distance_m)
    return distance_m


def _distances(
    planes: _Planes, nodes_m: FloatArray, targets_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(P, K) from each target to the corners in sight, and the shortest ways to all of them."""
    first_m = _in_sight_m(planes, targets_m, nodes_m)
    legs_m = _in_sight_m(planes, nodes_m, nodes_m)
    from_node, to_node = np.nonzero(np.isfinite(legs_m))
    ways_m = np.full_like(first_m, np.inf)
    if not len(from_node):
        return first_m, ways_m
    graph = csr_array((legs_m[from_node, to_node], (from_node, to_node)), shape=legs_m.shape)
    between_m = dijkstra(graph, directed=False)
    for target, seen in enumerate(np.isfinite(first_m)):
        if seen.any():
            ways_m[target] = (between_m[:, seen] + first_m[target, seen]).min(axis=1)
    return first_m, ways_m


def _cut_off(
    planes: _Planes,
    targets_m: FloatArray,
    n_waypoints: int,
    first_m: FloatArray,
    distance_m: FloatArray,
) -> int:
    """Of how many pairs of a waypoint and a start there is no way from one to the other."""
    if np.isfinite(distance_m).all():
        return 0
    leaves = np.isfinite(first_m[:n_waypoints]).astype(float)
    arrives = np.isfinite(distance_m[n_waypoints:]).astype(float)
    by_corners = leaves @ arrives.T > 0.0
    straight_m = _in_sight_m(planes, targets_m[:n_waypoints], targets_m[n_waypoints:])
    return int((~by_corners & ~np.isfinite(straight_m)).sum())

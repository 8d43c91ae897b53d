"""What every triple of visits in a row costs at least: way and turn, for all pairs of neighbours.

See docs/bound.md, "From visit to visit". Nodes are the waypoints, then each UAS setting off, then
each UAS coming home.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.bound.turning import LONGEST, LONGEST_START, Turning

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_LANDING = 2  # steps: more change little


class Places(NamedTuple):
    """Where a mission leads, seen from above.

    Attributes:
        waypoints_m: (W, 2) [m].
        radii_m: (W,) [m].
        starts_m: (U, 2) [m].
        homes_m: (U, 2) [m].
        landing_distance_m: [m].
    """

    waypoints_m: FloatArray
    radii_m: FloatArray
    starts_m: FloatArray
    homes_m: FloatArray
    landing_distance_m: float


class LegBounds(NamedTuple):
    """The way between nodes: how many steps it takes at least, and where they are counted.

    Attributes:
        centre_m: (N, 2) of each node [m].
        radius_m: (N,) [m].
        before: (W, N) steps counted at a waypoint on the way from a node, at most LONGEST.
        after: (W, N) steps counted at a waypoint on the way to a node.
        start_steps: (W, U) steps counted where a UAS sets off, on the way to a waypoint.
        landing_steps: (W, U) steps counted where it lands.
    """

    centre_m: FloatArray
    radius_m: FloatArray
    before: IntArray
    after: IntArray
    start_steps: IntArray
    landing_steps: IntArray


def legs_between(places: Places, reach_m: FloatArray, reach_from_rest_m: FloatArray) -> LegBounds:
    """The legs of a mission.

    Args:
        places: Of the mission.
        reach_m: (n+1,) how far so many steps lead at most.
        reach_from_rest_m: (n+1,) the same from rest.
    """
    n, homes = len(places.waypoints_m), places.homes_m
    centre_m = np.concatenate([places.waypoints_m, places.starts_m, homes])
    landing = np.full(len(homes), places.landing_distance_m)
    radius_m = np.concatenate([places.radii_m, np.zeros(len(homes)), landing])
    between_m = np.linalg.norm(centre_m[:n, None] - centre_m[None], axis=2)
    between_m = np.maximum(between_m - places.radii_m[:, None] - radius_m, 0.0)
    starts, ends = slice(n, n + len(homes)), slice(n + len(homes), None)
    steps = np.searchsorted(reach_m, between_m)
    steps[:, starts] = np.searchsorted(reach_from_rest_m, between_m[:, starts])
    before, after = steps // 2, (steps + 1) // 2
    before[:, starts] = np.minimum(LONGEST, steps[:, starts] // 3)
    landing_steps = np.clip(steps[:, ends] // 2, 1, _LANDING)
    after[:, ends] = steps[:, ends] - landing_steps
    return LegBounds(
        centre_m,
        radius_m,
        np.minimum(before, LONGEST),
        np.minimum(after, LONGEST),
        np.minimum(steps[:, starts] - before[:, starts], LONGEST_START),
        landing_steps,
    )


def straight_directions(legs: LegBounds) -> FloatArray:
    """(W, N, 2) from each waypoint to each node, of unit length; zero where they coincide."""
    n = len(legs.before)
    way_m = legs.centre_m[None] - legs.centre_m[:n, None]
    length_m = np.linalg.norm(way_m, axis=2, keepdims=True)
    return np.divide(way_m, length_m, out=np.zeros_like(way_m), where=length_m > 1e-9)


def with_middles(legs: LegBounds) -> BoolArray:
    """(W, N) the legs whose middle, seen from above, lies between the circles of two waypoints."""
    n = len(legs.before)
    half_m = 0.5 * np.linalg.norm(legs.centre_m[None] - legs.centre_m[:n, None], axis=2)
    found = (half_m > legs.radius_m) & (half_m > legs.radius_m[:n, None])
    found[:, n:] = False
    return found


def steps_to_middles(legs: LegBounds, reach_m: FloatArray, step_m: float) -> LegBounds:
    """The legs with the steps up to their middle, and from it, in place of half of their steps.

    Args:
        legs: Of the mission.
        reach_m: (n+1,) how far so many steps lead at most.
        step_m: The first sample beyond a middle is so far from it at most.
    """
    n, middle = len(legs.before), with_middles(legs)
    way_m = 0.5 * np.linalg.norm(legs.centre_m[None] - legs.centre_m[:n, None], axis=2)
    way_m -= legs.radius_m[:n, None]
    before = np.searchsorted(reach_m, np.maximum(way_m - step_m, 0.0))
    after = np.searchsorted(reach_m, np.maximum(way_m, 0.0))
    return legs._replace(
        before=np.where(middle, np.minimum(before, LONGEST), legs.before),
        after=np.where(middle, np.minimum(after, LONGEST), legs.after),
    )


def end_costs(legs: LegBounds, turning: Turning, directions: FloatArray) -> FloatArray:
    """(W, N) of setting off and landing, with the half of the leg next to a home; else zero."""
    n, n_nodes = legs.before.shape
    uas = (n_nodes - n) // 2
    starts, ends = slice(n, n + uas), slice(n + uas, None)
    half_m = 0.5 * np.einsum(
        "ijx,ijx->ij", directions, legs.centre_m[None] - legs.centre_m[:n, None]
    )
    cost = np.zeros((n, n_nodes))
    cost[:, starts] = turning.per_m * half_m[:, starts] + turning.start[legs.start_steps]
    cost[:, ends] = turning.per_m * (half_m[:, ends] - legs.radius_m[ends])
    cost[:, ends] += turning.landing[legs.landing_steps]
    return cost


def triples(legs: LegBounds, turning: Turning) -> FloatArray:
    """(W, N, N) the least cost of each triple, in whichever direction it is flown; symmetric."""
    out = straight_directions(legs)
    cost = directed_triples(legs, turning, -out, out)
    return np.minimum(cost, cost.transpose(0, 2, 1))


def directed_triples(
    legs: LegBounds, turning: Turning, into: FloatArray, out: FloatArray
) -> FloatArray:
    """The cost of each triple: half of either leg, the radius, the turn, and the ends of a route.

    Args:
        legs: Of the mission.
        turning: Of the vehicle.
        into: (W, N, 2) unit vectors for the way to each waypoint from each node: any are valid
            between waypoints, see docs/bound.md, and straight ones are needed from and to homes.
        out: (W, N, 2) the same for the way on.

    Returns:
        (W, N, N) by the nodes before and after; infinite where nothing flies so.
    """
    n, n_nodes = legs.before.shape
    uas = (n_nodes - n) // 2
    starts, ends = slice(n, n + uas), slice(n + uas, None)
    half_m = 0.5 * (legs.centre_m[None] - legs.centre_m[:n, None])
    into_m, out_m = -np.einsum("ijx,ijx->ij", into, half_m), np.einsum("ijx,ijx->ij", out, half_m)
    size = np.linalg.norm(into[:, :, None] - out[:, None], axis=3)
    half_angle = np.arcsin(np.clip(0.5 * size, 0.0, 1.0))
    way_m = into_m[:, :, None] + out_m[:, None] - legs.radius_m[:n, None, None] * size
    possible = np.ones(half_angle.shape, dtype=bool)
    # from the end of a route to a waypoint, and from a waypoint to its start, nothing flies
    possible[:, ends] = possible[:, :, starts] = False
    possible[:, starts, ends] &= np.eye(uas, dtype=bool)
    possible[np.arange(n), :, np.arange(n)] = possible[np.arange(n), np.arange(n)] = False
    possible[:, np.arange(n), np.arange(n)] = False
    before, after = np.broadcast_arrays(legs.before[:, :, None], legs.after[:, None])
    cost = np.full(half_angle.shape, np.inf)
    cost[possible] = turning.per_m * way_m[possible]
    cost[possible] += turning.turn_cost(before[possible], after[possible], half_angle[possible])
    ends_cost = end_costs(legs, turning, out)
    cost += ends_cost[:, :, None] + ends_cost[:, None]
    return cost

"""Air taxis: a city of 20 km in which each flies one way, from one vertiport to another.

Each lands where another has taken off. Gates lie along the straight ways from pad to pad, beside
zones that are closed up to the ceiling; one or two helicopters cross the city, never near a pad.
"""

import math

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.scenario.families.family import Family
from uas_coverage_env.scenario.families.site import Place_m, Rng, Size, outline, prism, tag, upright
from uas_coverage_env.scenario.feasibility import back_and_forth
from uas_coverage_env.scenario.fields import (
    Decoration,
    Geofence,
    MovingObstacle,
    Obstacle,
    ScheduledVelocity,
    Uas,
    Waypoint,
)
from uas_coverage_env.scenario.model import Scenario
from uas_coverage_env.scenario.reserve import LandingReserve

Array = NDArray[np.float64]

_SIDE_M, _CEILING_M = 20_000.0, 650.0
_PAD_M, _GATE_M = 30.0, 200.0  # heights
_FROM_FENCE_M, _BETWEEN_PADS_M, _SIZE_OF_PAD_M = 1_500.0, 2_500.0, 300.0
_WAY_M = (5_000.0, 16_000.0)
_ZONES, _ZONE_M, _FROM_ZONE_M = (1, 3), (1_200.0, 2_500.0), 700.0
_ASIDE_M, _GATE_RADIUS_M = 400.0, 150.0
_SAFE_M, _APART_M = 150.0, 300.0
_MOST_MOVING, _SPEED_MPS, _FROM_PADS_M = 2, (12.0, 18.0), 800.0
_DT_S, _SPARE = 2.0, 0.1
_DRAWS, _TRIES = 1_000, 200


def air_taxi(rng: Rng, size: Size) -> Scenario:
    """A city, its taxis and gates.

    Args:
        rng: Draws everything.
        size: How many taxis and gates; their vehicle is the shipped `air_taxi`.

    Raises:
        ValueError: So many do not fit into the city, or their batteries do not suffice.
    """
    n_uas, n_waypoints = size.draw(rng)
    for _ in range(_DRAWS):
        drawn = _ways(rng, n_uas)
        if drawn is None:
            continue
        starts_m, homes_m = drawn
        pads_m = np.concatenate([starts_m, homes_m])
        zones = _zones(rng, pads_m)
        gates_m = _gates(rng, starts_m, homes_m, zones, n_waypoints)
        if gates_m is None:
            continue
        draft = _mission(rng, starts_m, homes_m, zones, gates_m)
        plan = back_and_forth(draft, spare=_SPARE)
        if plan.complete:
            steps = 100 + math.ceil(2.0 * plan.makespan_s / _DT_S)
            return draft.model_copy(update={"max_steps": steps})
    raise ValueError(
        f"{n_uas} taxis and {n_waypoints} gates do not fit into the city; take fewer of them"
    )


FAMILIES = {"air-taxi": Family(air_taxi, n_moving=_MOST_MOVING)}


def _ways(rng: Rng, n_uas: int) -> tuple[Array, Array] | None:
    """Starts and landing places (U, 2), each the start of another taxi; of one, a pad of its own.

    None where a way is too short or too long.
    """
    pads: list[Array] = []
    for place_m in rng.uniform(_FROM_FENCE_M, _SIDE_M - _FROM_FENCE_M, size=(_TRIES, 2)).round():
        apart = all(np.linalg.norm(place_m - other) >= _BETWEEN_PADS_M for other in pads)
        if apart and len(pads) < max(n_uas, 2):
            pads.append(place_m)
    if len(pads) < max(n_uas, 2):
        return None
    starts_m = np.array(pads)[:n_uas]
    homes_m = np.roll(np.array(pads), -1, axis=0)[:n_uas]
    way_m = np.linalg.norm(homes_m - starts_m, axis=1)
    return (
        (starts_m, homes_m) if (_WAY_M[0] <= way_m).all() and (way_m <= _WAY_M[1]).all() else None
    )


def _zones(rng: Rng, pads_m: Array) -> list[tuple[Array, Array]]:
    """Rectangles, as their low and high corners, away from pads and from each other."""
    zones: list[tuple[Array, Array]] = []
    wanted = int(rng.integers(_ZONES[0], _ZONES[1] + 1))
    for _ in range(_TRIES):
        low = rng.uniform(_FROM_FENCE_M, _SIDE_M - _FROM_FENCE_M - _ZONE_M[1], size=2).round()
        high = low + rng.uniform(*_ZONE_M, size=2).round()
        apart = all((np.maximum(low - b, a - high) > 2.0 * _FROM_ZONE_M).any() for a, b in zones)
        if len(zones) < wanted and apart and not _is_near(pads_m, [(low, high)]).any():
            zones.append((low, high))
    return zones


def _is_near(places_m: Array, zones: list[tuple[Array, Array]]) -> NDArray[np.bool_]:
    """(P,) whether places are in a zone, or beside it."""
    near = np.zeros(len(places_m), np.bool_)
    for low, high in zones:
        near |= (
            (places_m > low - _FROM_ZONE_M) & (places_m < high + _FROM_ZONE_M)
        ).all(axis=1)  # fmt: skip
    return near


def _gates(
    rng: Rng, starts_m: Array, homes_m: Array, zones: list[tuple[Array, Array]], count: int
) -> Array | None:
    """(G, 2) so many gates, shared out among the ways; None where zones leave no place for one."""
    gates = []
    for g in range(count):
        u, k = g % len(starts_m), g // len(starts_m)
        of_way = -(-(count - u) // len(starts_m))
        way_m = homes_m[u] - starts_m[u]
        aside = np.array([-way_m[1], way_m[0]]) / np.linalg.norm(way_m)
        shares = (k + 0.5 + rng.uniform(-0.3, 0.3, size=(8, 1))) / of_way
        # away from both pads: there the taxi climbs, and lands
        shares = 0.15 + 0.7 * shares
        places_m = starts_m[u] + shares * way_m + rng.uniform(-_ASIDE_M, _ASIDE_M, (8, 1)) * aside
        free = np.flatnonzero(~_is_near(places_m, zones))
        if not len(free):
            return None
        gates.append(places_m[free[0]].round())
    return np.array(gates)


def _mission(
    rng: Rng, starts_m: Array, homes_m: Array, zones: list[tuple[Array, Array]], gates_m: Array
) -> Scenario:
    pads_m = np.unique(np.concatenate([starts_m, homes_m]), axis=0)
    corners_m = outline((0.0, _SIDE_M), (0.0, _SIDE_M))
    fields = {
        "schema": 1,
        "name": f"air-taxi-{tag(rng)}",
        "dt_s": _DT_S,
        "max_steps": 100_000,
        "landing_distance_m": 50.0,
        "landing_speed_mps": 2.0,
        "uas_safe_distance_m": _APART_M,
        "reserve": LandingReserve(share=0.2),
        "geofence": Geofence(margin_m=10.0, vertices_m=upright(corners_m, 0.0, _CEILING_M)),
        "obstacles": tuple(_zone(k, *zone) for k, zone in enumerate(zones)),
        "moving_obstacles": tuple(_helicopters(rng, pads_m)),
        "uas": tuple(
            Uas(
                name=f"uas_{u + 1}",
                vehicle="air_taxi",
                start_m=(*start_m.tolist(), -_PAD_M),
                land_m=(*home_m.tolist(), -_PAD_M),
                soc_0=1.0,
                radius_m=6.0,
                dod_max=0.9,
            )
            for u, (start_m, home_m) in enumerate(zip(starts_m, homes_m, strict=True))
        ),
        "waypoints": tuple(
            Waypoint(
                kind="gate",
                position_m=(*place_m.tolist(), -_GATE_M),
                radius_m=_GATE_RADIUS_M,
                weight=1.0,
            )
            for place_m in gates_m
        ),
        "decorations": tuple(
            Decoration(name=f"vertiport_{k + 1}", kind="pad", polygon_m=_pad(*pad_m.tolist()))
            for k, pad_m in enumerate(pads_m)
        ),
    }
    return Scenario(**fields)


def _pad(north_m: float, east_m: float) -> tuple[Place_m, ...]:
    half_m = _SIZE_OF_PAD_M
    north, east = (north_m - half_m, north_m + half_m), (east_m - half_m, east_m + half_m)
    return tuple(outline(north, east))


def _zone(k: int, low: Array, high: Array) -> Obstacle:
    corners = outline((low[0], high[0]), (low[1], high[1]))
    return prism(f"zone_{k + 1}", "no_fly", corners, _CEILING_M, safe_distance_m=_SAFE_M)


def _helicopters(rng: Rng, pads_m: Array) -> list[MovingObstacle]:
    """One or two that cross the city on straight lines, at the height of the gates."""
    moving: list[MovingObstacle] = []
    wanted = int(rng.integers(1, _MOST_MOVING + 1))
    for _ in range(_TRIES):
        begins_m = np.array([0.0, rng.uniform(0.2, 0.8) * _SIDE_M]).round()
        ends_m = np.array([_SIDE_M, rng.uniform(0.2, 0.8) * _SIDE_M])
        if rng.uniform() < 0.5:
            begins_m, ends_m = begins_m[::-1], ends_m[::-1]
        way_m = ends_m - begins_m
        length_m = float(np.linalg.norm(way_m))
        off_m = np.abs((pads_m - begins_m) @ np.array([-way_m[1], way_m[0]])) / length_m
        if len(moving) < wanted and off_m.min() >= _FROM_PADS_M:
            north_mps, east_mps = (way_m / length_m * rng.uniform(*_SPEED_MPS)).round(2).tolist()
            piece = ScheduledVelocity(from_s=0.0, velocity_mps=(north_mps, east_mps, 0.0))
            moving.append(
                MovingObstacle(
                    name=f"helicopter_{len(moving) + 1}",
                    kind="helicopter",
                    radius_m=15.0,
                    height_m=30.0,
                    safe_distance_m=_APART_M,
                    start_m=(*begins_m.tolist(), -_GATE_M),
                    schedule=(piece,),
                )
            )
    return moving

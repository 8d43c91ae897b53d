"""Maps drawn from the words of Gasche et al., Sec. IV: a village on a river, forests, a helicopter.

The paper describes its map and publishes no positions. What it says is kept by every map: its fence
is ours, but the two starts, the charges, the numbers of obstacles and waypoints and what they are
stand in the paper. What it leaves open is drawn: where buildings stand and how high they are, the
outlines of the forests, the course of the river, where the helicopter is parked, where waypoints
lie within their cells. What is true of one map may be an accident; what is true of ten is not.
"""

from collections.abc import Sequence

import numpy as np

from uas_coverage_env.scenario.families.family import FamilyOfSeeds
from uas_coverage_env.scenario.families.site import (
    CEILING_M,
    DOD_MAX,
    fence_around,
    mission,
    outline,
    prism,
    upright,
)
from uas_coverage_env.scenario.fields import (
    Decoration,
    MovingObstacle,
    Obstacle,
    ScheduledVelocity,
    Uas,
    Waypoint,
)
from uas_coverage_env.scenario.model import Scenario
from uas_coverage_env.scenario.room import MOVING, Room

Span_m = tuple[float, float]

_SIDE_M = 500.0
_SPAN_M = (0.0, _SIDE_M)
_UAS_RADIUS_M = 0.36
_LOTS_NORTH_M: tuple[Span_m, ...] = ((150.0, 228.0), (272.0, 350.0))
_LOTS_EAST_M: tuple[Span_m, ...] = ((78.0, 138.0), (146.0, 206.0), (302.0, 350.0), (358.0, 406.0))
_BUILDINGS = ("residential", "residential", "high_rise", "high_rise", "high_rise", "church")
_SAFE_M = {"forest": 2.0, "residential": 3.0, "church": 3.0, "high_rise": 4.0}
_ROWS, _PITCH_M, _JITTER_M = 7, 68.0, 7.0
_FIRST_M = (46.0, 60.0)  # the grid's first waypoint, north and east
_ABOVE_ROOF_M, _ALTITUDE_M, _OVER_WATER_M = 10.0, 14.0, 12.0
_BESIDE_M = 1.5  # of a waypoint's centre, beyond all distances from a wall
_LIFT_OFF_S, _CLIMB_S = 200.0, 6.0
_HELICOPTER_MPS, _HELICOPTER_MPS2 = 15.0, 3.0


def flood_village(seed: int) -> Scenario:
    """The map of a seed; the same seed gives the same map.

    Args:
        seed: Not negative.
    """
    rng = np.random.default_rng([2025, seed])
    river_m = _river(rng)
    standing = [*_forests(rng), *_buildings(rng)]
    pad_m = (float(rng.uniform(225.0, 275.0)), float(rng.uniform(446.0, 456.0)))
    return mission(
        name=f"flood-village-{seed}",
        max_steps=500,
        geofence=fence_around(upright(outline(_SPAN_M, _SPAN_M), 0.0, CEILING_M)),
        obstacles=tuple(standing),
        moving_obstacles=(_helicopter(pad_m),),
        uas=tuple(
            Uas(
                name=f"uas_{i + 1}",
                vehicle="s500_v2",
                start_m=(north_m, 10.0, -1.0),
                soc_0=soc_0,
                radius_m=_UAS_RADIUS_M,
                dod_max=DOD_MAX,
            )
            for i, (north_m, soc_0) in enumerate(((250.0, 1.0), (230.0, 0.433)))
        ),
        waypoints=tuple(_waypoints(rng, standing, river_m, pad_m)),
        decorations=(Decoration(name="river", kind="water", polygon_m=_banks(river_m)),),
    )


class FloodVillages(FamilyOfSeeds):
    """These maps."""

    @property
    def room(self) -> Room:
        """The most that a mission may have."""
        return Room(2, _ROWS**2, MOVING)

    def of_seed(self, seed: int) -> Scenario:
        """The map of a seed."""
        return flood_village(seed)


FAMILIES = {"flood-village": FloodVillages()}


def _schedule(lift_off_s: float) -> tuple[ScheduledVelocity, ...]:
    """Parked, a climb, then away to the east, faster by 3 m/s each second as helicopters can.

    Args:
        lift_off_s: When it leaves the ground [s].
    """
    leaves_s = lift_off_s + _CLIMB_S
    speeds_mps = np.arange(_HELICOPTER_MPS2, _HELICOPTER_MPS + 1e-9, _HELICOPTER_MPS2).tolist()
    pieces = [(0.0, (0.0, 0.0, 0.0)), (lift_off_s, (0.0, 0.0, -3.0))]
    pieces += [(leaves_s + k, (0.0, speed_mps, -2.0)) for k, speed_mps in enumerate(speeds_mps)]
    pieces.append((leaves_s + 60.0, (0.0, 0.0, 0.0)))
    return tuple(ScheduledVelocity(from_s=s, velocity_mps=v_mps) for s, v_mps in pieces)


def _helicopter(pad_m: tuple[float, float]) -> MovingObstacle:
    return MovingObstacle(
        name="emergency_helicopter",
        radius_m=8.0,
        height_m=6.0,
        safe_distance_m=25.0,
        start_m=(round(pad_m[0], 1), round(pad_m[1], 1), -3.0),
        schedule=_schedule(_LIFT_OFF_S),
    )


def _standing(name: str, kind: str, corners_m: Sequence[Span_m], height_m: float) -> Obstacle:
    return prism(name, kind, corners_m, height_m, safe_distance_m=_SAFE_M[kind])


def _forests(rng: np.random.Generator) -> list[Obstacle]:
    """One in each corner of the area, a rectangle without its corners."""
    forests = []
    for south, west in ((True, True), (True, False), (False, True), (False, False)):
        north = (12.0, rng.uniform(95.0, 135.0)) if south else (rng.uniform(368.0, 408.0), 488.0)
        east = (28.0, rng.uniform(180.0, 218.0)) if west else (rng.uniform(312.0, 356.0), 488.0)
        cut = rng.uniform(12.0, 36.0, size=4)
        corners: list[Span_m] = []
        for k, (n, e) in enumerate(outline(north, east)):
            inward_n = cut[k] if n == north[0] else -cut[k]
            inward_e = cut[k] if e == east[0] else -cut[k]
            corners += [(n + inward_n, e), (n, e + inward_e)]
        name = f"forest_{'south' if south else 'north'}{'west' if west else 'east'}"
        height_m = round(float(rng.uniform(15.0, 18.0)), 1)
        forests.append(_standing(name, "forest", corners, height_m))
    return forests


def _buildings(rng: np.random.Generator) -> list[Obstacle]:
    """Six of eight lots on both banks, at random."""
    lots = [(north, east) for north in _LOTS_NORTH_M for east in _LOTS_EAST_M]
    buildings = []
    for k, (kind, lot) in enumerate(zip(_BUILDINGS, rng.permutation(len(lots)), strict=False)):
        side_m, height_m = {
            "residential": (rng.uniform(40.0, (72.0, 46.0)), rng.uniform(8.0, 11.0)),
            "high_rise": (rng.uniform(22.0, 28.0, size=2), rng.uniform(34.0, 44.0)),
            "church": (np.array([16.0, 32.0]), 30.0),
        }[kind]
        low = [
            float(rng.uniform(span[0], span[1] - side))
            for span, side in zip(lots[lot], side_m, strict=True)
        ]
        n, e = low
        if kind == "church":
            made = _church(f"{kind}_{k + 1}", n, e)
        else:
            corners = outline((n, n + side_m[0]), (e, e + side_m[1]))
            made = _standing(f"{kind}_{k + 1}", kind, corners, float(height_m))
        buildings.append(made)
    return buildings


def _church(name: str, north_m: float, east_m: float) -> Obstacle:
    """A nave of 16 m x 32 m under a ridge, and a steeple of 30 m."""
    nave = upright(outline((north_m, north_m + 16.0), (east_m, east_m + 32.0)), 0.0, 9.0)
    steeple = outline((north_m + 6.0, north_m + 10.0), (east_m + 3.0, east_m + 7.0))
    top = tuple((round(n, 1), round(e, 1), -30.0) for n, e in steeple)
    vertices_m = (*nave, *top, (round(north_m + 8.0, 1), round(east_m + 32.0, 1), -14.0))
    return Obstacle(
        name=name, kind="church", safe_distance_m=_SAFE_M["church"], vertices_m=vertices_m
    )


def _river(rng: np.random.Generator) -> list[Span_m]:
    """The middle of the river, from north to south."""
    north_m = np.linspace(_SIDE_M, 0.0, 9)
    phase, wide_m = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(10.0, 24.0)
    east_m = rng.uniform(244.0, 264.0) + wide_m * np.sin(phase + north_m / 90.0)
    return [(float(n), float(e)) for n, e in zip(north_m, east_m, strict=True)]


def _banks(river_m: list[Span_m]) -> tuple[Span_m, ...]:
    west = [(n, round(e - 15.0, 1)) for n, e in river_m]
    east = [(n, round(e + 15.0, 1)) for n, e in reversed(river_m)]
    return (*west, *east)


def _waypoints(
    rng: np.random.Generator,
    standing: list[Obstacle],
    river_m: list[Span_m],
    pad_m: tuple[float, float],
) -> list[Waypoint]:
    """7 x 7; the easternmost of the helicopter's row lies behind it."""
    offset_m = rng.uniform(-_JITTER_M, _JITTER_M, size=(_ROWS, _ROWS, 2))
    behind = (pad_m[0] + rng.uniform(-3.0, 3.0), pad_m[1] + rng.uniform(10.0, 14.0))
    of_helicopter = round((pad_m[0] - _FIRST_M[0]) / _PITCH_M)
    north_of_river = np.array(river_m[::-1])
    result = []
    for row in range(_ROWS):
        for column in range(_ROWS):
            north_m, east_m = _FIRST_M + _PITCH_M * np.array([row, column]) + offset_m[row, column]
            if (row, column) == (of_helicopter, _ROWS - 1):
                north_m, east_m = behind
            middle_m = np.interp(north_m, north_of_river[:, 0], north_of_river[:, 1])
            wet = abs(east_m - middle_m) < 15.0
            result.append(_waypoint(north_m, east_m, wet, standing))
    return result


def _waypoint(north_m: float, east_m: float, wet: bool, standing: list[Obstacle]) -> Waypoint:
    """Above forests and houses, beside what is higher."""
    kind, altitude_m = ("water", _OVER_WATER_M) if wet else ("field", _ALTITUDE_M)
    for obstacle in standing:
        place = np.array([north_m, east_m, -altitude_m])
        hull = obstacle.hull
        short_m = obstacle.safe_distance_m + _UAS_RADIUS_M + _BESIDE_M - hull.signed_distance(place)
        if short_m <= 0.0:
            continue
        if obstacle.kind in ("forest", "residential"):
            kind, altitude_m = obstacle.kind, _ABOVE_ROOF_M - hull.vertices_m[:, 2].min()
        else:
            walls = np.flatnonzero(np.abs(hull.normals[:, 2]) < 1e-9)
            nearest = walls[np.argmax(hull.normals[walls] @ place + hull.offsets_m[walls])]
            north_m, east_m = (place + short_m * hull.normals[nearest])[:2]
    return Waypoint(
        kind=kind,
        position_m=(round(float(north_m), 1), round(float(east_m), 1), -round(altitude_m, 1)),
        radius_m=15.0,
        weight=2.0 if kind == "forest" else 1.0,
    )

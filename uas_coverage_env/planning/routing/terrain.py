"""Over or round: ways past the fixed obstacles, for leg times and for searches of flights.

The world's routes fly over what is low and round what is tall. Where a climb takes longer than the
way round, round is better even where over is possible; so everything is asked twice, the second
time with what rises above the usual waypoint made tall (`raised`).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.scenario import Obstacle
from uas_coverage_env.world import Arena
from uas_coverage_env.world.routes import CLEAR, ROUND_CORNER, leg_from_corner, route

FloatArray = NDArray[np.float64]
_CORNERS = 20
_ABOVE_M = 1.0


def raised(brief: MissionBrief) -> MissionBrief | None:
    """The mission with what rises above the usual waypoint made as tall as the fence.

    None where nothing does, and routes would be the same; in a plane all obstacles are tall.
    """
    if brief.planar is not None:
        return None
    targets_m = [*(w.position_m[2] for w in brief.waypoints), *(u.home_m[2] for u in brief.uas)]
    usual_m = float(np.median(targets_m)) - _ABOVE_M
    top_m = float(brief.fence.vertices_m[:, 2].min())
    radius_m = max(uas.radius_m for uas in brief.uas)
    obstacles, changed = [], False
    for obstacle in brief.obstacles:
        vertices_m = np.array(obstacle.vertices_m, float)
        roof_m = vertices_m[:, 2].min()
        if top_m < roof_m and roof_m - radius_m - obstacle.safe_distance_m < usual_m:
            vertices_m[vertices_m[:, 2] <= roof_m + 1e-6, 2] = top_m
            known = obstacle.model_dump() | {"vertices_m": tuple(map(tuple, vertices_m.tolist()))}
            obstacles.append(Obstacle.model_validate(known))
            changed = True
        else:
            obstacles.append(obstacle)
    if not changed:
        return None
    known: dict[str, Any] = {name: getattr(brief, name) for name in MissionBrief.model_fields}
    known["obstacles"] = tuple(obstacles)
    return MissionBrief.model_construct(**known)


class Terrain:
    """Leg times and corners, over or round.

    Args:
        brief: The mission.

    Attributes:
        legs: Those of the world's routes.
        between_s: (V, W, W) leg times, the shorter of both ways; see `Legs`.
        home_s: (U, W) likewise.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self.legs = Legs(brief)
        self._legs = [self.legs]
        self._arenas = [self.legs.arena]
        self.between_s, self.home_s = self.legs.between_s, self.legs.home_s
        round_all = raised(brief)
        if round_all is not None:
            around = Legs(round_all)
            self._legs.append(around)
            self._arenas.append(around.arena)
            self.between_s = np.minimum(self.between_s, around.between_s)
            self.home_s = np.minimum(self.home_s, around.home_s)

    @property
    def arena(self) -> Arena:
        """The mission as arrays."""
        return self._arenas[0]

    def from_here_s(self, uas: int, position_m: FloatArray) -> FloatArray:
        """(W,) leg times from a position."""
        return np.min([legs.from_here_s(uas, position_m) for legs in self._legs], axis=0)

    def ways(self, row: int, start_m: FloatArray, end_m: FloatArray) -> list[FloatArray]:
        """Corners (K, 3) of one or two ways between two places, both ends included.

        Args:
            row: Of the end in the arena's routes: a waypoint, or after them a UAS's start.
            start_m: (3,).
            end_m: (3,).
        """
        found = [_corners(arena, row, start_m, end_m) for arena in self._arenas]
        if len(found) > 1 and len(found[0]) == len(found[1]) and np.allclose(found[0], found[1]):
            found.pop()
        return found


def _corners(arena: Arena, row: int, start_m: FloatArray, end_m: FloatArray) -> FloatArray:
    points = [start_m]
    north_m, east_m, _, kind = route(arena, row, *start_m, *end_m)
    while kind == ROUND_CORNER and len(points) <= _CORNERS:
        points.append(np.array([north_m, east_m, end_m[2]]))
        north_m, east_m, kind = leg_from_corner(arena, row, *points[-1], *end_m)
    return np.array([*points, end_m])


@allocating_kernel
def over_s(uas, here_m, to_m, radius_m, way_m, needed_m):
    """Time [s] of a way over roofs: flown, or climbed and descended, whichever is longer.

    Args:
        uas: Record of the arena.
        here_m: (3,) where it begins.
        to_m: (3,) where it ends, within `radius_m`.
        radius_m: See there.
        way_m: Its horizontal length.
        needed_m: Altitude over the roofs; -inf where there is none.
    """
    rise_s = max(needed_m + here_m[2], 0.0) / uas.climb_mps
    sink_s = max(needed_m + to_m[2] - radius_m, 0.0) / uas.descent_mps
    return max(way_m / uas.speed_mps, rise_s + sink_s)


@allocating_kernel
def round_s(around, uas, row, here_m, to_m):
    """Time [s] of the way round what could be passed over; inf where it does not turn at a corner.

    Args:
        around: The arena of the mission `raised`.
        uas: Record of the arena.
        row: Of the end in `route`.
        here_m: (3,).
        to_m: (3,).
    """
    _, _, way_m, leg = route(
        around, row, here_m[0], here_m[1], here_m[2], to_m[0], to_m[1], to_m[2]
    )
    return way_m / uas.speed_mps if leg == ROUND_CORNER else math.inf


@allocating_kernel
def corner_between(arena, around, row, at_m, is_corner, to_m):
    """(north, east, whether it is one) of the corner on the way from a place to the next.

    Args:
        arena: The arena.
        around: That of the mission `raised`.
        row: Of the next place in `route`.
        at_m: (3,) the place.
        is_corner: Whether it is a corner itself.
        to_m: (3,) the next place.
    """
    for known in (arena, around):
        if is_corner:
            north_m, east_m, leg = leg_from_corner(
                known, row, at_m[0], at_m[1], at_m[2], to_m[0], to_m[1], to_m[2]
            )
        else:
            north_m, east_m, _, leg = route(
                known, row, at_m[0], at_m[1], at_m[2], to_m[0], to_m[1], to_m[2]
            )
        if leg == CLEAR:
            return north_m, east_m, False
    return north_m, east_m, leg == ROUND_CORNER

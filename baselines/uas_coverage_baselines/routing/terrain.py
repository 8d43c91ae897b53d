"""Ways past the fixed obstacles, for leg times and for where a flight's search begins.

The world's routes fly over what is low and round what is tall. Where a climb takes longer than the
way round, round is better even where over is possible; so everything is asked twice, the second
time with what rises above the usual waypoint made tall.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.mission import Legs, MissionBrief
from uas_coverage_env.scenario import Obstacle
from uas_coverage_env.world import Arena, route
from uas_coverage_env.world.routes import ROUND_CORNER, leg_from_corner

FloatArray = NDArray[np.float64]
_ABOVE_M = 1.0
_CORNERS = 20


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
        raised = _raised(brief)
        if raised is not None:
            around = Legs(raised)
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


def _raised(brief: MissionBrief) -> MissionBrief | None:
    """The mission with what rises above the usual waypoint made as tall as the fence.

    None where nothing does, and routes would be the same.
    """
    targets_m = [*(w.position_m[2] for w in brief.waypoints), *(u.start_m[2] for u in brief.uas)]
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

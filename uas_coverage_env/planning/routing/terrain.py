"""Ways past the fixed obstacles, for leg times and for where a flight's search begins.

The world's routes fly over what is low and round what is tall. Where a climb takes longer than the
way round, round is better even where over is possible; so everything is asked twice, the second
time with what rises above the usual waypoint made tall.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.raised import raised
from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.world import Arena
from uas_coverage_env.world.routes import ROUND_CORNER, leg_from_corner, route

FloatArray = NDArray[np.float64]
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

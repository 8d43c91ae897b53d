"""Flying to a hard waypoint with care: to the freest place inside it, and to rest there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.autopilot.guidance import velocity_of
from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.mission.views import WorldView
from uas_coverage_env.vehicle.scale import SLOW_SHARE, length_scale
from uas_coverage_env.world import Arena, GoTo, SwarmState, Velocity

FloatArray = NDArray[np.float64]

_SPARE_M = 1.0
"""Beyond safe distances and the margin of the fence, at scale 1: guidance stops short of them."""

_WITHIN = 0.9
"""Share of a waypoint's radius by which its aim may lie beside its centre."""

_ROUNDS = 100


def free_aims_m(brief: MissionBrief) -> FloatArray:
    """The place in each waypoint to fly to, as clear of everything fixed as guidance likes it.

    Args:
        brief: The mission.

    Returns:
        (W, 3) the centre where that is clear, else moved out of the way, within the radius [m].
    """
    return np.array([_free_aim_m(brief, w) for w in range(len(brief.waypoints))])


def _free_aim_m(brief: MissionBrief, waypoint: int) -> FloatArray:
    centre_m = np.array(brief.waypoints[waypoint].position_m, float)
    most_m = _WITHIN * brief.waypoints[waypoint].radius_m
    heights_m = brief.waypoints[waypoint].heights_m
    uas_m = max(uas.radius_m for uas in brief.uas)
    spare_m = _SPARE_M * length_scale(brief.vehicles, brief.dt_s)
    fence_m = brief.geofence.margin_m + spare_m
    aim_m: FloatArray = centre_m.copy()
    for _ in range(_ROUNDS):
        before_m = aim_m.copy()
        if brief.min_height_m:
            aim_m[2] = min(aim_m[2], -brief.min_height_m - spare_m)
        if heights_m is not None:
            aim_m[2] = min(max(aim_m[2], -heights_m[1]), -heights_m[0])
        for obstacle, hull in zip(brief.obstacles, brief.kept_hulls, strict=True):
            away_m = hull.face_distances(aim_m)
            face = int(away_m.argmax())
            missing_m = uas_m + obstacle.safe_distance_m + spare_m - float(away_m[face])
            aim_m += max(missing_m, 0.0) * hull.normals[face]
        for normal, offset_m in zip(brief.fence.normals, brief.fence.offsets_m, strict=True):
            beyond_m = float(normal @ aim_m) + offset_m + fence_m
            aim_m -= max(beyond_m, 0.0) * normal
        if brief.planar is not None:
            aim_m[2] = centre_m[2]
        if (moved_m := float(np.linalg.norm(aim_m - centre_m))) > most_m:
            aim_m = centre_m + (aim_m - centre_m) * (most_m / moved_m)
        if np.abs(aim_m - before_m).max() < 1e-6:
            break
    return aim_m


def with_free_aims(brief: MissionBrief) -> MissionBrief:
    """The mission with each waypoint moved to its `free_aims_m`."""
    moved = tuple(
        waypoint.model_copy(update={"position_m": tuple(aim_m.tolist())})
        for waypoint, aim_m in zip(brief.waypoints, free_aims_m(brief), strict=True)
    )
    return brief.model_copy(update={"waypoints": moved})


def carefully(arena: Arena) -> Arena:
    """The arena with UAS that guidance flies slowly.

    Fast enough to get there, slow enough to turn into a gap that guidance overshoots.
    """
    uas = arena.uas.copy()
    uas["speed_mps"] *= SLOW_SHARE
    return arena._replace(uas=uas)


class Approach:
    """Commands that fly to hard waypoints as the world's guidance does, slowly, to rest in them.

    Args:
        brief: The mission.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._brief = brief
        self._view: WorldView | None = None

    def command(self, swarm: SwarmState, uas: int, waypoint: int) -> Velocity:
        """The velocity of a UAS now.

        Args:
            swarm: What is seen.
            uas: Index of the UAS.
            waypoint: Index of the waypoint.
        """
        if self._view is None:
            self._view = WorldView(with_free_aims(self._brief))
            self._view.arena = carefully(self._view.arena)
        self._view.update(swarm)
        state = self._view.state
        state.uncovered[waypoint] = False  # guidance comes to rest at what is covered
        return velocity_of(self._view.arena, state, uas, GoTo(waypoint, mode="covering"))

"""Who flies to which waypoint: the memory that the simple planners share."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.world import Command, GoTo, SwarmState


class Targets:
    """One target per UAS, kept until it is covered, or blocked by a moving obstacle."""

    def __init__(self, brief: MissionBrief) -> None:
        self._waypoints_m = np.array([waypoint.position_m for waypoint in brief.waypoints])
        # how near to the centre of a moving obstacle nobody should come
        radius_m = max(uas.radius_m for uas in brief.uas)
        self._keep_out_m = np.array(
            [
                (
                    obstacle.radius_m + obstacle.safe_distance_m + radius_m,
                    obstacle.height_m / 2 + obstacle.safe_distance_m + radius_m,
                )
                for obstacle in brief.moving_obstacles
            ]
        ).reshape(-1, 2)
        self._target: dict[str, int] = {}

    def commands(
        self, swarm: SwarmState, choose: Callable[[SwarmState, int, NDArray[np.bool_]], int]
    ) -> Mapping[str, Command]:
        """A command for each active UAS: to its target, or home when everything is covered.

        Args:
            swarm: What the planner sees.
            choose: (swarm, index of the UAS, (W,) candidates) -> one of the candidates.
        """
        if not swarm.uncovered.any():
            return {name: GoTo(None) for name in swarm.active}
        free = swarm.uncovered & ~self._blocked(swarm)
        self._target = {
            name: target
            for name, target in self._target.items()
            if name in swarm.active and free[target]
        }
        for name in swarm.active:
            if name not in self._target:
                candidates = self._candidates(swarm, free)
                self._target[name] = choose(swarm, swarm.names.index(name), candidates)
        return {name: GoTo(self._target[name], mode="covering") for name in swarm.active}

    def nearest(self, swarm: SwarmState, uas: int, candidates: NDArray[np.bool_]) -> int:
        """The candidate nearest to a UAS."""
        distances_m = np.linalg.norm(self._waypoints_m - swarm.x[uas, :3], axis=1)
        return int(np.where(candidates, distances_m, np.inf).argmin())

    def _candidates(self, swarm: SwarmState, free: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(W,) open waypoints that are free and nobody's target, else the next best.

        The last waypoints are shared: a UAS that is called home may never reach its target.
        """
        unclaimed = np.ones_like(free)
        unclaimed[list(self._target.values())] = False
        for candidates in (free & unclaimed, free):
            if candidates.any():
                return candidates
        return swarm.uncovered

    def _blocked(self, swarm: SwarmState) -> NDArray[np.bool_]:
        """(W,) whether a moving obstacle is now where the waypoint is."""
        offset_m = np.abs(self._waypoints_m[:, None] - swarm.moving_position_m)
        beside_m = np.hypot(offset_m[..., 0], offset_m[..., 1])
        inside = (beside_m < self._keep_out_m[:, 0]) & (offset_m[..., 2] < self._keep_out_m[:, 1])
        return np.asarray(inside.any(axis=1))

"""Assignment of waypoints to UAS: the state that the simple planners share."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.rehearsal import rehearse_once
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.flight import Planner
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.planning.following import Following
from uas_coverage_env.world import Command, GoTo, SwarmState


def warm_up_once(planner: Planner, brief: MissionBrief) -> None:
    """Let a planner decide before anything counts: its first decision in a process compiles."""

    def rehearse() -> None:
        planner.reset(brief, 0)
        planner.act(first_sight(brief))

    rehearse_once(type(planner), rehearse)


class Targets:
    """One target per UAS, kept until it is covered, blocked by a moving obstacle, or given up.

    A target to which a UAS comes no nearer is flown to with care, then left for later, and given up
    in the end: see `GuidedFlight`.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._waypoints_m = np.array([waypoint.position_m for waypoint in brief.waypoints])
        self._following = Following(brief, calls_home=False)
        self._guided = self._following.guided
        self._can_cover = brief.can_cover
        self._target: dict[str, int] = {}

    def commands(
        self, swarm: SwarmState, choose: Callable[[SwarmState, int, NDArray[np.bool_]], int]
    ) -> Mapping[str, Command]:
        """A command for each active UAS: to its target, or home when it has nothing to cover.

        Args:
            swarm: What the planner sees.
            choose: (swarm, index of the UAS, (W,) candidates, which it can cover) -> one of them.
        """
        seen = self._following.update(swarm)
        if not seen.wanted.any():
            return {name: GoTo(None) for name in swarm.active}
        blocked = seen.blocked
        wanted = {
            swarm.names[u]: self._guided.wanted_of(swarm.uncovered, self._can_cover[u])
            for u in np.flatnonzero(swarm.status == FLYING)
        }
        self._target = {
            name: target
            for name, target in self._target.items()
            if name in wanted and wanted[name][target] and not blocked[target]
        }
        for name, mine in wanted.items():
            if name not in self._target and mine.any():
                candidates = self._candidates(mine, mine & ~blocked)
                self._target[name] = choose(swarm, swarm.names.index(name), candidates)
        return self._following.towards(seen, self._target)

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are given up, and why in a few words."""
        return self._guided.given_up

    def nearest(self, swarm: SwarmState, uas: int, candidates: NDArray[np.bool_]) -> int:
        """The candidate nearest to a UAS."""
        distances_m = np.linalg.norm(self._waypoints_m - swarm.x[uas, :3], axis=1)
        return int(np.where(candidates, distances_m, np.inf).argmin())

    def _candidates(self, wanted: NDArray[np.bool_], free: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(W,) open waypoints that are free and no UAS's target, else the next best.

        The last waypoints are shared: a UAS that is called home may never reach its target.
        """
        unclaimed = np.ones_like(free)
        unclaimed[list(self._target.values())] = False
        for candidates in (free & unclaimed, free):
            if candidates.any():
                return candidates
        return wanted

"""The mission as `order` reads it: leg times from the mission layer, from where the UAS are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.route.clock import Mission
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.reserves import LEARNED_ROUTE
from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world import SwarmState, build_arena

WEIGHT = 0.6
"""Of a second of any flight against one of the longest: the default of `trajectory`."""

_LONE_UNIT_S = 5.0
_LEGS, _LANDING_S = LEARNED_ROUTE.legs_share, LEARNED_ROUTE.landing_s


class MissionMaker:
    """What does not change is computed once.

    Args:
        brief: The mission.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._legs = legs = Legs(brief)
        self._uas = build_arena(brief.as_scenario()).uas
        self._until_s, self._landing_m = brief.max_steps * brief.dt_s, brief.landing_distance_m
        self._speed_mps = legs.speed_mps[:, None]
        # of the slowest: one clock for all
        self._between_s = _LEGS * np.ascontiguousarray(legs.between_s.max(axis=0))
        n = len(self._between_s)
        nearest_s = (self._between_s + 1e9 * np.eye(n)).min(axis=1) if n > 1 else [_LONE_UNIT_S]
        self._unit_s = max(float(np.mean(nearest_s)), 0.1)

    def mission(
        self, swarm: SwarmState, works: NDArray[np.bool_], late: NDArray[np.bool_]
    ) -> Mission:
        """The mission from here.

        Args:
            swarm: Where all are.
            works: (U,) UAS that may be given waypoints.
            late: (W,) waypoints that are to come last.
        """
        legs, x = self._legs, swarm.x
        n_uas = len(x)
        battery_s = (self._uas["dod_max"] - x[:, S.DOD]) / self._uas["dod_per_s"]
        left_s = np.minimum(battery_s, self._until_s - swarm.time_s)
        here_home_s = np.array([legs.way_home_s(u, x[u, :3]) for u in range(n_uas)])
        here_home_s = np.where(swarm.departed, _LEGS * here_home_s + _LANDING_S, 0.0)
        return Mission(
            place_m=np.ascontiguousarray(legs.waypoints_m[:, :2]),
            radius_s=legs.turn_s.max(axis=0),
            between_s=self._between_s,
            home_s=_LEGS * legs.home_s + _LANDING_S,
            start_m=np.ascontiguousarray(legs.starts_m[:, :2]),
            here_m=np.ascontiguousarray(x[:, :2]),
            velocity=np.ascontiguousarray(x[:, S.VX : S.VY + 1]) / self._speed_mps,
            from_s=_LEGS * np.array([legs.from_here_s(u, x[u, :3]) for u in range(n_uas)]),
            here_home_s=here_home_s,
            budget_s=left_s - LEARNED_ROUTE.kept_s,
            may=works & (swarm.status == FLYING),
            late=late.copy(),
            unit_s=self._unit_s,
            weight=WEIGHT,
        )

"""The routing problem: positions of the UAS, open waypoints, and flight times left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.planning.routing.terrain import Terrain
from uas_coverage_env.vehicle.layout import VX, VY

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

FLOWN_BY, GROUND_S, IDLE_COST_S = range(3)
"""Columns of `RoutingTask.packs`."""


@dataclass(frozen=True)
class RoutingTask:
    """The routing problem of one moment: U UAS that may be sent, W waypoints.

    Attributes:
        open_waypoints: (K,) rows of the waypoints still to be visited.
        first_s: (U, W) leg times from where each UAS is.
        between_s: (V, W, W) leg times between waypoints, per kind of vehicle.
        kind: (U,) row of each UAS in `between_s`.
        home_s: (U, W) leg times home, the landing included.
        idle_s: (U,) what a UAS takes that visits nothing more: its way home.
        position_m: (U, 2) where each UAS is, north and east.
        velocity_mps: (U, 2) horizontal velocity.
        speed_mps: (U,) cruising speed.
        acceleration_mps2: (U,) how fast the velocity can change.
        start_m: (U, 2) where each has to land.
        waypoints_m: (W, 3).
        turn_s: (U, W) time that passing a sphere's radius takes: scale of what turning costs.
        neighbours: (W, K) near waypoints of each, nearest first.
        weight: (W,) worth of a waypoint.
        not_before_s: (W,) from now on; 0 where the waypoint can be visited at any time.
        budget_s: (U,) how long each UAS may fly; -inf (with `idle_s` 0) where it may not at all.
        turn_of_cosine: What turning costs, in `turn_s`, by cosine from -1 to 1; None: of flights
            that cut through waypoints.
        barred: (U, W) which UAS must not visit which waypoint; None: any may visit any.
        packs: (U, 3) where a UAS flies more than once: U counts flights then, those of a UAS in
            their order. Columns: `FLOWN_BY`, which UAS flies it; `GROUND_S`, how long it is on the
            ground before; `IDLE_COST_S`, what it costs to fly again after this flight without a
            visit, after which no UAS is sent out. None: each UAS flies once.
    """

    open_waypoints: NDArray[np.int64]
    first_s: FloatArray
    between_s: FloatArray
    kind: NDArray[np.int64]
    home_s: FloatArray
    idle_s: FloatArray
    position_m: FloatArray
    velocity_mps: FloatArray
    speed_mps: FloatArray
    acceleration_mps2: FloatArray
    start_m: FloatArray
    waypoints_m: FloatArray
    turn_s: FloatArray
    neighbours: NDArray[np.int64]
    weight: FloatArray
    not_before_s: FloatArray
    budget_s: FloatArray
    turn_of_cosine: FloatArray | None = None
    barred: NDArray[np.bool_] | None = None
    packs: FloatArray | None = None

    @classmethod
    def of(
        cls,
        legs: Legs | Terrain,
        x: FloatArray,
        may_work: BoolArray,
        *,
        open_waypoints: BoolArray,
        weight: FloatArray,
        budget_s: FloatArray,
        landing_s: float,
        not_before_s: FloatArray | None = None,
        stretch: float = 1.0,
        speed_share: float = 1.0,
        barred: BoolArray | None = None,
    ) -> RoutingTask:
        """The routing problem of UAS where they are, whose flights cut through waypoints.

        Args:
            legs: Leg times; with `Terrain`, the shorter of the ways over and round obstacles.
            x: (U, 14) states.
            may_work: (U,) may be sent; the others visit nothing and take no time.
            open_waypoints: (W,) still to be visited.
            weight: (W,).
            budget_s: (U,) how long each may fly.
            landing_s: What landing takes beyond the leg home.
            not_before_s: (W,) from now on; None: any time.
            stretch: How much longer legs take than their times say.
            speed_share: Share of the cruising speed that is flown.
            barred: (U, W) which UAS must not visit which waypoint; None: any may.
        """
        own = legs.legs if isinstance(legs, Terrain) else legs
        position_m = x[:, :3]
        n_uas, n_waypoints = len(x), len(own.waypoints_m)
        idle_s = np.array([own.way_home_s(u, position_m[u]) for u in range(n_uas)])
        first_s = np.array([legs.from_here_s(u, position_m[u]) for u in range(n_uas)])
        return cls(
            open_waypoints=np.flatnonzero(open_waypoints),
            first_s=stretch * first_s,
            between_s=stretch * legs.between_s,
            kind=own.kind,
            home_s=stretch * legs.home_s + landing_s,
            idle_s=np.where(may_work, idle_s, 0.0),
            position_m=np.ascontiguousarray(position_m[:, :2]),
            velocity_mps=np.ascontiguousarray(x[:, VX : VY + 1]),
            speed_mps=speed_share * own.speed_mps,
            acceleration_mps2=own.acceleration_mps2,
            start_m=np.ascontiguousarray(own.starts_m[:, :2]),
            waypoints_m=own.waypoints_m,
            turn_s=own.turn_s / speed_share,
            neighbours=own.neighbours,
            weight=weight,
            not_before_s=np.zeros(n_waypoints) if not_before_s is None else not_before_s,
            budget_s=np.where(may_work, budget_s, -np.inf),
            barred=barred,
        )

    @property
    def n_uas(self) -> int:
        """U."""
        return len(self.first_s)

    @property
    def n_waypoints(self) -> int:
        """W."""
        return len(self.waypoints_m)

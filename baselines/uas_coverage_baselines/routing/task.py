"""The routing problem: positions of the UAS, open waypoints, and flight times left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


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

    @property
    def n_uas(self) -> int:
        """U."""
        return len(self.first_s)

    @property
    def n_waypoints(self) -> int:
        """W."""
        return len(self.waypoints_m)

"""The routing problem of a moment: where the UAS are, open waypoints, and flight times left.

In the terms of vehicle routing: vehicles that are not alike, each with its own start, end and
limit of duration; clients that may be left out at a price, each with a release date and some
vehicles that are forbidden; several trips of a vehicle; times between clients that depend on the
client before (turns); and an objective of the longest duration and a share of the sum.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.planning.reserves import Reserve
from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.planning.routing.terrain import Terrain
from uas_coverage_env.vehicle.layout import DOD, VX, VY

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

ROUTED_UAS_DTYPE = record_dtype(
    [
        # row in `between_s`
        ("kind", "i8"),
        # which UAS flies this route: several routes of one are its trips, in their order
        ("flown_by", "i8"),
        # where it is, north and east, and its horizontal velocity
        ("position_m", "f8", (2,)),
        ("velocity_mps", "f8", (2,)),
        # where it has to land
        ("home_m", "f8", (2,)),
        # cruising, and how fast the velocity can change
        ("speed_mps", "f8"),
        ("acceleration_mps2", "f8"),
        # what it takes without a visit: its way home
        ("idle_s", "f8"),
        # how long it may fly; -inf (with `idle_s` 0) where it may not at all
        ("budget_s", "f8"),
        # on the ground before a trip
        ("ground_s", "f8"),
        # what it costs to fly again after this trip without a visit, after which no UAS is sent out
        ("again_s", "f8"),
    ]
)
"""One UAS (with trips: one of its flights) of a `RoutingProblem`."""


class SeenSwarm(Protocol):
    """What is seen of a swarm: a `SwarmState`, or any record with these three."""

    @property
    def x(self) -> FloatArray:
        """(U, 14) states."""

    @property
    def uncovered(self) -> BoolArray:
        """(W,)."""

    @property
    def time_s(self) -> float:
        """Since the start."""


@dataclass(frozen=True)
class RoutingProblem:
    """The routing problem of one moment: U UAS that may be sent, W waypoints.

    Attributes:
        open_waypoints: (K,) rows of the waypoints still to be visited.
        uas: (U,) of `ROUTED_UAS_DTYPE`.
        first_s: (U, W) leg times from where each UAS is; inf: it cannot cover the waypoint.
        between_s: (V, W, W) leg times between waypoints, per kind of vehicle.
        home_s: (U, W) leg times home, the landing included.
        turn_s: (U, W) what `turn_of_cosine` counts: the time that a waypoint's radius takes.
        turn_of_cosine: (N,) what turning costs, in `turn_s`, by cosine from -1 to 1.
        waypoints_m: (W, 3).
        neighbours: (W, K) near waypoints of each, nearest first.
        weight: (W,) worth of a waypoint.
        release_s: (W,) from now on; 0 where the waypoint can be visited at any time.
        forbidden: (U, W) which UAS must not visit which waypoint.
    """

    open_waypoints: IntArray
    uas: NDArray[np.void]
    first_s: FloatArray
    between_s: FloatArray
    home_s: FloatArray
    turn_s: FloatArray
    turn_of_cosine: FloatArray
    waypoints_m: FloatArray
    neighbours: IntArray
    weight: FloatArray
    release_s: FloatArray
    forbidden: BoolArray

    @classmethod
    def seen(
        cls,
        brief: MissionBrief,
        swarm: SeenSwarm,
        legs: Legs | Terrain,
        works: BoolArray,
        reserve: Reserve,
        *,
        open_waypoints: BoolArray | None = None,
        release_s: FloatArray | None = None,
        forbidden: BoolArray | None = None,
        late_s: float | FloatArray = 0.0,
        pace: float | FloatArray = 1.0,
        speed_share: float = 1.0,
    ) -> RoutingProblem:
        """The routing problem of a swarm as it is seen.

        Args:
            brief: The mission.
            swarm: Where all are, what is uncovered, and the time.
            legs: Leg times; with `Terrain`, the shorter of the ways over and round obstacles.
            works: (U,) may be sent; the others visit nothing and take no time.
            reserve: What is kept of the flying time, and what legs and landings take.
            open_waypoints: (W,) to be visited; None: what is uncovered, of what one of those that
                work can cover.
            release_s: (W,) when each may be visited, from now on; None: at any time.
            forbidden: (U, W) which UAS must not visit which waypoint; None: any may.
            late_s: (U,) or one for all: taken off the budgets.
            pace: (U,) or one for all: how much longer flights take than their legs.
            speed_share: Of the cruising speed, that is flown.
        """
        own = legs.legs if isinstance(legs, Terrain) else legs
        x, n_uas, n_waypoints = swarm.x, len(swarm.x), len(own.waypoints_m)
        if open_waypoints is None:
            open_waypoints = swarm.uncovered.copy()
            if works.any():
                open_waypoints &= brief.can_cover[works].any(axis=0)
        uas = np.zeros(n_uas, ROUTED_UAS_DTYPE)
        uas["kind"], uas["flown_by"] = own.kind, np.arange(n_uas)
        uas["position_m"], uas["velocity_mps"] = x[:, :2], x[:, VX : VY + 1]
        uas["home_m"] = own.homes_m[:, :2]
        uas["speed_mps"] = speed_share * own.speed_mps
        uas["acceleration_mps2"] = own.acceleration_mps2
        way_home_s = np.array([own.way_home_s(u, x[u, :3]) for u in range(n_uas)])
        uas["idle_s"] = np.where(works, way_home_s, 0.0)
        budgets_s = budget_s(brief, swarm, own, reserve, late_s=late_s, pace=pace)
        uas["budget_s"] = np.where(works, budgets_s, -np.inf)
        longer = reserve.legs_share / speed_share
        first_s = np.array([legs.from_here_s(u, x[u, :3]) for u in range(n_uas)])
        return cls(
            open_waypoints=np.flatnonzero(open_waypoints),
            uas=uas,
            first_s=longer * first_s,
            between_s=longer * legs.between_s,
            home_s=longer * legs.home_s + reserve.landing_s,
            turn_s=own.turn_s / speed_share,
            turn_of_cosine=own.turn_of_cosine,
            waypoints_m=own.waypoints_m,
            neighbours=own.neighbours,
            weight=np.array([w.weight for w in brief.waypoints], float),
            release_s=np.zeros(n_waypoints) if release_s is None else release_s,
            forbidden=np.zeros((n_uas, n_waypoints), np.bool_) if forbidden is None else forbidden,
        )

    def replace(self, **changes: Any) -> RoutingProblem:
        """The same problem with other arrays, by name; those of `uas` by the name of its field."""
        fields = {name: changes.pop(name) for name in self.uas.dtype.names or () if name in changes}
        if fields:
            uas = changes.pop("uas", self.uas).copy()
            for name, values in fields.items():
                uas[name] = values
            changes["uas"] = uas
        return dataclasses.replace(self, **changes)

    @property
    def n_uas(self) -> int:
        """U."""
        return len(self.uas)

    @property
    def n_waypoints(self) -> int:
        """W."""
        return len(self.waypoints_m)

    @property
    def may_fly(self) -> BoolArray:
        """(U,) which UAS may be sent at all."""
        return self.uas["budget_s"] > -np.inf


def battery_s(brief: MissionBrief, legs: Legs, x: FloatArray) -> FloatArray:
    """(U,) seconds that each battery lasts at full speed, and with the worst vehicle stated."""
    uas, conditions = legs.arena.uas, brief.conditions
    share = 1.0 if conditions is None else conditions.charge_share
    return share * (uas["dod_max"] - x[:, DOD]) / uas["dod_per_s"]


def budget_s(
    brief: MissionBrief,
    swarm: SeenSwarm,
    legs: Legs,
    reserve: Reserve,
    *,
    late_s: float | FloatArray = 0.0,
    pace: float | FloatArray = 1.0,
) -> FloatArray:
    """(U,) seconds of legs that battery and clock allow; arguments as of `RoutingProblem.seen`."""
    until_s = brief.max_steps * brief.dt_s - swarm.time_s
    left_s = reserve.time_share * np.minimum(battery_s(brief, legs, swarm.x), until_s)
    return (left_s - reserve.kept_s - reserve.spare_s - late_s) / pace

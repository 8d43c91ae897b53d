"""What one decision's OCP is about: everything a block may read, and the columns all blocks share.

Operation modes are data before the OCP (Sec. III-C.6): a landed UAS is absent, a target is a
`Target` or None, a waypoint out of reach or covered is absent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.milp import Columns
from uas_coverage_baselines.milp_mpc.model.norm_bounds import NormBounds, norm_bounds
from uas_coverage_baselines.milp_mpc.model.reachability import Reach
from uas_coverage_env.geometry import ConvexPolytope, cylinder_faces, sphere_faces
from uas_coverage_env.geometry.round_shapes import closed_cylinder_faces
from uas_coverage_env.vehicle import LinearModel, VehicleParams
from uas_coverage_env.vehicle.layout import N_STATES, VX, VZ, Z

FloatArray = NDArray[np.float64]
NEVER = 10_000
"""The step of a visit that does not take place."""


def name_of(block: object) -> str:
    """The name of a block's data: its attribute `name`, or its class."""
    return str(getattr(block, "name", type(block).__name__))


@dataclass(frozen=True)
class Weights:
    """Cost coefficients of the objective (OF); each term is normalised by its largest value.

    The paper names what is penalised but publishes no figures; these are ours, in units of one
    waypoint of weight 1 left uncovered for one step. `climb`, on |v_z|, is not among the paper's:
    without it heights are indifferent, and a plan may descend for nothing. `home_per_m_max` bounds
    what a metre from home costs in a step: distance counts at samples only, and were it dearer than
    lift, a UAS would bob through its home once a step instead of coming to rest.
    """

    lift: float = 0.05
    torque: float = 0.05
    rate: float = 0.03
    yaw: float = 0.05
    energy: float = 0.05
    climb: float = 0.0
    transit: float = 0.6
    return_home: float = 2.5
    home_per_m_max: float = 0.1


@dataclass(frozen=True)
class Target:
    """What a UAS's target distance is measured to (Sec. III-C.6).

    Attributes:
        position_m: (3,) the target, NED.
        weight: cost per metre of distance and step, W_target.
        waypoint: position of the waypoint in `PlanningProblem.waypoints_m`, whose coverage
            relaxes the constraint; None for the initial position.
    """

    position_m: FloatArray
    weight: float
    waypoint: int | None = None


@dataclass(frozen=True)
class TourSegment:
    """What a UAS is to visit next, in this order, before it goes on (`order=search`).

    Attributes:
        waypoints: (K,) positions in `PlanningProblem.waypoints_m`.
        aims_m: (K+1, 3) these waypoints, and what follows them: a waypoint farther on, or home.
        radius_m: (K+1,) how near to an aim counts as there.
        lead_s: the next aim is measured from where the UAS would be after so long.
        onward_s: (K,) flight time from each waypoint to the next aim.
    """

    waypoints: NDArray[np.int64]
    aims_m: FloatArray
    radius_m: FloatArray
    lead_s: float
    onward_s: FloatArray

    def led_by_m(self, waypoints_m: FloatArray) -> FloatArray | None:
        """(3,) where the way to the first waypoint turns; None where it leads straight there."""
        straight = np.array_equal(self.aims_m[0], waypoints_m[self.waypoints[0]])
        return None if straight else self.aims_m[0]


@dataclass(frozen=True)
class WayHome:
    """The way home of a UAS whose home is shaded by an obstacle, see `mission.Ways`.

    Attributes:
        corner_m: (3,) where the way turns, or where it begins to lead over a roof.
        onward_s: flight time home from there, as the reserve takes it.
    """

    corner_m: FloatArray
    onward_s: float


@dataclass(frozen=True)
class MovingHull:
    """A moving obstacle as the planner predicts it: constant velocity, closed cylinder.

    Attributes:
        name: name in the scenario.
        position_m: (N+1, 3) predicted centre.
        radius_m: its own radius.
        half_height_m: half its height.
    """

    name: str
    position_m: FloatArray
    radius_m: float
    half_height_m: float


@dataclass(frozen=True)
class Hulls:
    """The faces of all fixed obstacles in one array.

    Attributes:
        normals: (F, 3).
        offsets_m: (F,).
        first: (O,) each obstacle's first face.
    """

    normals: FloatArray
    offsets_m: FloatArray
    first: NDArray[np.int64]

    @classmethod
    def of(cls, hulls: Sequence[ConvexPolytope]) -> Hulls:
        """Stacked in the given order."""
        counts = np.array([hull.n_faces for hull in hulls], np.int64)
        return cls(
            np.concatenate([np.zeros((0, 3)), *(hull.normals for hull in hulls)]),
            np.concatenate([np.zeros(0), *(hull.offsets_m for hull in hulls)]),
            np.cumsum(counts) - counts,
        )

    def apart_m(self, path: FloatArray) -> FloatArray:
        """(O,) by how much the best single face of each obstacle separates a whole path from it."""
        if not len(self.first):
            return np.zeros(0)
        beyond = (self.normals @ path.T + self.offsets_m[:, None]).min(axis=1)
        return np.maximum.reduceat(beyond, self.first)


@dataclass(frozen=True)
class PlanningProblem:
    """One decision.

    Attributes:
        names: the active UAS.
        vehicles: (U) their parameters.
        models: (U) the LPV matrices for the measured depth of discharge, held over the horizon.
        x0: (U, 14) measured states.
        horizon: N.
        fence: the geofence.
        fence_margin_m: how far inside it the plan stays, -delta_G.
        obstacles: names and hulls of the fixed obstacles.
        obstacle_clearance_m: (U, O) delta_O,min, margins included.
        moving: the moving obstacles.
        moving_clearance_m: (U, M) added to radius and half height.
        separation_m: (U, U) delta_C,min.
        waypoints_m: (W, 3) the uncovered waypoints considered.
        waypoint_reach_m: (W,) delta_WP times the inner factor c_in.
        waypoint_weight: (W,) W_Phi.
        waypoint_index: (W,) index of each in the scenario.
        n_scenario_waypoints: K, how many waypoints the scenario has.
        home_m: (U, 3) where each UAS lands.
        dod_max: (U,) depth of discharge with which it lands at the latest.
        targets: (U) see `Target`.
        min_height_m: least height above the ground outside of a UAS's landing zone, margin
            included; 0: none.
        landing_zone_m: its radius, around `home_m`.
        tours: (U) each UAS's own order, where it has one: it plans these waypoints only; empty
            where no UAS has one.
        ways_home: (U) the way home where an obstacle shades it; empty where none does.
        dt_s: sampling time.
        weights: see `Weights`.
        physical_sides: H_P of what is no limit, a multiple of 4.
        limit_sides: H_P of the limits of speed, tilt and tilt rate, a multiple of 4.
        outer_limits: whether these polygons lie around the limits (c_in = 1), not inside of them.
        obstacle_sides: H_O.
        waypoint_sides: H_WP.
        planar: whether all UAS keep one height, as in the paper's earlier two-dimensional form:
            z, v_z and lift have no columns, and no row or binary is about heights. All normals of
            fence and obstacles are level then.
        order: N_dis, of the series in `models`.
        corners_of_all: whether moving obstacles and pairs of UAS have corner cutting constraints,
            too; fixed obstacles always have.
        prune: whether reachable sets drop what cannot matter; False keeps every row and column,
            with big M from the fence alone (the oracle of the tests).
        data: what blocks of one's own read, by the name of the block, see `data_of`.
    """

    names: tuple[str, ...]
    vehicles: tuple[VehicleParams, ...]
    models: tuple[LinearModel, ...]
    x0: FloatArray
    horizon: int
    fence: ConvexPolytope
    fence_margin_m: float
    obstacles: tuple[tuple[str, ConvexPolytope], ...]
    obstacle_clearance_m: FloatArray
    moving: tuple[MovingHull, ...]
    moving_clearance_m: FloatArray
    separation_m: FloatArray
    waypoints_m: FloatArray
    waypoint_reach_m: FloatArray
    waypoint_weight: FloatArray
    waypoint_index: NDArray[np.int64]
    n_scenario_waypoints: int
    home_m: FloatArray
    dod_max: FloatArray
    targets: tuple[Target | None, ...]
    tours: tuple[TourSegment | None, ...] = ()
    ways_home: tuple[WayHome | None, ...] = ()
    dt_s: float = 1.0
    min_height_m: float = 0.0
    landing_zone_m: float = 0.0
    weights: Weights = field(default_factory=Weights)
    physical_sides: int = 8
    limit_sides: int = 16
    obstacle_sides: int = 8
    waypoint_sides: int = 4
    outer_limits: bool = False
    planar: bool = False
    order: int = 4
    corners_of_all: bool = True
    prune: bool = True
    data: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        # tilt and the way it moves a UAS are turned by a quarter against each other
        for name in ("physical_sides", "limit_sides"):
            sides = getattr(self, name)
            if sides < 4 or sides % 4:
                raise ValueError(f"{name} = {sides}: give a multiple of 4")

    @property
    def n_uas(self) -> int:
        """U."""
        return len(self.names)

    @property
    def n_waypoints(self) -> int:
        """W."""
        return len(self.waypoints_m)

    @property
    def states(self) -> list[int]:
        """The states that the program moves: all; in the plane without z and v_z."""
        return [s for s in range(N_STATES) if not (self.planar and s in (Z, VZ))]

    @property
    def waypoint_faces(self) -> FloatArray:
        """(F, 3) of the sphere around a waypoint; in the plane, of the circle."""
        return (cylinder_faces if self.planar else sphere_faces)(self.waypoint_sides)

    def closed_faces(self, sides: int) -> FloatArray:
        """(sides + 2, 3) of a closed cylinder; in the plane, (sides, 3) without its ends."""
        return (cylinder_faces if self.planar else closed_cylinder_faces)(sides)

    @property
    def assigned(self) -> NDArray[np.bool_]:
        """(U, W) which waypoints each UAS may plan to cover: those of its order, or all."""
        result = np.ones((self.n_uas, self.n_waypoints), bool)
        for uas, tour in enumerate(self.tours):
            result[uas] = False
            if tour is not None:
                result[uas, tour.waypoints] = True
        return result

    @cached_property
    def reach(self) -> Reach:
        """Supersets of the positions each UAS can have at each step."""
        return Reach.of(
            *(self.x0, self.vehicles, self.models, self.horizon, self.fence),
            prune=self.prune,
            sides=self.physical_sides,
            beyond=np.array([bounds.beyond for bounds in self.norm_bounds]),
        )

    @cached_property
    def norm_bounds(self) -> tuple[NormBounds, ...]:
        """(U) the bounds of speed, tilt and tilt rate."""
        return tuple(
            norm_bounds(
                vehicle, x, self.horizon, self.dt_s, self.limit_sides, outer=self.outer_limits
            )
            for vehicle, x in zip(self.vehicles, self.x0, strict=True)
        )

    @cached_property
    def hulls(self) -> Hulls:
        """The fixed obstacles' faces."""
        return Hulls.of([hull for _, hull in self.obstacles])

    def data_of(self, block: object) -> Mapping[str, Any]:
        """What a block has brought to this decision (`own_data.with_data`).

        Raises:
            KeyError: it has brought nothing.
        """
        name = name_of(block)
        if name not in self.data:
            raise KeyError(f"no data of block {name}: take the problem from a planner that has it")
        return self.data[name]

    def limit(self, name: str) -> FloatArray:
        """(U,) one of the vehicles' limits by its field name."""
        return np.array([getattr(v.limits, name) for v in self.vehicles], float)

    def only(self, uas: int) -> PlanningProblem:
        """The same decision for one UAS, as if it were alone."""
        row = [uas]
        return replace(
            self,
            names=(self.names[uas],),
            vehicles=(self.vehicles[uas],),
            models=(self.models[uas],),
            x0=self.x0[row],
            obstacle_clearance_m=self.obstacle_clearance_m[row],
            moving_clearance_m=self.moving_clearance_m[row],
            separation_m=self.separation_m[np.ix_(row, row)],
            home_m=self.home_m[row],
            dod_max=self.dod_max[row],
            targets=(self.targets[uas],),
            tours=self.tours[uas : uas + 1],
            ways_home=self.ways_home[uas : uas + 1],
        )

    def torque_max_Nm(self, axis: int) -> FloatArray:
        """(U,) largest torque about a body axis."""
        return np.array([v.torque_max_Nm[axis] for v in self.vehicles], float)


@dataclass(frozen=True)
class Variables:
    """The columns all blocks share.

    Attributes:
        x: (U, N+1, 14) predicted states.
        u: (U, N, 5) inputs.
        covers: (U, N, W) b_W: 1 where the UAS covers the waypoint at that step.
        uncovered: (N+1, W) Phi: 1 where the waypoint is still open.
    """

    x: Columns
    u: Columns
    covers: Columns
    uncovered: Columns

    @property
    def position(self) -> Columns:
        """(U, N+1, 3)."""
        return self.x[..., 0:3]

    @property
    def velocity(self) -> Columns:
        """(U, N+1, 3)."""
        return self.x[..., VX : VZ + 1]


@dataclass(frozen=True)
class Trajectories:
    """S flights of one UAS over the horizon, as far as they are known: what a block prices.

    Attributes:
        positions_m: (S, N+1, 3).
        visits: (S, W) first step at which each covers a waypoint of the problem, `NEVER` if not.
        x: (S, N+1, 14) states; None where only positions are known.
        u: (S, N, 5) inputs; None likewise.
    """

    positions_m: FloatArray
    visits: NDArray[np.int64]
    x: FloatArray | None = None
    u: FloatArray | None = None


@dataclass(frozen=True)
class Plan:
    """A verified plan.

    Attributes:
        names: the UAS it is for.
        x: (U, n+1, 14) predicted states; n = N when made, less as it is flown.
        u: (U, n, 5) inputs.
        covers: (U, n, K) True where a waypoint is planned to be covered, K all of the scenario's.
        objective: J without what the plan cannot influence.
        bound: proven lower bound of the best objective; -inf where none.
        renewed: the UAS whose part of it is newly planned; the others go on as before.
        cut_short: whether a time limit has ended the search for it.
    """

    names: tuple[str, ...]
    x: FloatArray
    u: FloatArray
    covers: NDArray[np.bool_]
    objective: float
    bound: float
    renewed: tuple[str, ...] = ()
    cut_short: bool = False

    def of(self, name: str) -> int:
        """Row of a UAS."""
        return self.names.index(name)

    def advanced(self) -> Plan | None:
        """What is left of the plan after its first step was flown; None when nothing is."""
        if self.u.shape[1] <= 1:
            return None
        return replace(self, x=self.x[:, 1:], u=self.u[:, 1:], covers=self.covers[:, 1:])

    def positions(self) -> Mapping[str, FloatArray]:
        """(N+1, 3) predicted positions by UAS."""
        return {name: self.x[row, :, 0:3] for row, name in enumerate(self.names)}

    def relative_gap(self) -> float | None:
        """(J - bound) / |J|, J being what the plan can influence; None without a bound."""
        if not np.isfinite(self.bound):
            return None
        return max(self.objective - self.bound, 0.0) / max(abs(self.objective), 1e-6)

"""A scenario as arrays, for the kernels: what never changes during a mission."""

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from uas_coverage_env.compiled.memory import Memory
from uas_coverage_env.geometry import ConvexPolytope, corners_of
from uas_coverage_env.scenario import NoFlyZone, Scenario
from uas_coverage_env.vehicle import compile_vehicle, dod_per_s
from uas_coverage_env.vehicle.compiled import VEHICLE_DTYPE
from uas_coverage_env.world.broad_phase import EPS_M, N_COLUMNS, obstacle_columns
from uas_coverage_env.world.commands import CLIMB, COMMAND_DTYPE
from uas_coverage_env.world.disturbance import (
    DISTURBANCE_DTYPE,
    Disturbance,
    disturbance_tables,
)
from uas_coverage_env.world.events import (
    EVENT_DTYPE,
    SENSING_DTYPE,
    event_records,
    is_eventful,
    sensing_records,
)
from uas_coverage_env.world.overhangs import overhangs
from uas_coverage_env.world.routes import node_distances
from uas_coverage_env.world.tubes import route_tube_m, tubes_m
from uas_coverage_env.world.waypoints import (
    N_WAYPOINT_COLUMNS,
    WAYPOINT_DTYPE,
    sensors_of,
    unit_m_of,
    waypoint_columns,
    waypoint_records,
)

NEAR_M = 20.0
"""Obstacles that are farther need no exact distance, unless nothing is nearer [m]."""

ROUTE_MARGIN_M = 1.0
"""Routes keep this much more than the clearance that counts as a breach [m]."""

NODE_MARGIN_M = 1.0
"""Corners of routes lie this much outside of what routes avoid, so that they see past it [m]."""

LOOKAHEAD_S = 14.0
"""A braking flight takes less than this from the highest speed [s]."""

SAMPLES_AFTER_END = 64
"""Moving obstacles are known this long after max_steps, for missions flown over time."""


def _record(fields: list) -> np.dtype:
    # np.record: attributes work in plain Python too (NUMBA_DISABLE_JIT=1)
    return np.dtype((np.record, np.dtype(fields, align=True)))


UAS_DTYPE = _record(
    [
        ("home_m", "f8", (3,)),
        ("radius_m", "f8"),
        ("dod_max", "f8"),
        # what guidance and return mode assume of the vehicle
        ("speed_mps", "f8"),
        ("climb_mps", "f8"),
        ("descent_mps", "f8"),
        ("dod_per_s", "f8"),
        # bits, see `WAYPOINT_DTYPE`
        ("sensors", "i8"),
    ]
)

OBSTACLE_DTYPE = _record(
    [
        # rows of `normals`: the hull, and the walls of its footprint widened by wall_m
        ("first_face", "i8"),
        ("last_face", "i8"),
        # what commands keep clear of: the hull again, or with its upper faces raised
        ("first_kept", "i8"),
        ("last_kept", "i8"),
        ("first_side", "i8"),
        ("last_side", "i8"),
        ("safe_distance_m", "f8"),
        # the box around the hull, by its middle and half its sides
        ("hull_middle_m", "f8", (3,)),
        ("hull_half_m", "f8", (3,)),
        # outside of this box every point is at least near_m away
        ("near_m", "f8"),
        ("lower_m", "f8", (3,)),
        ("upper_m", "f8", (3,)),
        # the same box by its middle and one over half its sides; beyond it, s times as far from
        # the middle as its walls, every point is at least near_m + rise_m (s - 1) away
        ("middle_m", "f8", (3,)),
        ("per_half_m", "f8", (3,)),
        ("rise_m", "f8"),
        # outside of this box every point is farther away than `rules.measured_m`
        ("measured_lower_m", "f8", (3,)),
        ("measured_upper_m", "f8", (3,)),
        # routes keep wall_m beside it, or pass over it at roof_m, positive up, unless it is tall
        ("wall_m", "f8"),
        ("roof_m", "f8"),
        ("tall", "?"),
        # there is room below a part of it
        ("overhangs", "?"),
        # nothing stands there: no contact
        ("no_fly_zone", "?"),
    ]
)

MOVING_DTYPE = _record(
    [("radius_m", "f8"), ("half_height_m", "f8"), ("safe_distance_m", "f8")],
)

RULES_DTYPE = _record(
    [
        ("dt_s", "f8"),
        ("max_steps", "i8"),
        ("landing_distance_m", "f8"),
        ("landing_speed_mps", "f8"),
        ("uas_safe_distance_m", "f8"),
        ("fence_margin_m", "f8"),
        # above ground and roofs, 0 without such a rule; and how far from its start a UAS may be
        # lower, horizontally
        ("min_height_m", "f8"),
        ("landing_zone_m", "f8"),
        # the largest safe distance of all obstacles
        ("safe_distance_max_m", "f8"),
        # clearances and separations are exact up to here and infinite beyond
        ("measured_m", "f8"),
        # rows of `normals`
        ("fence_first", "i8"),
        ("fence_last", "i8"),
        # the lowest and highest altitude that guidance flies at, positive up
        ("floor_m", "f8"),
        ("ceiling_m", "f8"),
        # how far guidance and safety filter look ahead: time to brake from any speed
        ("lookahead_steps", "i8"),
        # whether any disturbance acts
        ("disturbed", "?"),
        # whether any obstacle overhangs
        ("overhangs", "?"),
        # whether any event may happen, or anything is sensed otherwise than it is
        ("eventful", "?"),
        # whether any waypoint asks for more than that a UAS comes near
        ("asks", "?"),
        # of `waypoint_columns`
        ("unit_m", "f8"),
        # the command to stop and hold still
        ("brake", COMMAND_DTYPE),
    ]
)


class Arena(NamedTuple):
    """The scenario for kernels: entities as records, planes in two arrays.

    U UAS, O obstacles in C columns, F planes, M moving obstacles at T samples, W waypoints and
    N nodes of routes.
    """

    vehicles: Annotated[NDArray[np.void], VEHICLE_DTYPE, "U"]
    uas: Annotated[NDArray[np.void], UAS_DTYPE, "U"]
    obstacles: Annotated[NDArray[np.void], OBSTACLE_DTYPE, "O"]
    obstacle_columns: Annotated[NDArray[np.float64], N_COLUMNS, "C"]
    """See `obstacle_columns`."""
    normals: Annotated[NDArray[np.float64], "F", 3]
    """Faces of the obstacles, the fence, and the walls of footprints."""
    offsets_m: Annotated[NDArray[np.float64], "F"]
    """[m]."""
    moving: Annotated[NDArray[np.void], MOVING_DTYPE, "M"]
    moving_path_m: Annotated[NDArray[np.float64], "T", "M", 3]
    """[m] centres at every sample."""
    moving_velocity_mps: Annotated[NDArray[np.float64], "T", "M", 3]
    """[m/s] velocities at every sample."""
    waypoints: Annotated[NDArray[np.void], WAYPOINT_DTYPE, "W"]
    waypoint_columns: Annotated[NDArray[np.float64], N_WAYPOINT_COLUMNS, "W"]
    """What all waypoints are asked for, in the order in which a processor takes four at a time:
    north, east, down [m], radius² [m²], weight; then whole numbers: share of all weight in units of
    1 / ALL_SHARES, and this times north and east in units of `rules.unit_m`. Sums of whole numbers
    are exact, whatever their order."""
    rules: Annotated[NDArray[np.void], RULES_DTYPE, 1]
    nodes_m: Annotated[NDArray[np.float64], "N", 2]
    """[m] corners at which routes turn."""
    node_distance_m: Annotated[NDArray[np.float64], "W + U", "N"]
    """[m] way from a corner to a waypoint or a start; inf where there is none."""
    disturbances: Annotated[NDArray[np.void], DISTURBANCE_DTYPE, "blocks"]
    """As many as `WorldState` has room for; that is the same in all missions of a pool."""
    disturbance_parameters: Annotated[NDArray[np.float64], "parameters"]
    """Of all disturbances."""
    events: Annotated[NDArray[np.void], EVENT_DTYPE, "E"]
    sensing: Annotated[NDArray[np.void], SENSING_DTYPE, "S"]
    """One for each UAS, or none where they are known as they are."""
    tube_m: Annotated[NDArray[np.float64], "U", "predicted"]
    """See `tubes_m`: what is kept more for what disturbances do to what is predicted."""


ARENA = Memory(Arena)


def build_arena(
    scenario: Scenario,
    *,
    measured_m: float = math.inf,
    disturbances: Sequence[Disturbance | None] = (),
) -> Arena:
    """The scenario as arrays.

    Obstacles that can be flown over without climbing far above the usual waypoint are low, the
    others are tall: routes go round them over the corners of their widened footprints.

    Args:
        scenario: The scenario.
        measured_m: Clearances from obstacles and separations of UAS that are larger are taken as
            infinite [m]. What a contact or a breach depends on is measured in any case: with 0,
            only that, which takes a tenth less time.
        disturbances: What acts besides the scenario's own rules. What the scenario says of
            disturbances is left to the caller: planners build arenas, too.
    """
    uas = _uas(scenario)
    radius_m = max(entry.radius_m for entry in scenario.uas)
    rules = _rules(scenario, radius_m, measured_m)
    waypoints = waypoint_records(scenario)
    rules["unit_m"] = unit_m_of(waypoints["position_m"])
    targets_m = np.concatenate([waypoints["position_m"], uas["home_m"]])
    overfly_m = _overfly_limit(-targets_m[:, 2], float(rules["ceiling_m"][0]))
    blocks, parameters = disturbance_tables(disturbances)
    rules["disturbed"] = blocks["acts"].any()
    tube_m = tubes_m(scenario, int(rules["lookahead_steps"][0]), bool(rules["disturbed"][0]))
    route_m = ROUTE_MARGIN_M + route_tube_m(tube_m)
    obstacles, planes, corners = _obstacles(scenario, radius_m, overfly_m, route_m)
    _measure(obstacles, scenario, float(rules["measured_m"][0]))
    fence = scenario.fence
    rules["fence_first"] = sum(len(rows[1]) for rows in planes)
    rules["fence_last"] = rules["fence_first"] + fence.n_faces
    planes.append((fence.normals, fence.offsets_m))
    normals = np.concatenate([rows[0] for rows in planes])
    offsets_m = np.concatenate([rows[1] for rows in planes])
    rules["overhangs"] = obstacles["overhangs"].any()
    rules["eventful"] = is_eventful(scenario)
    rules["asks"] = waypoints["asks"].any()
    nodes_m = _free_nodes(scenario, corners, obstacles, normals, offsets_m, -targets_m[:, 2])
    moving_path_m, moving_velocity_mps = _moving(scenario)
    return Arena(
        vehicles=_vehicles(scenario),
        uas=uas,
        obstacles=obstacles,
        obstacle_columns=obstacle_columns(obstacles),
        normals=np.ascontiguousarray(normals),
        offsets_m=np.ascontiguousarray(offsets_m),
        moving=np.array(
            [(m.radius_m, m.height_m / 2, m.safe_distance_m) for m in scenario.moving_obstacles],
            dtype=MOVING_DTYPE,
        ),
        moving_path_m=moving_path_m,
        moving_velocity_mps=moving_velocity_mps,
        waypoints=waypoints,
        waypoint_columns=waypoint_columns(waypoints, float(rules["unit_m"][0])),
        rules=rules,
        nodes_m=nodes_m,
        node_distance_m=node_distances(
            obstacles, normals, offsets_m, nodes_m, np.ascontiguousarray(targets_m[:, :2])
        ),
        disturbances=blocks,
        disturbance_parameters=parameters,
        events=event_records(scenario),
        sensing=sensing_records(scenario),
        tube_m=tube_m,
    )


def _vehicles(scenario: Scenario) -> NDArray[np.void]:
    compiled = {v: compile_vehicle(v, scenario.dt_s) for v in set(scenario.vehicles)}
    return np.stack([compiled[vehicle] for vehicle in scenario.vehicles])


def _moving(scenario: Scenario) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions [m] and velocities [m/s] of the moving obstacles at every sample, (T+1, M, 3)."""
    n_samples = scenario.max_steps + SAMPLES_AFTER_END + 1
    path_m = np.zeros((n_samples, len(scenario.moving_obstacles), 3))
    velocity_mps = np.zeros_like(path_m)
    if scenario.moving_obstacles:
        for k in range(n_samples):
            path_m[k] = scenario.moving_positions(k * scenario.dt_s)
            velocity_mps[k] = scenario.moving_velocities(k * scenario.dt_s)
    return path_m, velocity_mps


def _uas(scenario: Scenario) -> NDArray[np.void]:
    rows = []
    for entry, vehicle in zip(scenario.uas, scenario.vehicles, strict=True):
        limits = vehicle.limits
        rows.append(
            (
                entry.start_m,
                entry.radius_m,
                entry.dod_max,
                limits.v_xy_max_mps,
                limits.v_up_max_mps,
                limits.v_down_max_mps,
                dod_per_s(vehicle, entry.dod_max),  # the battery is nearly empty then
                sensors_of(scenario, entry),
            )
        )
    return np.array(rows, dtype=UAS_DTYPE)


def _rules(scenario: Scenario, radius_m: float, measured_m: float) -> NDArray[np.void]:
    rules = np.zeros(1, dtype=RULES_DTYPE)
    rules["dt_s"] = scenario.dt_s
    rules["max_steps"] = scenario.max_steps
    rules["landing_distance_m"] = scenario.landing_distance_m
    rules["landing_speed_mps"] = scenario.landing_speed_mps
    rules["uas_safe_distance_m"] = scenario.uas_safe_distance_m
    rules["fence_margin_m"] = scenario.geofence.margin_m
    rules["min_height_m"] = scenario.min_height_m
    rules["landing_zone_m"] = scenario.landing_zone_m
    rules["safe_distance_max_m"] = max(
        (o.safe_distance_m for o in (*scenario.obstacles, *scenario.moving_obstacles)), default=0.0
    )
    rules["measured_m"] = max(
        measured_m,
        radius_m + float(rules["safe_distance_max_m"][0]) + 2 * EPS_M,
        2 * radius_m + scenario.uas_safe_distance_m + 2 * EPS_M,
    )
    altitudes_m = -scenario.fence.vertices_m[:, 2]
    rules["floor_m"] = altitudes_m.min() + scenario.geofence.margin_m
    rules["ceiling_m"] = altitudes_m.max() - scenario.geofence.margin_m - ROUTE_MARGIN_M
    rules["brake"]["kind"] = CLIMB
    rules["lookahead_steps"] = np.ceil(LOOKAHEAD_S / scenario.dt_s)
    return rules


def _overfly_limit(target_altitudes_m: NDArray[np.float64], ceiling_m: float) -> float:
    """Roofs up to here are flown over: 15 m above the usual target, below the ceiling [m]."""
    return min(float(np.median(target_altitudes_m)) + 15.0, ceiling_m)


def _widened(hull: ConvexPolytope, distance_m: float) -> NDArray[np.float64]:
    """Corners of {p : D(p) ≤ distance_m}: what the paper's clearance makes of a hull.

    Args:
        hull: The hull.
        distance_m: [m].

    Returns:
        (V, 3) [m].
    """
    inside_m = hull.vertices_m.mean(axis=0)
    return corners_of(hull.normals, hull.offsets_m - distance_m, inside_m)


def _footprint(corners_m: NDArray[np.float64]) -> ConvexHull:
    # to the micrometre: corners that differ by rounding only would make sides of no length
    return ConvexHull(np.unique(corners_m[:, :2].round(6), axis=0))


def _obstacles(
    scenario: Scenario, radius_m: float, overfly_m: float, route_m: float
) -> tuple[
    NDArray[np.void],
    list[tuple[NDArray[np.float64], NDArray[np.float64]]],
    list[NDArray[np.float64]],
]:
    """The obstacles, the planes of their hulls and footprints, and the corners to turn at."""
    records = np.zeros(len(scenario.obstacles), dtype=OBSTACLE_DTYPE)
    ground_m = float(-scenario.fence.vertices_m[:, 2].max())
    planes = []
    corners = []
    first = 0
    for record, obstacle, hull, kept in zip(
        records, scenario.obstacles, scenario.hulls, scenario.kept_hulls, strict=True
    ):
        wall_m = radius_m + obstacle.safe_distance_m + route_m
        near_m = max(NEAR_M, wall_m + 2 * NODE_MARGIN_M)
        widened_m = _widened(kept, wall_m)
        footprint = _footprint(widened_m)
        sides = np.column_stack([footprint.equations[:, :2], np.zeros(len(footprint.equations))])
        planes.append((hull.normals, hull.offsets_m))
        planes.append((sides, footprint.equations[:, 2]))
        low_m, high_m = hull.vertices_m.min(axis=0), hull.vertices_m.max(axis=0)
        record["hull_middle_m"] = (low_m + high_m) / 2
        record["hull_half_m"] = (high_m - low_m) / 2 + EPS_M
        near = _widened(kept, near_m)
        record["first_face"] = first
        record["last_face"] = record["first_side"] = first + hull.n_faces
        first += hull.n_faces + len(sides)
        record["last_side"] = first
        record["first_kept"], record["last_kept"] = record["first_face"], record["last_face"]
        if kept is not hull:
            planes.append((kept.normals, kept.offsets_m))
            record["first_kept"] = first
            first += kept.n_faces
            record["last_kept"] = first
        record["safe_distance_m"] = obstacle.safe_distance_m
        record["near_m"] = near_m
        # the corners are rounded in the last digits: widen the box rather than miss a contact
        record["lower_m"] = near.min(axis=0) - EPS_M
        record["upper_m"] = near.max(axis=0) + EPS_M
        record["middle_m"] = (record["lower_m"] + record["upper_m"]) / 2
        record["per_half_m"] = 2 / (record["upper_m"] - record["lower_m"])
        record["rise_m"] = near_m - max(0.0, float(hull.signed_distance(record["middle_m"])))
        record["wall_m"] = wall_m
        record["roof_m"] = -widened_m[:, 2].min()
        record["tall"] = record["roof_m"] > overfly_m
        record["overhangs"] = overhangs(hull, ground_m)
        record["no_fly_zone"] = isinstance(obstacle, NoFlyZone)
        if record["tall"]:
            outline = _footprint(_widened(kept, wall_m + NODE_MARGIN_M))
            corners.append(outline.points[outline.vertices])
    return records, planes, corners


def _measure(obstacles: NDArray[np.void], scenario: Scenario, measured_m: float) -> None:
    """Note around each obstacle the box outside of which it is farther away than measured_m."""
    obstacles["measured_lower_m"], obstacles["measured_upper_m"] = -math.inf, math.inf
    if measured_m < math.inf:
        for record, hull in zip(obstacles, scenario.hulls, strict=True):
            widened_m = _widened(hull, measured_m)
            record["measured_lower_m"] = widened_m.min(axis=0) - EPS_M
            record["measured_upper_m"] = widened_m.max(axis=0) + EPS_M


def _free_nodes(
    scenario: Scenario,
    corners: list[NDArray[np.float64]],
    obstacles: NDArray[np.void],
    normals: NDArray[np.float64],
    offsets_m: NDArray[np.float64],
    target_altitudes_m: NDArray[np.float64],
) -> NDArray[np.float64]:
    """The corners that lie inside the fence and outside of all other tall obstacles."""
    nodes_m = np.concatenate([np.zeros((0, 2)), *corners])
    down_m = np.full((len(nodes_m), 1), -np.median(target_altitudes_m))
    inset_m = scenario.geofence.margin_m + NODE_MARGIN_M
    free = scenario.fence.signed_distance(np.hstack([nodes_m, down_m])) <= -inset_m
    for obstacle in obstacles[obstacles["tall"]]:
        sides = slice(obstacle["first_side"], obstacle["last_side"])
        free &= (nodes_m @ normals[sides, :2].T + offsets_m[sides]).max(axis=1) > 0.0
    return np.ascontiguousarray(nodes_m[free])

"""A scenario as arrays, for the kernels: what never changes during a mission."""

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import Memory, record_dtype
from uas_coverage_env.entities.commands import CLIMB, COMMAND_DTYPE
from uas_coverage_env.features.feature import FEATURE_DTYPE, MissionFeature, feature_tables
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import compile_vehicle
from uas_coverage_env.vehicle.governor import time_scale
from uas_coverage_env.vehicle.range import dod_per_s
from uas_coverage_env.vehicle.record import VEHICLE_DTYPE
from uas_coverage_env.vehicle.scale import braking_s, clock_reserve_s, length_scale
from uas_coverage_env.world.broad_phase import EPS_M, N_COLUMNS, obstacle_columns
from uas_coverage_env.world.corners import route_corners
from uas_coverage_env.world.events import EVENT_DTYPE, event_records, is_eventful
from uas_coverage_env.world.height import CRUISE_ALTITUDE_M
from uas_coverage_env.world.obstacles import (
    OBSTACLE_DTYPE,
    measure,
    obstacle_records,
    overfly_limit,
    route_margin_m,
)
from uas_coverage_env.world.packs import PACKS_DTYPE, pack_records
from uas_coverage_env.world.sensing import SENSING_DTYPE, sensing_records
from uas_coverage_env.world.tubes import route_tube_m, tubes_m
from uas_coverage_env.world.waypoints import (
    N_WAYPOINT_COLUMNS,
    WAYPOINT_DTYPE,
    again_steps,
    sensors_of,
    unit_m_of,
    waypoint_columns,
    waypoint_records,
)

_CLOCK_RESERVE_S = 30.0
"""Left of the mission when return mode has landed a UAS, of one that is not short [s]."""

SAMPLES_AFTER_END = 64
"""Moving obstacles are known this long after max_steps, for missions flown over time."""


UAS_DTYPE = record_dtype(
    [
        ("start_m", "f8", (3,)),
        # where it lands
        ("home_m", "f8", (3,)),
        ("radius_m", "f8"),
        # with which it lands at the latest, the reserve kept; and beyond which it is lost
        ("dod_max", "f8"),
        ("dod_empty", "f8"),
        # what guidance and return mode assume of the vehicle
        ("speed_mps", "f8"),
        ("climb_mps", "f8"),
        ("descent_mps", "f8"),
        ("dod_per_s", "f8"),
        # of the times of guidance, see `governor.time_scale`
        ("time_scale", "f8"),
        # bits, see `WAYPOINT_DTYPE`
        ("sensors", "i8"),
    ]
)

MOVING_DTYPE = record_dtype(
    [("radius_m", "f8"), ("half_height_m", "f8"), ("safe_distance_m", "f8")],
)

RULES_DTYPE = record_dtype(
    [
        ("dt_s", "f8"),
        ("max_steps", "i8"),
        ("landing_distance_m", "f8"),
        ("landing_speed_mps", "f8"),
        ("uas_safe_distance_m", "f8"),
        ("fence_margin_m", "f8"),
        # above ground and roofs, 0 without such a rule; and how far from its start and home a UAS
        # may be lower, horizontally
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
        # of the lengths of guidance and filter, see `vehicle.scale`; and what return mode leaves
        # of the clock
        ("length_scale", "f8"),
        ("clock_reserve_s", "f8"),
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
        # whether a wrench that leaves the vehicle's limits is paid for, and may lose the UAS
        ("judges_wrenches", "?"),
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
    again_steps: Annotated[NDArray[np.int64], "repeats"]
    """Steps from its covering until each waypoint is asked for again, 0 where that does not happen;
    of none where no waypoint is to be covered more than once."""
    rules: Annotated[NDArray[np.void], RULES_DTYPE, 1]
    nodes_m: Annotated[NDArray[np.float64], "N", 2]
    """[m] corners at which routes turn."""
    node_distance_m: Annotated[NDArray[np.float64], "W + U", "N"]
    """[m] way from a corner to a waypoint or a home; inf where there is none."""
    features: Annotated[NDArray[np.void], FEATURE_DTYPE, "features"]
    """As many in all missions of a pool."""
    feature_words: Annotated[NDArray[np.uint64], "feature words"]
    """Their records."""
    true_uas: Annotated[NDArray[np.int64], "true vehicles"]
    """The UAS with a record in `WorldState.true_vehicles`: all, or none."""
    events: Annotated[NDArray[np.void], EVENT_DTYPE, "E"]
    sensing: Annotated[NDArray[np.void], SENSING_DTYPE, "S"]
    """One for each UAS, or none where they are known as they are."""
    packs: Annotated[NDArray[np.void], PACKS_DTYPE, "B"]
    """One for each UAS, or none where none swaps packs while the others fly on."""
    tube_m: Annotated[NDArray[np.float64], "U", "predicted"]
    """See `tubes_m`: what is kept more for what disturbances do to what is predicted."""


ARENA = Memory(Arena)


def build_arena(
    scenario: Scenario,
    *,
    measured_m: float = math.inf,
    features: Sequence[MissionFeature | None] = (),
    judges_wrenches: bool = False,
) -> Arena:
    """The scenario as arrays.

    Obstacles that can be flown over without climbing far above the usual waypoint are low, the
    others are tall: routes go round them over the corners of their widened footprints. Lintels of
    doors are passed under where all targets, and what UAS cruise at, are low enough.

    Args:
        scenario: The scenario.
        measured_m: Clearances from obstacles and separations of UAS that are larger are taken as
            infinite [m]. What a contact or a breach depends on is measured in any case: with 0,
            only that, which takes a tenth less time.
        features: What the mission has of what few missions have. What the scenario says of it
            is left to the caller: planners build arenas, too.
        judges_wrenches: Whether a wrench that leaves the vehicle's limits is paid for, and may lose
            the UAS (`docs/rules.md`): for learners.
    """
    uas = _uas(scenario)
    radius_m = max(entry.radius_m for entry in scenario.uas)
    rules = _rules(scenario, radius_m, measured_m)
    waypoints = waypoint_records(scenario)
    rules["unit_m"] = unit_m_of(waypoints["position_m"])
    targets_m = np.concatenate([waypoints["position_m"], uas["home_m"]])
    overfly_m = overfly_limit(-targets_m[:, 2], float(rules["ceiling_m"][0]))
    feature_rows, feature_words = feature_tables(features, len(uas))
    rules["disturbed"] = any(feature is not None and feature.disturbs for feature in features)
    margin_m = route_margin_m(scenario)
    tube_m = tubes_m(
        scenario, int(rules["lookahead_steps"][0]), bool(rules["disturbed"][0]), margin_m
    )
    route_m = margin_m + route_tube_m(tube_m, margin_m)
    starts_m = uas["start_m"][:, 2]
    cruise_m = rules["floor_m"][0] + rules["length_scale"][0] * CRUISE_ALTITUDE_M
    highest_m = max(cruise_m, -min(targets_m[:, 2].min(), starts_m.min()))
    obstacles, planes = obstacle_records(scenario, radius_m, overfly_m, route_m, highest_m)
    measure(obstacles, scenario, float(rules["measured_m"][0]))
    fence = scenario.fence
    rules["fence_first"] = sum(len(rows[1]) for rows in planes)
    rules["fence_last"] = rules["fence_first"] + fence.n_faces
    planes.append((fence.normals, fence.offsets_m))
    normals = np.concatenate([rows[0] for rows in planes])
    offsets_m = np.concatenate([rows[1] for rows in planes])
    rules["overhangs"] = obstacles["overhangs"].any()
    rules["eventful"] = is_eventful(scenario)
    rules["asks"] = waypoints["asks"].any()
    rules["judges_wrenches"] = judges_wrenches
    corners = route_corners(scenario, obstacles, normals, offsets_m, targets_m)
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
        again_steps=again_steps(scenario),
        rules=rules,
        nodes_m=corners.nodes_m,
        node_distance_m=corners.distance_m,
        features=feature_rows,
        feature_words=feature_words,
        true_uas=np.arange(len(uas) if has_true_vehicles(scenario, features) else 0),
        events=event_records(scenario, features),
        sensing=sensing_records(scenario),
        packs=pack_records(scenario),
        tube_m=tube_m,
    )


def _vehicles(scenario: Scenario) -> NDArray[np.void]:
    compiled = {v: compile_vehicle(v, scenario.dt_s) for v in set(scenario.vehicles)}
    # zeros: equal vehicles are equal in the bytes between their fields, too
    records = np.zeros(len(scenario.vehicles), dtype=VEHICLE_DTYPE)
    for i, vehicle in enumerate(scenario.vehicles):
        records[i] = compiled[vehicle]
    records["follows_course"] = [uas.heading == "course" for uas in scenario.uas]
    if scenario.planar is not None:
        # no input acts on a height that is fixed
        records["holds_height"] = True
        records["lift_min_N"] = records["lift_max_N"] = 0.0
    return records


def has_true_vehicles(scenario: Scenario, features: Sequence[MissionFeature | None]) -> bool:
    """Whether vehicles may differ from their files, or batteries have a memory beside x."""
    perturbed = any(each is not None and each.perturbs for each in features)
    return perturbed or any(vehicle.battery.rc for vehicle in scenario.vehicles)


def _moving(scenario: Scenario) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions [m] and velocities [m/s] of the moving obstacles at every sample, (T+1, M, 3)."""
    n_samples = scenario.max_steps + SAMPLES_AFTER_END + 1
    time_s = scenario.dt_s * np.arange(n_samples, dtype=np.float64)
    return scenario.moving_positions(time_s), scenario.moving_velocities(time_s)


def _uas(scenario: Scenario) -> NDArray[np.void]:
    rows = []
    for entry, vehicle, dod_landed in zip(
        scenario.uas, scenario.vehicles, scenario.dod_landed, strict=True
    ):
        limits = vehicle.limits
        rows.append(
            (
                entry.start_m,
                entry.home_m,
                entry.radius_m,
                dod_landed,
                entry.dod_max,
                limits.v_xy_max_mps,
                limits.v_up_max_mps,
                limits.v_down_max_mps,
                dod_per_s(vehicle, entry.dod_max),  # the battery is nearly empty then
                time_scale(vehicle, scenario.dt_s),
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
    rules["ceiling_m"] = altitudes_m.max() - scenario.geofence.margin_m - route_margin_m(scenario)
    if scenario.planar is not None:
        rules["floor_m"] = rules["ceiling_m"] = scenario.planar.height_m
    rules["length_scale"] = length_scale(scenario.vehicles, scenario.dt_s)
    rules["clock_reserve_s"] = clock_reserve_s(_CLOCK_RESERVE_S, scenario.max_steps * scenario.dt_s)
    rules["brake"]["kind"] = CLIMB
    rules["lookahead_steps"] = lookahead_steps(scenario)
    return rules


def lookahead_steps(scenario: Scenario) -> int:
    """How far guidance and safety filter look ahead: until the slowest to stop has stopped."""
    return math.ceil(braking_s(scenario.vehicles, scenario.dt_s) / scenario.dt_s)

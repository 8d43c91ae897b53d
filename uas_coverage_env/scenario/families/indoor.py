"""Rooms and doors: offices along a corridor that are flown at one height, a person walks in it."""

from uas_coverage_env.scenario.families.family import Family
from uas_coverage_env.scenario.families.site import (
    DOD_MAX,
    Place_m,
    Rng,
    Size,
    mission,
    tag,
    upright,
)
from uas_coverage_env.scenario.fields import (
    Geofence,
    MovingObstacle,
    ScheduledVelocity,
    Uas,
    Waypoint,
)
from uas_coverage_env.scenario.model import Scenario
from uas_coverage_env.scenario.planar import Planar
from uas_coverage_env.scenario.walls import Door, Wall

_HEIGHT_M, _CEILING_M = 1.2, 2.5
_THICK_M, _DOOR_M, _LINTEL_M = 0.15, 0.9, 2.0
_DEEP_M, _WIDE_M, _CORRIDOR_M = (5.0, 7.0), (5.0, 7.5), (2.0, 2.6)
_ROOMS_PER_SIDE = (2, 3)
_FROM_WALL_M = 0.9
"""From a wall to the centres of waypoints and to starts."""
_FROM_JAMB_M = 1.2
_STARTS_IN_ROW = 4
_SAFE_M, _MARGIN_M = 0.1, 0.1
_WALKS_MPS, _TURNS_M = (0.6, 1.2), 1.5
_STEPS, _DT_S = 2000, 0.2


def indoor(rng: Rng, size: Size) -> Scenario:
    """Two rows of rooms, each with a door to the corridor between them."""
    n_uas, n_waypoints = size.draw(rng)
    n_rooms = int(rng.integers(_ROOMS_PER_SIDE[0], _ROOMS_PER_SIDE[1] + 1))
    deep_m, wide_m, corridor_m = (
        round(float(rng.uniform(*span_m)), 1) for span_m in (_DEEP_M, _WIDE_M, _CORRIDOR_M)
    )
    south_m = deep_m, round(deep_m + corridor_m, 1)
    north_m, east_m = round(2.0 * deep_m + corridor_m, 1), round(n_rooms * wide_m, 1)
    walls = []
    for row, at_m in enumerate(south_m):
        doors = [
            _door(wide_m * k + float(rng.uniform(_FROM_JAMB_M, wide_m - _FROM_JAMB_M)))
            for k in range(n_rooms)
        ]
        walls.append(_wall(f"corridor_{row + 1}", (at_m, 0.0), (at_m, east_m), doors))
        ends_m = ((0.0, deep_m), (south_m[1], north_m))[row]
        for k in range(1, n_rooms):
            name = f"between_{row + 1}_{k}"
            walls.append(_wall(name, (ends_m[0], k * wide_m), (ends_m[1], k * wide_m), []))
    rooms = [
        ((low_m, low_m + deep_m), (k * wide_m, (k + 1) * wide_m))
        for low_m in (0.0, south_m[1])
        for k in range(n_rooms)
    ]
    order = rng.permutation(len(rooms)).tolist()
    vehicles = rng.choice(list(size.vehicles), size=n_uas).tolist()
    starts = [_start(rooms[order[i % len(rooms)]], i // len(rooms)) for i in range(n_uas)]
    places = [_inside(rng, rooms[order[w % len(rooms)]]) for w in range(n_waypoints)]
    return mission(
        name=f"indoor-{tag(rng)}",
        dt_s=_DT_S,
        max_steps=_STEPS,
        landing_distance_m=0.3,
        landing_speed_mps=0.2,
        uas_safe_distance_m=0.3,
        planar=Planar(height_m=_HEIGHT_M),
        geofence=Geofence(
            margin_m=_MARGIN_M,
            vertices_m=upright(_corners(north_m, east_m), 0.0, _CEILING_M),
        ),
        walls=tuple(walls),
        moving_obstacles=(_person(rng, deep_m + 0.5 * corridor_m, east_m),),
        uas=tuple(
            Uas(
                name=f"uas_{i + 1}",
                vehicle=vehicles[i],
                start_m=(*starts[i], -_HEIGHT_M),
                soc_0=1.0,
                radius_m=0.07,
                dod_max=DOD_MAX,
            )
            for i in range(n_uas)
        ),
        waypoints=tuple(
            Waypoint(position_m=(*place_m, -_HEIGHT_M), radius_m=0.5, weight=1.0)
            for place_m in places
        ),
    )


FAMILIES = {
    "indoor": Family(
        indoor, Size(n_uas=(2, 3), n_waypoints=(8, 14), vehicles=("crazyflie",)), n_moving=1
    )
}


def _corners(north_m: float, east_m: float) -> list[Place_m]:
    return [(0.0, 0.0), (north_m, 0.0), (north_m, east_m), (0.0, east_m)]


def _door(at_m: float) -> Door:
    return Door(at_m=round(at_m, 2), width_m=_DOOR_M, height_m=_LINTEL_M)


def _wall(name: str, from_m: Place_m, to_m: Place_m, doors: list[Door]) -> Wall:
    return Wall(
        name=name,
        from_m=from_m,
        to_m=to_m,
        thickness_m=_THICK_M,
        height_m=_CEILING_M,
        safe_distance_m=_SAFE_M,
        doors=tuple(doors),
    )


def _inside(rng: Rng, room: tuple[Place_m, Place_m]) -> Place_m:
    """A place in a room."""
    north, east = (
        rng.uniform(low_m + _FROM_WALL_M, high_m - _FROM_WALL_M) for low_m, high_m in room
    )
    return round(float(north), 2), round(float(east), 2)


def _start(room: tuple[Place_m, Place_m], row: int) -> Place_m:
    """Where a UAS starts in a room: in its corner, and those that share it a metre apart."""
    north_m, east_m = divmod(row, _STARTS_IN_ROW)
    return (
        round(room[0][0] + _FROM_WALL_M + north_m, 2),
        round(room[1][0] + _FROM_WALL_M + east_m, 2),
    )


def _person(rng: Rng, north_m: float, east_m: float) -> MovingObstacle:
    """Walks from one end of the corridor to the other, and back."""
    speed_mps, way_m = round(float(rng.uniform(*_WALKS_MPS)), 2), east_m - 2.0 * _TURNS_M
    first_m, sign = float(rng.uniform(0.0, way_m)), 1.0 if rng.uniform() < 0.5 else -1.0
    pieces, at_s = [], 0.0
    left_m = way_m - first_m if sign > 0.0 else first_m
    while at_s < _STEPS * _DT_S:
        pieces.append(
            ScheduledVelocity(from_s=round(at_s, 2), velocity_mps=(0.0, sign * speed_mps, 0.0))
        )
        at_s, left_m, sign = at_s + left_m / speed_mps, way_m, -sign
    return MovingObstacle(
        name="person",
        kind="person",
        radius_m=0.25,
        height_m=1.8,
        safe_distance_m=0.3,
        start_m=(north_m, _TURNS_M + first_m, -0.9),
        schedule=tuple(pieces),
    )

"""Towns from a seed that can always be flown.

What is guaranteed, by construction and not by trying:

1. Every block is a box whose roof lies, with all distances, at least 4 m below the ceiling: above
   all roofs there is a free, connected layer.
2. Every start and the centre of every waypoint keeps all distances from every block and 1 m more,
   so its vertical line to that layer is free: up, across and down connects any two of them.
3. Between two blocks there is a street in which a UAS keeps all distances.
4. Starts are 20 m apart and outside the town.
5. A plan that flies back and forth leaves 15 % of every battery.

Only 5 can fail for a random draw; then the next draw has fuller batteries.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.scenario.families.family import FamilyOfSeeds
from uas_coverage_env.scenario.families.site import (
    CEILING_M,
    Between,
    Vertices_m,
    fence_around,
    fleet,
    mission,
    outline,
    strip_m,
    with_time,
)
from uas_coverage_env.scenario.fields import Obstacle, Waypoint
from uas_coverage_env.scenario.levels import DISTURBANCE_LEVELS, check_level, with_disturbances
from uas_coverage_env.scenario.model import Scenario
from uas_coverage_env.scenario.room import MOVING, SPARE, Room

N_UAS, N_WAYPOINTS, N_OBSTACLES = (1, 4), (20, 60), (5, 20)
"""The ranges of the benchmarks and of the leaderboard's sets."""

MIN_HEIGHT_M = 3.0
"""The least height of the benchmarks, of the family and of the leaderboard's sets [m]."""

_VEHICLE = "s500_v2"
_CLEARANCE_M = 0.36 + 3.0  # radius of the vehicle, and the safe distance from what stands
# Between a block and the next: two clearances and room to pass.
_STREET_M = 2.0 * _CLEARANCE_M + 6.0
_BLOCK_SIDE_M = (12.0, 40.0)
_LOW_ROOF_M = (6.0, 12.0)
_HIGH_ROOF_M = (20.0, 36.0)
_SHARE_OF_HIGH_BLOCKS = 0.3
# From the border of the area to the first block, and to the first waypoint.
_BLOCK_INSET_M = 15.0
_WAYPOINT_INSET_M = 20.0
_WAYPOINT_RADIUS_M = 15.0
_PITCH_M = 68.0
_SMALLEST_PITCH_M = 15.0
_JITTER = 0.12
_ALTITUDE_M = 14.0
_ABOVE_ROOF_M = 10.0
# The centres of waypoints are this much above the least height.
_ABOVE_LEAST_M = 1.0
# Roofs up to this height are covered from above; higher blocks from the street beside them.
_COVERED_ROOF_M = 22.0
_FIRST_START_M = 10.0
_LOWEST_SOC = 0.6
# The last attempts have full batteries and differ in their blocks alone.
_ATTEMPTS = 8
_ATTEMPTS_TO_FULL = 4
_LARGEST = {"n_uas": 128, "n_waypoints": 5000, "n_obstacles": 400}
_LARGEST_MIN_HEIGHT_M = 10.0  # there is as much room between the highest roof and the ceiling


class _Town(NamedTuple):
    """The area: starts in a strip in the west, blocks and waypoints east of it."""

    north_m: float
    west_m: float
    """Width of the strip."""
    east_m: float
    """Extent of the town east of it."""
    rows: int
    """Of the grid of waypoints, south to north."""
    columns: int


class _Block(NamedTuple):
    """A box on the ground: [north_0, north_1] x [east_0, east_1] x [0, height] [m]."""

    north_m: tuple[float, float]
    east_m: tuple[float, float]
    height_m: float

    def is_near(self, north_m: float, east_m: float, distance_m: float) -> bool:
        """Whether a place lies less than a distance beside the box, or in or over it."""
        return (
            self.north_m[0] - distance_m < north_m < self.north_m[1] + distance_m
            and self.east_m[0] - distance_m < east_m < self.east_m[1] + distance_m
        )


def generate_scenario(
    seed: int,
    n_uas: int = 2,
    n_waypoints: int = 25,
    n_obstacles: int = 6,
    size_m: float | None = None,
    *,
    min_height_m: float = 0.0,
    disturbances: str | None = None,
) -> Scenario:
    """A town that can always be flown; the same arguments give the same scenario.

    Args:
        seed: Not negative.
        n_uas: Number of UAS, all Holybro S500 V2.
        n_waypoints: Number of waypoints, radius 15 m.
        n_obstacles: Number of blocks.
        size_m: Side of the square area [m]; by default as large as the waypoints need at a pitch
            of 68 m, or the blocks at one per 55 m x 55 m.
        min_height_m: Least height above ground and roofs but for take-off and landing, at most 10
            [m]. The town is the same whatever it is; waypoints that are too low for it are lifted.
        disturbances: Level of wind and of wrong models, light, moderate or strong; None:
            still air and the vehicles as believed. The town is the same in all of them.

    Raises:
        ValueError: An argument is wrong, or no such scenario can be flown; the line names the
            argument and a fix.
    """
    _check_count("seed", seed, 0, 2**63 - 1)
    counts = {"n_uas": n_uas, "n_waypoints": n_waypoints, "n_obstacles": n_obstacles}
    for name, value in counts.items():
        _check_count(name, value, 0 if name == "n_obstacles" else 1, _LARGEST[name])
    if size_m is not None:
        _check_size(size_m)
    _check_height(min_height_m)
    check_level(disturbances)
    town = _town(n_uas, n_waypoints, n_obstacles, size_m)
    name = f"town-s{seed}-u{n_uas}-w{n_waypoints}-o{n_obstacles}"
    if size_m is not None:
        name += f"-{round(size_m)}m"
    if min_height_m:
        name += f"-h{round(100 * min_height_m)}cm"
    for attempt in range(_ATTEMPTS):
        rng = np.random.default_rng([seed, n_uas, n_waypoints, n_obstacles, attempt])
        fullness = min(1.0, attempt / _ATTEMPTS_TO_FULL)
        lowest_soc = _LOWEST_SOC + (1.0 - _LOWEST_SOC) * fullness
        blocks = _blocks(rng, town, n_obstacles)
        charges = rng.uniform(lowest_soc, 1.0, size=n_uas).round(2).tolist()
        draft = mission(
            name=name,
            min_height_m=float(min_height_m),
            geofence=fence_around(
                _box((0.0, town.north_m), (0.0, town.west_m + town.east_m), CEILING_M)
            ),
            obstacles=tuple(_obstacles(blocks)),
            uas=fleet([_VEHICLE] * n_uas, charges, town.north_m, _FIRST_START_M),
            waypoints=tuple(_waypoints(rng, town, blocks, n_waypoints, min_height_m)),
        )
        if (flown := with_time(draft)) is not None:
            return with_disturbances(flown, disturbances, seed)
    raise ValueError(
        f"n_waypoints is {n_waypoints}, more than the batteries of n_uas = {n_uas} can cover"
        f"{'' if size_m is None else f' in size_m = {size_m:g}'}; take more UAS, fewer waypoints"
        f"{'' if size_m is None else ' or a smaller area'}"
    )


def sample_scenario(
    seed: int,
    n_uas: Between = N_UAS,
    n_waypoints: Between = N_WAYPOINTS,
    n_obstacles: Between = N_OBSTACLES,
    min_height_m: float = MIN_HEIGHT_M,
    disturbances: str | None = None,
) -> Scenario:
    """The town of a seed, from 0 on, which draws the counts; the rest as of `GeneratedScenarios`.

    Raises:
        ValueError: See there and `generate_scenario`.
    """
    ranges = n_uas, n_waypoints, n_obstacles
    return GeneratedScenarios(*ranges, min_height_m, disturbances).of_seed(seed)


@dataclass(frozen=True)
class GeneratedScenarios(FamilyOfSeeds):
    """A family of towns: an environment's `scenario=` that draws one at each reset.

    Called with a generator of random numbers it draws a seed. The seeds are above those of the
    leaderboard's sets, which nothing should be trained on.

    Attributes:
        n_uas: Least and most.
        n_waypoints: Least and most.
        n_obstacles: Least and most.
        min_height_m: See `generate_scenario`.
        disturbances: Likewise; turbulence, gusts and vehicles are drawn in every mission.

    Raises:
        ValueError: A range is not two whole numbers, the least first, or there is no such level.
    """

    n_uas: Between = N_UAS
    n_waypoints: Between = N_WAYPOINTS
    n_obstacles: Between = N_OBSTACLES
    min_height_m: float = MIN_HEIGHT_M
    disturbances: str | None = None

    def __post_init__(self) -> None:
        check_level(self.disturbances)
        for name in _LARGEST:
            given = getattr(self, name)
            pair = isinstance(given, tuple | list) and len(given) == 2
            if not pair or not all(type(count) is int for count in given) or given[0] > given[1]:
                raise ValueError(f"{name} is {given!r}; give least and most, as in (2, 4)")
            object.__setattr__(self, name, tuple(given))

    @property
    def room(self) -> Room:
        """The most that a mission may have."""
        return Room(self.n_uas[1], SPARE * self.n_waypoints[1], MOVING)

    def of_seed(self, seed: int) -> Scenario:
        """The scenario of a seed, which draws the counts too."""
        rng = np.random.default_rng([seed, *self.n_waypoints, *self.n_obstacles])
        counts = {
            name: int(rng.integers(least, most + 1))
            for name, (least, most) in ((name, getattr(self, name)) for name in _LARGEST)
        }
        settings = {"min_height_m": self.min_height_m, "disturbances": self.disturbances}
        return generate_scenario(seed, **counts, **settings)


_TOWNS = GeneratedScenarios()

FAMILIES = {
    "generated": _TOWNS,
    "town": _TOWNS,  # as generated scenarios are named
    **{f"generated-{level}": replace(_TOWNS, disturbances=level) for level in DISTURBANCE_LEVELS},
}


def _check_count(name: str, value: Any, least: int, most: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise ValueError(f"{name} is {value!r}; it should be a whole number")
    if not least <= value <= most:
        raise ValueError(f"{name} is {value}; it should be between {least} and {most}")


def _check_size(size_m: Any) -> None:
    number = isinstance(size_m, int | float | np.integer | np.floating)
    if isinstance(size_m, bool) or not number or not math.isfinite(size_m):
        raise ValueError(f"size_m is {size_m!r}; it should be a length in metres, or None")
    if not 0.0 < size_m <= 10_000.0:
        raise ValueError(f"size_m is {size_m:g}; it should be above 0 and at most 10000")


def _check_height(min_height_m: Any) -> None:
    number = isinstance(min_height_m, int | float | np.integer | np.floating)
    if isinstance(min_height_m, bool) or not number:
        raise ValueError(f"min_height_m is {min_height_m!r}; it should be a height in metres")
    if not 0.0 <= min_height_m <= _LARGEST_MIN_HEIGHT_M:
        raise ValueError(
            f"min_height_m is {min_height_m:g}; it should be between 0 and "
            f"{_LARGEST_MIN_HEIGHT_M:g}"
        )


def _town(n_uas: int, n_waypoints: int, n_obstacles: int, size_m: float | None) -> _Town:
    """Lay out the area, or say which argument does not fit into it."""
    if size_m is None:
        rows = math.ceil(math.sqrt(n_waypoints))
        columns = math.ceil(n_waypoints / rows)
        pitch_m = max(_PITCH_M, math.sqrt(n_obstacles / n_waypoints) * 55.0)
        north_m = rows * pitch_m + 2.0 * _WAYPOINT_INSET_M
        west_m = strip_m(n_uas, north_m, _FIRST_START_M)
        east_m = columns * pitch_m + 2.0 * _WAYPOINT_INSET_M
        return _Town(north_m, west_m, east_m, rows, columns)
    north_m = float(size_m)
    west_m = strip_m(n_uas, north_m, _FIRST_START_M)
    east_m = north_m - west_m
    inner_north_m, inner_east_m = (
        north_m - 2.0 * _WAYPOINT_INSET_M,
        east_m - 2.0 * _WAYPOINT_INSET_M,
    )
    if min(inner_north_m, inner_east_m) < _SMALLEST_PITCH_M:
        least_m = 2.0 * _WAYPOINT_INSET_M + _SMALLEST_PITCH_M + west_m
        raise ValueError(
            f"size_m is {size_m:g}, too small for n_uas = {n_uas}; take at least {least_m:.0f}"
        )
    rows = math.ceil(math.sqrt(n_waypoints * inner_north_m / inner_east_m))
    columns = math.ceil(n_waypoints / rows)
    if min(inner_north_m / rows, inner_east_m / columns) < _SMALLEST_PITCH_M:
        raise ValueError(
            f"n_waypoints is {n_waypoints}, too many for size_m = {size_m:g}; take fewer, or a "
            f"larger area"
        )
    return _Town(north_m, west_m, east_m, rows, columns)


def _box(north_m: tuple[float, float], east_m: tuple[float, float], height_m: float) -> Vertices_m:
    return tuple((*corner, z) for z in (0.0, -height_m) for corner in outline(north_m, east_m))


def _blocks(rng: np.random.Generator, town: _Town, n_obstacles: int) -> list[_Block]:
    """Blocks in randomly chosen lots of a grid; half a street is left on each side of a lot."""
    if not n_obstacles:
        return []
    extent_m = np.array([town.north_m, town.east_m]) - 2.0 * _BLOCK_INSET_M
    lots = _lots(extent_m, n_obstacles)
    lot_m = extent_m / lots
    if lot_m.min() < _BLOCK_SIDE_M[0] + _STREET_M:
        raise ValueError(
            f"n_obstacles is {n_obstacles}, too many for an area of "
            f"{town.north_m:.0f} m x {town.east_m:.0f} m; take fewer, or a larger size_m"
        )
    origin_m = np.array([_BLOCK_INSET_M, town.west_m + _BLOCK_INSET_M])
    blocks = []
    for lot in np.sort(rng.choice(lots[0] * lots[1], size=n_obstacles, replace=False)):
        place_m = origin_m + lot_m * np.divmod(lot, lots[1])
        room_m = lot_m - _STREET_M
        side_m = rng.uniform(_BLOCK_SIDE_M[0], np.minimum(room_m, _BLOCK_SIDE_M[1]))
        corner_m = place_m + 0.5 * _STREET_M + rng.uniform(0.0, 1.0, size=2) * (room_m - side_m)
        high = rng.uniform() < _SHARE_OF_HIGH_BLOCKS
        low = [round(float(value), 1) for value in corner_m]
        opposite = [round(float(value), 1) for value in corner_m + side_m]
        height_m = round(float(rng.uniform(*(_HIGH_ROOF_M if high else _LOW_ROOF_M))), 1)
        blocks.append(_Block((low[0], opposite[0]), (low[1], opposite[1]), height_m))
    return blocks


def _lots(extent_m: NDArray[np.float64], n_obstacles: int) -> NDArray[np.int_]:
    """Rows and columns of the grid whose lots are as square as can be, and not above 60 m."""
    rows = np.arange(1, n_obstacles + 1)
    columns = -(-n_obstacles // rows)
    best = int(np.argmax(np.minimum(extent_m[0] / rows, extent_m[1] / columns)))
    return np.maximum([rows[best], columns[best]], (extent_m // 60.0).astype(int))


def _obstacles(blocks: list[_Block]) -> list[Obstacle]:
    return [
        Obstacle(
            name=f"block_{index + 1}",
            kind="residential" if block.height_m <= _COVERED_ROOF_M else "high_rise",
            safe_distance_m=3.0,
            vertices_m=_box(block.north_m, block.east_m, block.height_m),
        )
        for index, block in enumerate(blocks)
    ]


def _waypoints(
    rng: np.random.Generator,
    town: _Town,
    blocks: list[_Block],
    n_waypoints: int,
    min_height_m: float,
) -> list[Waypoint]:
    """A jittered grid, lifted above low roofs and moved from high blocks into the street."""
    rows_m = (town.north_m - 2.0 * _WAYPOINT_INSET_M) / town.rows
    columns_m = (town.east_m - 2.0 * _WAYPOINT_INSET_M) / town.columns
    jitter = rng.uniform(0.5 - _JITTER, 0.5 + _JITTER, size=(n_waypoints, 2))
    waypoints = []
    for index in range(n_waypoints):
        row, column = divmod(index, town.columns)
        north_m = _WAYPOINT_INSET_M + rows_m * (row + jitter[index, 0])
        east_m = town.west_m + _WAYPOINT_INSET_M + columns_m * (column + jitter[index, 1])
        waypoints.append(_waypoint(north_m, east_m, blocks, min_height_m + _ABOVE_LEAST_M))
    return waypoints


def _waypoint(north_m: float, east_m: float, blocks: list[_Block], lowest_m: float) -> Waypoint:
    """A waypoint at a place or beside it, no lower than lowest_m above ground and roof."""
    altitude_m, kind = max(_ALTITUDE_M, lowest_m), "field"
    # streets are wide: no place is this near two blocks
    near = [block for block in blocks if block.is_near(north_m, east_m, _CLEARANCE_M + 1.0)]
    if near and near[0].height_m <= _COVERED_ROOF_M:
        above_m = max(_ABOVE_ROOF_M, lowest_m)
        altitude_m, kind = max(_ALTITUDE_M, near[0].height_m + above_m), "residential"
    elif near:
        beside_m = _CLEARANCE_M + 1.5
        block = near[0]
        places = [
            (block.north_m[0] - beside_m, east_m),
            (block.north_m[1] + beside_m, east_m),
            (north_m, block.east_m[0] - beside_m),
            (north_m, block.east_m[1] + beside_m),
        ]
        here = (north_m, east_m)
        north_m, east_m = min(places, key=lambda place: math.dist(place, here))
    return Waypoint(
        kind=kind,
        position_m=(round(float(north_m), 1), round(float(east_m), 1), -round(altitude_m, 1)),
        radius_m=_WAYPOINT_RADIUS_M,
        weight=1.0 if kind == "field" else 2.0,
    )

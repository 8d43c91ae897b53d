"""The waypoints of a mission: from which its areas are seen, above ground and roofs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import shapely
from shapely.geometry import Point

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.area_options import AreaOptions
from uas_coverage_env.operations.area_import.camera_geometry import CameraView
from uas_coverage_env.operations.area_import.relief import Relief
from uas_coverage_env.operations.area_import.site import (
    FENCE_MARGIN_M,
    LARGEST_UAS_M,
    Area,
    MissionSite,
    Wall,
)
from uas_coverage_env.operations.area_import.waypoint_layout import MOST_WAYPOINTS, lay_waypoints

KEEP_M = LARGEST_UAS_M + 1.0
"""Between a waypoint and what no UAS may come nearer to, beyond safe distances."""

_LIFT_M = 3.5
_ABOVE_LEAST_M = 0.5


class Requirements(NamedTuple):
    """What is asked of waypoints.

    Attributes:
        radius_m: Of their spheres [m].
        max_speed_mps: At which they are covered; None: at any [m/s].
        min_height_m: Least height of UAS above ground and roofs [m].
        camera: Whether they ask for their camera in any case.
        again_after_s: Times after which they are asked for again, where an area does not say [s].
    """

    radius_m: float
    max_speed_mps: float | None
    min_height_m: float
    camera: bool
    again_after_s: tuple[float, ...] = ()


@dataclass
class Waypoints:
    """The waypoints of a mission.

    Attributes:
        tables: The tables `[[waypoints]]` of each camera.
        above_m: Of each area, how high they are above the lowest ground that they see [m].
        left_out_m2: Area that is seen from no place which a UAS may take [m²].
        too_high: How many lie higher than asked, because the ground is below the take-off places.
    """

    tables: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    above_m: list[list[float]] = field(default_factory=list)
    left_out_m2: float = 0.0
    too_high: int = 0

    def all(self) -> list[dict[str, Any]]:
        """The tables of all cameras."""
        return [table for tables in self.tables.values() for table in tables]


def make_waypoints(
    site: MissionSite,
    relief: Relief,
    walls: Sequence[Wall],
    seen: Sequence[tuple[Area, CameraView]],
    ceiling_m: float,
    asked: Requirements,
) -> Waypoints:
    """Waypoints from which all areas are seen.

    Args:
        site: The site.
        relief: Its ground.
        walls: What stands on it, and the ground that rises.
        seen: The areas, and how each is looked at.
        ceiling_m: Top of the fence [m].
        asked: What is asked of waypoints.

    Raises:
        InputError: There is no place for them, or there are too many.
    """
    placed = _Placed(site, relief, walls, ceiling_m, asked)
    found = Waypoints()
    for number, (area, view) in enumerate(seen):
        layout = lay_waypoints(area.shape, view.pitch_m, placed.allowed, f"area {number + 1}")
        found.left_out_m2 += layout.left_out_m2
        found.above_m.append([])
        for place_m in layout.places_m:
            height_m, above_m, too_high = placed.height_m(place_m, view)
            found.too_high += too_high
            found.above_m[-1].append(above_m)
            position_m = (*place_m[::-1], -height_m)
            found.tables.setdefault(view.name, []).append(
                {
                    "kind": "search",
                    "position_m": [round(value, 3) for value in position_m],
                    "radius_m": asked.radius_m,
                    "weight": area.weight,
                    **_demand(view, area.options, asked),
                }
            )
    count = sum(map(len, found.tables.values()))
    if count > MOST_WAYPOINTS:
        raise InputError(
            f"the areas need {count} waypoints, more than {MOST_WAYPOINTS}; fly higher "
            f"(--height), or divide them into missions"
        )
    if not count:
        raise InputError("nothing of the areas is seen from any place that a UAS may take")
    return found


class _Placed:
    """Where waypoints may be, and how high; arguments as of `make_waypoints`."""

    def __init__(
        self,
        site: MissionSite,
        relief: Relief,
        walls: Sequence[Wall],
        ceiling_m: float,
        asked: Requirements,
    ) -> None:
        top_m = ceiling_m - FENCE_MARGIN_M
        kept = [(wall, wall.footprint.buffer(wall.safe_distance_m + KEEP_M)) for wall in walls]
        high = [around for wall, around in kept if _over_m(wall, asked) > top_m]
        low = [(wall, around) for wall, around in kept if _over_m(wall, asked) <= top_m]
        room = site.fence.buffer(-(FENCE_MARGIN_M + KEEP_M))
        self.allowed = room.difference(shapely.union_all(high))
        if self.allowed.is_empty:
            raise InputError("no waypoint has room in the fence; enlarge the fence")
        self._over_m = [_over_m(wall, asked) for wall, _ in low]
        self._roofs = shapely.STRtree([around for _, around in low])
        self._relief, self._ceiling_m, self._asked = relief, ceiling_m, asked

    def height_m(self, place_m: tuple[float, float], view: CameraView) -> tuple[float, float, bool]:
        """Height of a waypoint, that above the lowest ground it sees [m]; more than is asked?"""
        uneven = self._relief.ground is not None
        low_m, high_m = self._relief.range_m(*_seen_from(*place_m, view))
        asked_m = view.height_m + high_m
        least_m = self._asked.radius_m + _LIFT_M if uneven else 0.0
        under = self._roofs.query(Point(place_m), "intersects")
        height_m = max(asked_m, least_m, *(self._over_m[k] for k in under))
        if uneven and height_m > self._ceiling_m - FENCE_MARGIN_M - KEEP_M:
            raise InputError(
                f"--ceiling {self._ceiling_m:g}: the ground asks for a waypoint {height_m:.0f} m "
                f"above the take-off places; raise it, or leave it out"
            )
        return height_m, height_m - low_m, asked_m < least_m


def _over_m(wall: Wall, asked: Requirements) -> float:
    """Where a waypoint may lie above a roof [m]."""
    least_m = asked.min_height_m + _ABOVE_LEAST_M if asked.min_height_m else 0.0
    return wall.top_m + max(wall.safe_distance_m, least_m) + KEEP_M


def _seen_from(east_m: float, north_m: float, view: CameraView) -> Iterator[float]:
    """West, south, east, north of the ground that is to be seen from a place [m]."""
    halves = [0.5 * pitch_m for pitch_m in view.pitch_m]
    for sign in (-1.0, 1.0):
        yield east_m + sign * halves[0]
        yield north_m + sign * halves[1]


def _demand(view: CameraView, options: AreaOptions, asked: Requirements) -> dict[str, Any]:
    """What a waypoint asks for."""
    speed_mps = asked.max_speed_mps if options.speed_mps is None else options.speed_mps
    again_s = asked.again_after_s if options.again_after_s is None else options.again_after_s
    camera = asked.camera or speed_mps is not None or options.pixel_cm is not None
    return {
        **({"sensor": view.name} if camera else {}),
        **({"max_speed_mps": speed_mps} if speed_mps is not None else {}),
        **({"again_after_s": list(again_s)} if again_s else {}),
    }

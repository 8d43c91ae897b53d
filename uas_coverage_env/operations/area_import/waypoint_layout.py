"""Waypoints laid so that an area is seen: a grid of cells, and a place from which each is seen.

Where a cell lies under something high or partly outside the area, its waypoint is moved, its cell
divided, and only what cannot be seen from any allowed place is left out and said to be.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import nearest_points

from uas_coverage_env.files.errors import InputError

MOST_WAYPOINTS = 2_000
_DIVISIONS = 3
_SLIVER_M2 = 1e-3
_TOLERANCE_M = 1e-6


@dataclass
class Layout:
    """Where to look from.

    Attributes:
        places_m: East and north of each waypoint [m].
        left_out_m2: Area that is seen from no allowed place [m²].
    """

    places_m: list[tuple[float, float]]
    left_out_m2: float = 0.0


def lay_waypoints(
    area: BaseGeometry, pitch_m: tuple[float, float], allowed: BaseGeometry, label: str
) -> Layout:
    """Places from which all of an area is seen.

    Args:
        area: One or more polygons (x east, y north) [m].
        pitch_m: Size of the ground that a waypoint sees for sure, east and north [m].
        allowed: Where waypoints may be [m].
        label: What the area is called, for messages.

    Raises:
        InputError: There would be more than `MOST_WAYPOINTS`.
    """
    layout = Layout([])
    shapely.prepare(allowed)
    for part in shapely.get_parts(area):
        if isinstance(part, Polygon) and part.area > _SLIVER_M2:
            for cell in _cells(part, pitch_m, label):
                _cover_cell(part, cell, pitch_m, allowed, _DIVISIONS, layout)
    return layout


def _cells(part: Polygon, pitch_m: tuple[float, float], label: str) -> Iterator[Polygon]:
    """The cells of a grid that meet a polygon; it is centred, its pitch at most the given one."""
    west, south, east, north = part.bounds
    columns, rows = (
        max(1, int(np.ceil(span / pitch - 1e-9)))
        for span, pitch in zip((east - west, north - south), pitch_m, strict=True)
    )
    least = part.area / (pitch_m[0] * pitch_m[1])
    if least > MOST_WAYPOINTS or columns * rows > 20 * MOST_WAYPOINTS:
        raise InputError(
            f"{label} needs about {max(least, 1):.0f} waypoints, more than {MOST_WAYPOINTS}; fly "
            f"higher (--height), or divide the area into missions"
        )
    x, y = np.linspace(west, east, columns + 1), np.linspace(south, north, rows + 1)
    x0, y0 = (corner.ravel() for corner in np.meshgrid(x[:-1], y[:-1]))
    x1, y1 = (corner.ravel() for corner in np.meshgrid(x[1:], y[1:]))
    cells: NDArray[np.object_] = shapely.box(x0, y0, x1, y1)
    shapely.prepare(part)
    yield from cells[shapely.intersects(part, cells)]


def _cover_cell(
    area: Polygon,
    cell: Polygon,
    pitch_m: tuple[float, float],
    allowed: BaseGeometry,
    divisions: int,
    layout: Layout,
) -> None:
    """Add the waypoint that sees what a cell holds of an area, or those of its quarters."""
    part = cell if area.contains(cell) else shapely.clip_by_rect(area, *cell.bounds)
    if part.area <= _SLIVER_M2:
        return
    west, south, east, north = part.bounds
    centre = Point(0.5 * (west + east), 0.5 * (south + north))
    place = centre if allowed.contains(centre) else nearest_points(allowed, centre)[0]
    x, y = place.x, place.y
    is_seen = (
        max(east - x, x - west) <= 0.5 * pitch_m[0] + _TOLERANCE_M
        and max(north - y, y - south) <= 0.5 * pitch_m[1] + _TOLERANCE_M
    )
    if place is centre or is_seen:
        layout.places_m.append((x, y))
    elif divisions:
        for quarter in _quarters(west, south, east, north):
            _cover_cell(area, quarter, pitch_m, allowed, divisions - 1, layout)
    else:
        layout.left_out_m2 += part.area


def _quarters(west: float, south: float, east: float, north: float) -> Iterator[Polygon]:
    x, y = 0.5 * (west + east), 0.5 * (south + north)
    for x0, x1 in ((west, x), (x, east)):
        for y0, y1 in ((south, y), (y, north)):
            yield shapely.box(x0, y0, x1, y1)

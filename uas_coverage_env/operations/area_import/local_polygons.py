"""Drawn polygons in local metres, checked. As libraries of maps have it, x is east, y is north."""

import re

import numpy as np
import shapely
from shapely.geometry import Polygon

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.drawn_areas import Drawn, DrawnPolygon, TakeOff
from uas_coverage_env.operations.geodesy import LocalFrame

FURTHEST_M = 20_000.0
"""From the middle of what was drawn; no multicopter flies there and back."""

_SMALLEST_M2, _NARROWEST_M = 1.0, 0.2
_PLACE = re.compile(r"\[(-?[\d.e+-]+) (-?[\d.e+-]+)\]")


def frame_around(things: list[Drawn]) -> LocalFrame:
    """The frame about the middle of the areas to search.

    Args:
        things: What was drawn; at least one polygon with the role `search`.
    """
    corners = [t.outer for t in things if isinstance(t, DrawnPolygon) and t.role == "search"]
    return LocalFrame.around(*np.concatenate(corners).T)


def local_polygon(frame: LocalFrame, drawn: DrawnPolygon) -> Polygon:
    """A drawn polygon in metres.

    Raises:
        InputError: It crosses itself, has no area, or lies far away.
    """
    rings = [_local(frame, drawn.source, ring) for ring in (drawn.outer, *drawn.holes)]
    polygon = Polygon(rings[0], rings[1:])
    if not polygon.is_valid:
        reason = str(shapely.is_valid_reason(polygon))
        found = _PLACE.search(reason)
        at = ""
        if found:
            latitude, longitude, _ = frame.to_geodetic([float(found[2]), float(found[1]), 0.0])
            at = f" at {latitude:.6f}, {longitude:.6f}"
        what = reason.partition("[")[0].lower()
        raise InputError(f"{drawn.source} is no simple polygon ({what}{at}); redraw it there")
    # corners on a line of the map are on none of the ground, by millimetres
    if polygon.area < _SMALLEST_M2 or polygon.buffer(-_NARROWEST_M / 2.0).is_empty:
        raise InputError(f"{drawn.source} has no area; draw at least three corners in no line")
    return polygon


def local_place(frame: LocalFrame, place: TakeOff) -> tuple[float, float]:
    """East and north [m] of a take-off place.

    Raises:
        InputError: It lies far away.
    """
    east_north = _local(frame, place.source, np.array([[place.latitude_deg, place.longitude_deg]]))
    return float(east_north[0, 0]), float(east_north[0, 1])


def _local(frame: LocalFrame, source: str, places: np.ndarray) -> np.ndarray:
    east_north = frame.to_ned(places[:, 0], places[:, 1])[:, 1::-1]
    away_m = np.hypot(*east_north.T).max()
    if away_m > FURTHEST_M:
        raise InputError(
            f"{source} reaches {away_m / 1000.0:.0f} km from the middle of the areas, further than "
            f"{FURTHEST_M / 1000.0:.0f} km; draw smaller areas, or exchange latitude and longitude "
            f"where they are swapped"
        )
    return east_north

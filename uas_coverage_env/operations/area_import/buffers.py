"""Outlines in degrees of what is drawn as a point or a line: circles and strips."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from uas_coverage_env.operations.convex import polygons_of
from uas_coverage_env.operations.geodesy import LocalFrame

_QUARTER = 8  # corners of a quarter of a circle
_CORNERS = 4 * _QUARTER

Rings = list[NDArray[np.float64]]


def circle(place: NDArray[np.float64], radius_m: float, *, around: bool) -> Rings:
    """The rings of a polygon in a circle, or around it: (N, 2) latitude and longitude [degrees].

    Args:
        place: Latitude and longitude of its middle [degrees].
        radius_m: [m].
        around: Whether it holds the circle; otherwise the circle holds it.
    """
    if around:
        radius_m /= np.cos(np.pi / _CORNERS)
    frame = LocalFrame.around(place[:1], place[1:])
    north, east, _ = frame.to_ned(*place)
    (rings,) = _in_degrees(frame, Point(east, north).buffer(radius_m, quad_segs=_QUARTER))
    return rings


def strip(places: NDArray[np.float64], half_width_m: float, *, beyond: bool) -> list[Rings]:
    """The rings of the polygons of a strip along a line [degrees].

    Args:
        places: (N, 2) latitude and longitude of the line [degrees].
        half_width_m: [m].
        beyond: Whether it reaches beyond the line's ends by as much.
    """
    frame = LocalFrame.around(places[:, 0], places[:, 1])
    line = LineString(frame.to_ned(places[:, 0], places[:, 1])[:, 1::-1])
    ends = "square" if beyond else "flat"
    return _in_degrees(frame, line.buffer(half_width_m, cap_style=ends, join_style="mitre"))


def _in_degrees(frame: LocalFrame, shape: BaseGeometry) -> list[Rings]:
    return [
        [_ring(frame, part), *(_ring(frame, Polygon(hole)) for hole in part.interiors)]
        for part in polygons_of(shape)
    ]


def _ring(frame: LocalFrame, polygon: Polygon) -> NDArray[np.float64]:
    corners: Sequence[tuple[float, ...]] = list(polygon.exterior.coords)
    ned = np.array([[north, east, 0.0] for east, north, *_ in corners])
    return frame.to_geodetic(ned)[:, :2]

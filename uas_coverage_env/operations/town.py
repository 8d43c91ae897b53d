"""What stands in a town and where its streets are, from OpenStreetMap: GeoJSON, .osm, .osm.pbf."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, MultiPoint, Polygon
from shapely.geometry.base import BaseGeometry

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.convex import hull_of, polygons_of, without_holes
from uas_coverage_env.operations.frame import LocalFrame
from uas_coverage_env.operations.geojson import features, read_json
from uas_coverage_env.operations.prisms import Standing
from uas_coverage_env.operations.reading import or_example
from uas_coverage_env.operations.tags import (
    FOREST,
    STREETS_M,
    Tagged,
    height_m,
    standing_of,
)

_OSM = (".osm", ".pbf")
_OSM_CREDIT = (
    "© OpenStreetMap contributors, https://www.openstreetmap.org/copyright; Open Database License "
    "(ODbL) 1.0"
)
_SMALLEST_M2 = 4.0
_DETAIL_M = 1.0
"""So far corners of woods and streets may be off; what a wood becomes holds more ground anyway."""

_AROUND_M = 10.0


@dataclass
class Town:
    """What is known of the surroundings of an area.

    Attributes:
        standing: What stands in the area, as buildings and power lines.
        streets: Where streets are (x east, y north) [m].
        incomplete: Outlines in the area of which the file lacks corners.
        unread: Tags of height or levels that cannot be read, and how often.
        credit: Attribution and licence of the data.
    """

    standing: list[Standing] = field(default_factory=list)
    streets: list[Polygon] = field(default_factory=list)
    incomplete: int = 0
    unread: Counter[str] = field(default_factory=Counter)
    credit: str = ""


def read_town(path: Path, frame: LocalFrame, area: Polygon) -> Town:
    """What stands in an area, and its streets.

    Args:
        path: A file of OpenStreetMap (.osm, .osm.pbf), GeoJSON with its tags as properties (or in
            a property `tags`), or the name of a shipped example (`karhula`).
        frame: The local metres.
        area: In these, x east, y north.

    Raises:
        InputError: The file cannot be used, or no building is anywhere near.
    """
    path = or_example(path, "_buildings.geojson")
    found, credit = _read(path)
    town, nearest_m = Town(credit=credit), np.inf
    for number, (kind, corners, tags) in enumerate(_shapes(found)):
        street_m = STREETS_M.get(str(tags.get("highway")))
        what = standing_of(tags)
        if what is None and (street_m is None or kind != "LineString"):
            continue
        places = _local(path, number, frame, corners)
        if places is None:
            continue
        if what is None:
            town.streets += _street(places, street_m or 0.0, area)
            continue
        if kind == "LineString" and not what.half_width_m:
            town.incomplete += MultiPoint(places).intersects(area)
            continue
        ground = _ground(kind, places, what)
        nearest_m = min(nearest_m, shapely.distance(ground, area))
        parts = [p for p in polygons_of(ground) if p.area > _SMALLEST_M2 and p.intersects(area)]
        if parts:
            top_m, known = height_m(tags, what.guessed_m, town.unread)
            for part in parts:
                near = _near(part, area) if what.kind == FOREST else [part]
                town.standing += [Standing(what.kind, one, top_m, known) for one in near]
    if nearest_m == np.inf:
        raise InputError(f"{path}: holds no building; export polygons with the tag `building`")
    if nearest_m > 10_000.0:
        raise InputError(
            f"{path}: the nearest building is {nearest_m / 1000.0:.0f} km from the area; take the "
            f"buildings of this place, or exchange latitude and longitude where they are swapped"
        )
    return town


def _read(path: Path) -> tuple[list[dict[str, Any]], str]:
    """Features with tags, and the attribution of the data."""
    if path.suffix.lower() in _OSM:
        # a library that nothing else needs
        from uas_coverage_env.operations.osm import read_osm

        return read_osm(path), _OSM_CREDIT
    if path.suffix.lower() not in (".geojson", ".json"):
        raise InputError(
            f"{path}: unknown kind of file; export the buildings as .osm, .osm.pbf or .geojson"
        )
    data = read_json(path)
    said = (data.get(key) for key in ("attribution", "copyright", "licence", "license"))
    credit = "; ".join(" ".join(text.split())[:200] for text in said if isinstance(text, str))
    return features(path, data), credit


def _shapes(found: list[dict[str, Any]]) -> Iterator[tuple[str, Any, Mapping[str, Any]]]:
    """Polygon, LineString or Point, its corners in longitude and latitude, and tags."""
    for feature in found:
        properties, geometry = feature["properties"], feature["geometry"]
        nested = properties.get("tags")
        tags = nested if isinstance(nested, dict) else properties
        kind, coordinates = geometry.get("type"), geometry.get("coordinates")
        if not isinstance(coordinates, list):
            continue
        if kind in ("Polygon", "MultiPolygon"):
            for rings in [coordinates] if kind == "Polygon" else coordinates:
                yield "Polygon", (rings[0] if isinstance(rings, list) and rings else []), tags
        elif kind in ("LineString", "MultiLineString"):
            for line in [coordinates] if kind == "LineString" else coordinates:
                yield "LineString", line, tags
        elif kind == "Point":
            yield "Point", [coordinates], tags


def _local(path: Path, number: int, frame: LocalFrame, corners: Any) -> np.ndarray | None:
    """(N, 2) east and north [m]; None where that is none."""
    try:
        places = np.array([position[:2] for position in corners], dtype=np.float64)
        if not np.isfinite(places).all() or np.abs(places).max(initial=0.0) > 180.0:
            raise ValueError
    except (TypeError, ValueError, KeyError, OverflowError):
        raise InputError(
            f"{path}: building {number + 1} has a broken coordinate; export it again in WGS 84"
        ) from None
    if not len(places) or places.shape[1:] != (2,) or np.abs(places[:, 1]).max() > 90.0:
        return None
    return frame.to_ned(places[:, 1], places[:, 0])[:, 1::-1]


def _ground(kind: str, places: np.ndarray, what: Tagged) -> BaseGeometry:
    """What something stands on; of a line, a rectangle for each of its straight parts."""
    if kind == "Polygon":
        return shapely.make_valid(Polygon(places)) if len(places) > 3 else Polygon()
    wide_m = what.half_width_m
    if kind == "Point":
        return shapely.box(*(places[0] - wide_m), *(places[0] + wide_m))
    parts = (
        hull_of(LineString(ends).buffer(wide_m, cap_style="square"))
        for ends in pairwise(places)
        if wide_m and (ends[0] != ends[1]).any()
    )
    return shapely.GeometryCollection(list(parts))


def _near(wood: Polygon, area: Polygon) -> list[Polygon]:
    """The part of a wood that UAS may meet: woods are large and have many corners."""
    return polygons_of(wood.intersection(area.buffer(_AROUND_M)).simplify(_DETAIL_M))


def _street(places: np.ndarray, half_width_m: float, area: Polygon) -> list[Polygon]:
    if len(places) < 2:
        return []
    shape = LineString(places).buffer(half_width_m, cap_style="flat", quad_segs=2)
    parts = polygons_of(shape.intersection(area).simplify(0.3 * _DETAIL_M))
    return [piece for part in parts if part.area > _SMALLEST_M2 for piece in without_holes(part)]

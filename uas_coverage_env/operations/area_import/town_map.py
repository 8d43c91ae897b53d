"""What stands in a town and where its streets are, from OpenStreetMap: GeoJSON, .osm, .osm.pbf."""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import LineString, MultiPoint, Polygon
from shapely.geometry.base import BaseGeometry

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.drawn_areas import (
    DrawnPolygon,
    LeftOut,
    Remark,
    drawn_of,
)
from uas_coverage_env.operations.area_import.feature_roles import Meaning, meaning_of
from uas_coverage_env.operations.area_import.geo_features import GeoFeature, Part, Shape, parts_of
from uas_coverage_env.operations.area_import.local_polygons import local_polygon
from uas_coverage_env.operations.area_import.osm_tags import (
    BUILDING,
    FOREST,
    LEAST_M,
    OTHER,
    STREETS_M,
    Tagged,
    half_width_m,
    height_m,
    not_read,
)
from uas_coverage_env.operations.area_import.prisms import Standing
from uas_coverage_env.operations.area_import.read_drawings import or_example
from uas_coverage_env.operations.area_import.readers.geojson import features, read_json
from uas_coverage_env.operations.convex import hull_of, polygons_of, without_holes
from uas_coverage_env.operations.geodesy import LocalFrame

_OSM = (".osm", ".pbf")
_OSM_CREDIT = (
    "© OpenStreetMap contributors, https://www.openstreetmap.org/copyright; Open Database License "
    "(ODbL) 1.0"
)
_SMALLEST_M2, _SMALLEST_M = 4.0, 0.5
_DETAIL_M = 1.0
"""So far corners of woods and streets may be off; what a wood becomes holds more ground anyway."""

_AROUND_M = 10.0


@dataclass
class Town:
    """What is known of the surroundings of an area.

    Attributes:
        standing: What stands in the area, as buildings and power lines.
        no_fly: Zones that the file says to be.
        streets: Where streets are (x east, y north) [m].
        incomplete: Outlines in the area of which the file lacks corners.
        unread: Tags of height or levels that cannot be read, and how often.
        not_read: Tags of what may be tall and is not known, in the area, and how often.
        left_out: What is passed over as the file says.
        remarks: Lines for the user.
        credit: Attribution and licence of the data.
    """

    standing: list[Standing] = field(default_factory=list)
    no_fly: list[Polygon] = field(default_factory=list)
    streets: list[Polygon] = field(default_factory=list)
    incomplete: int = 0
    unread: Counter[str] = field(default_factory=Counter)
    not_read: Counter[str] = field(default_factory=Counter)
    left_out: list[LeftOut] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    credit: str = ""


def read_town(path: Path, frame: LocalFrame, area: Polygon) -> Town:
    """What stands in an area, and its streets.

    Args:
        path: A file of OpenStreetMap (.osm, .osm.pbf), GeoJSON with its tags as properties (or in
            a property `tags`), or the name of a shipped example (`karhula`).
        frame: The local metres.
        area: In these, x east, y north.

    Raises:
        InputError: The file cannot be used, or nothing that stands is anywhere near.
    """
    path = or_example(path, "_buildings.geojson")
    found, credit = _read(path)
    town, nearest_m = Town(credit=credit), np.inf
    for feature in found:
        for part in parts_of(feature):
            meaning = meaning_of(feature, part.shape, on_map=True)
            if meaning.role == "obstacle":
                nearest_m = min(nearest_m, _add(town, feature, part, meaning, frame, area))
            elif meaning.role is not None:
                _add_drawn(town, feature, meaning, frame, area)
                break  # with all its parts
            else:
                _add_other(town, feature, part, frame, area)
    if nearest_m == np.inf and not town.no_fly:
        raise InputError(f"{path}: holds no building; export polygons with the tag `building`")
    if np.inf > nearest_m > 10_000.0:
        raise InputError(
            f"{path}: the nearest building is {nearest_m / 1000.0:.0f} km from the area; take the "
            f"buildings of this place, or exchange latitude and longitude where they are swapped"
        )
    return town


def _read(path: Path) -> tuple[Iterable[GeoFeature], str]:
    """Features with tags, and the attribution of the data."""
    if path.suffix.lower() in _OSM:
        # a library that nothing else needs
        from uas_coverage_env.operations.area_import.readers.osm import read_osm

        return read_osm(path), _OSM_CREDIT
    if path.suffix.lower() not in (".geojson", ".json"):
        raise InputError(
            f"{path}: unknown kind of file; export the buildings as .osm, .osm.pbf or .geojson"
        )
    data = read_json(path)
    said = (data.get(key) for key in ("attribution", "copyright", "licence", "license"))
    credit = "; ".join(" ".join(text.split())[:200] for text in said if isinstance(text, str))
    return features(path, data), credit


def _add(
    town: Town, feature: GeoFeature, part: Part, meaning: Meaning, frame: LocalFrame, area: Polygon
) -> float:
    """Add what stands there; returns how far from the area it is [m]."""
    what = meaning.solid or OTHER
    places = _local(feature, part, frame)
    if places is None:
        town.left_out.append(LeftOut("empty geometry", feature.name or feature.place))
        return np.inf
    ground = _ground(feature, part.shape, places, what)
    parts = polygons_of(ground)
    if not parts:
        town.incomplete += bool(MultiPoint(places).intersects(area))
        return np.inf
    away_m = float(shapely.distance(ground, area))
    parts = [one for one in parts if one.intersects(area)]
    if not parts:
        return away_m
    top_m, known = height_m(feature.attributes, what.guessed_m, town.unread)
    if math.isnan(top_m):
        if "role" in feature.attributes:
            raise InputError(f"{feature.source}: is an obstacle, but has no height; give `height`")
        town.left_out.append(LeftOut("thing of unknown height", feature.name or feature.place))
        return away_m
    large = [one for one in parts if one.area > _SMALLEST_M2]
    if top_m >= LEAST_M:  # a mast's outline may be small
        small = (one for one in parts if one.area <= _SMALLEST_M2)
        large += [one.buffer(_SMALLEST_M, quad_segs=1) for one in small]
    for one in large:
        near = _near(one, area) if what.kind == FOREST else [one]
        town.standing += [Standing(what.kind, each, top_m, known) for each in near]
    return away_m


def _add_drawn(
    town: Town, feature: GeoFeature, meaning: Meaning, frame: LocalFrame, area: Polygon
) -> None:
    """Add a no-fly zone, or what is to be passed over."""
    if meaning.role not in ("no_fly", "ignore"):
        raise InputError(
            f"{feature.source}: {meaning.said_by} says {meaning.role}, which is no matter of "
            f"--town; put it into a file of the area"
        )
    for thing in drawn_of(feature, on_map=True):
        if isinstance(thing, LeftOut):
            town.left_out.append(thing)
        elif isinstance(thing, Remark):
            town.remarks.append(thing.text)
        elif isinstance(thing, DrawnPolygon):
            zone = local_polygon(frame, thing)
            if zone.intersects(area):
                town.no_fly.append(zone)


def _add_other(
    town: Town, feature: GeoFeature, part: Part, frame: LocalFrame, area: Polygon
) -> None:
    """Add a street, or count what may be tall."""
    street_m = STREETS_M.get(str(feature.attributes.get("highway")))
    met = not_read(feature.attributes)
    is_street = street_m is not None and part.shape in ("line", "closed line")
    if not (met or is_street):
        return
    places = _local(feature, part, frame)
    if places is None:
        return
    if met and MultiPoint(places).intersects(area):
        town.not_read[met] += 1
    if is_street:
        town.streets += _street(places, street_m or 0.0, area)


def _local(feature: GeoFeature, part: Part, frame: LocalFrame) -> np.ndarray | None:
    """(N, 2) east and north [m] of a part's places, or its outer ring; None where it has none."""
    given = part.positions[0] if part.shape == "polygon" else part.positions
    try:
        places = np.array([position[:2] for position in given], dtype=np.float64)
        if not np.isfinite(places).all() or np.abs(places).max(initial=0.0) > 180.0:
            raise ValueError
    except (TypeError, ValueError, KeyError, OverflowError):
        raise InputError(
            f"{feature.source} has a broken coordinate; export it again in WGS 84"
        ) from None
    if not len(places) or places.shape[1:] != (2,) or np.abs(places[:, 1]).max() > 90.0:
        return None
    return frame.to_ned(places[:, 1], places[:, 0])[:, 1::-1]


def _ground(feature: GeoFeature, shape: Shape, places: np.ndarray, what: Tagged) -> BaseGeometry:
    """What something stands on; of a line, a rectangle for each of its straight parts.

    Empty, where corners are missing, or where it is no outline although only that would tell.
    """
    if shape == "polygon" or (shape == "closed line" and not what.along and not feature.what):
        return shapely.make_valid(Polygon(places)) if len(places) > 3 else Polygon()
    wide_m = half_width_m(feature.attributes, what)
    cut = feature.what or (shape == "line" and what.kind in (BUILDING, FOREST))
    if not wide_m or (cut and not what.along):
        return Polygon()
    if shape == "point" or len(np.unique(places, axis=0)) < 2:
        return shapely.box(*(places[0] - wide_m), *(places[0] + wide_m))
    parts = (
        hull_of(LineString(ends).buffer(wide_m, cap_style="square"))
        for ends in pairwise(places)
        if (ends[0] != ends[1]).any()
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

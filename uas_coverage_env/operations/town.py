"""Buildings of a town as convex prisms: footprints and tags of OpenStreetMap, as GeoJSON.

Buildings between which no UAS can pass are merged where they are of like height, and what is not
convex is cut into convex pieces.
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.convex import convex_pieces, polygons_of
from uas_coverage_env.operations.frame import LocalFrame
from uas_coverage_env.operations.geojson import features, read_json
from uas_coverage_env.operations.reading import or_example

STOREY_M = 3.2
ROOF_M = 2.0
"""Added to the levels where none are tagged for the roof: levels do not count it."""

GUESSED_M: Mapping[str, float] = {
    **dict.fromkeys(("garage", "garages", "shed", "carport", "hut"), 4.0),
    "greenhouse": 5.0,
    **dict.fromkeys(("house", "detached", "semidetached_house", "residential"), 9.0),
    **dict.fromkeys(("terrace", "retail"), 10.0),
    **dict.fromkeys(("school", "public"), 13.0),
    "industrial": 14.0,
    "apartments": 20.0,
    "church": 35.0,
}
"""Height of a building without height and levels, by its kind: a guess on the high side."""

GUESSED_OTHER_M = 10.0

_HIGHEST_M = 1_000.0
_SMALLEST_M2 = 4.0
_LIKE_HEIGHT_M = 4.0
_SLACK = 1.25
_HEIGHT = re.compile(r"\s*(\d{1,4}(?:[.,]\d+)?)\s*(m|ft|')?\s*")
_LEVELS = re.compile(r"\s*(\d{1,3}(?:\.\d+)?)\s*")


@dataclass(frozen=True, eq=False)
class Building:
    """A footprint (x east, y north) and the height of its roof above the ground."""

    footprint: Polygon
    height_m: float


@dataclass
class Town:
    """The buildings of an area and what is said of them.

    Attributes:
        buildings: Those that meet the area.
        guessed: How many of them have neither height nor levels.
        unread: Tags of height or levels that cannot be read, and how often.
        credit: Attribution and licence that the file names.
    """

    buildings: list[Building] = field(default_factory=list)
    guessed: int = 0
    unread: Counter[str] = field(default_factory=Counter)
    credit: str = ""


def read_town(path: Path, frame: LocalFrame, area: Polygon) -> Town:
    """The buildings whose footprint meets an area.

    Args:
        path: GeoJSON with OpenStreetMap's tags as properties (or in a property `tags`), or the
            name of a shipped example (`karhula`).
        frame: The local metres.
        area: In these, x east, y north.

    Raises:
        InputError: The file cannot be used, or no building is anywhere near.
    """
    path = or_example(path, "_buildings.geojson")
    if path.suffix.lower() not in (".geojson", ".json"):
        raise InputError(f"{path}: unknown kind of file; export the buildings as .geojson")
    data = read_json(path)
    town, nearest_m, seen = Town(credit=_credit(data)), np.inf, 0
    for number, (rings, tags) in enumerate(_footprints(features(path, data))):
        footprint = _local(path, number, frame, rings)
        if footprint is None:
            continue
        seen += 1
        nearest_m = min(nearest_m, shapely.distance(footprint, area))
        parts = [p for p in polygons_of(footprint) if p.area > _SMALLEST_M2 and p.intersects(area)]
        if parts:
            height, known = height_m(tags, town.unread)
            town.guessed += not known
            town.buildings += [Building(part, height) for part in parts]
    if not seen:
        raise InputError(f"{path}: holds no building; export polygons with the tag `building`")
    if nearest_m > 10_000.0:
        raise InputError(
            f"{path}: the nearest building is {nearest_m / 1000.0:.0f} km from the area; take the "
            f"buildings of this place, or exchange latitude and longitude where they are swapped"
        )
    return town


def height_m(tags: Mapping[str, Any], unread: Counter[str] | None = None) -> tuple[float, bool]:
    """Height of a building above the ground, and whether its tags say it.

    `height` counts before `building:levels`; 12, 12.5 m, 40 ft and 40' are read.

    Args:
        tags: Of OpenStreetMap.
        unread: Counts the tags that cannot be read.
    """
    for key in ("height", "building:height", "est_height"):
        found = _match(_HEIGHT, key, tags, unread)
        if found:
            value = float(found[1].replace(",", "."))
            value *= 0.3048 if found[2] in ("ft", "'") else 1.0
            if 0.0 < value <= _HIGHEST_M:
                return value, True
    levels = _match(_LEVELS, "building:levels", tags, unread)
    if levels and float(levels[1]) > 0.0:
        roof = _match(_LEVELS, "roof:levels", tags, unread)
        return float(levels[1]) * STOREY_M + (float(roof[1]) * STOREY_M if roof else ROOF_M), True
    kind = str(tags.get("building") or tags.get("building:part") or "")
    return GUESSED_M.get(kind, GUESSED_OTHER_M), False


def prisms(buildings: Sequence[Building], gap_m: float) -> list[Building]:
    """Convex footprints that hold all buildings.

    Args:
        buildings: In local metres.
        gap_m: Buildings closer to each other than this are one block where they are of like
            height: a shed does not raise a house.
    """
    if not buildings:
        return []
    grown = [b.footprint.buffer(gap_m / 2.0, join_style="mitre") for b in buildings]
    group = list(range(len(buildings)))

    def root(i: int) -> int:
        while group[i] != i:
            i = group[i]
        return i

    near = shapely.STRtree(grown).query(grown, predicate="intersects").T.tolist()
    for i, j in near:
        if i < j and abs(buildings[i].height_m - buildings[j].height_m) <= _LIKE_HEIGHT_M:
            group[root(j)] = root(i)
    blocks: dict[int, list[int]] = {}
    for i in range(len(buildings)):
        blocks.setdefault(root(i), []).append(i)
    found = [
        prism
        for members in blocks.values()
        for prism in _block([buildings[i] for i in members], gap_m)
    ]
    return _without_hidden(found)


def _block(members: list[Building], gap_m: float) -> Iterator[Building]:
    merged = shapely.union_all([b.footprint for b in members])
    if len(members) > 1:  # close the gaps that no UAS passes
        closed = merged.buffer(gap_m / 2.0, join_style="mitre")
        merged = merged.union(closed.buffer(-gap_m / 2.0, join_style="mitre"))
    for part in polygons_of(merged):
        for piece in convex_pieces(part, _SLACK):
            inside = [b for b in members if b.footprint.intersects(piece)] or members
            yield Building(piece, max(b.height_m for b in inside))


def _without_hidden(found: list[Building]) -> list[Building]:
    """Leave out what lies inside something higher."""
    kept: list[Building] = []
    for prism in sorted(found, key=lambda b: (-b.height_m, -b.footprint.area)):
        if not any(k.footprint.covers(prism.footprint) for k in kept):
            kept.append(prism)
    return kept


def _match(
    pattern: re.Pattern[str], key: str, tags: Mapping[str, Any], unread: Counter[str] | None
) -> re.Match[str] | None:
    text = str(tags.get(key) or "")
    found = pattern.fullmatch(text)
    if text and found is None and unread is not None:
        unread[f"{key}={text[:40]}"] += 1
    return found


def _footprints(found: list[dict[str, Any]]) -> Iterator[tuple[Any, Mapping[str, Any]]]:
    """Outer rings in longitude and latitude, and tags, of all buildings."""
    for feature in found:
        properties, geometry = feature["properties"], feature["geometry"]
        nested = properties.get("tags")
        tags = nested if isinstance(nested, dict) else properties
        if not (tags.get("building") or tags.get("building:part")):
            continue
        coordinates = geometry.get("coordinates")
        if geometry.get("type") in ("Polygon", "MultiPolygon") and isinstance(coordinates, list):
            for rings in [coordinates] if geometry["type"] == "Polygon" else coordinates:
                yield (rings[0] if isinstance(rings, list) and rings else []), tags


def _local(path: Path, number: int, frame: LocalFrame, ring: Any) -> BaseGeometry | None:
    try:
        places = np.array([position[:2] for position in ring], dtype=np.float64)
        if not np.isfinite(places).all() or np.abs(places).max(initial=0.0) > 180.0:
            raise ValueError
    except (TypeError, ValueError, KeyError, OverflowError):
        raise InputError(
            f"{path}: building {number + 1} has a broken coordinate; export it again in WGS 84"
        ) from None
    if len(places) < 4 or places.shape[1:] != (2,) or np.abs(places[:, 1]).max() > 90.0:
        return None
    ned = frame.to_ned(places[:, 1], places[:, 0])
    return shapely.make_valid(Polygon(ned[:, 1::-1]))


def _credit(data: Mapping[str, Any]) -> str:
    said = (data.get(key) for key in ("attribution", "copyright", "licence", "license"))
    return "; ".join(" ".join(text.split())[:200] for text in said if isinstance(text, str))

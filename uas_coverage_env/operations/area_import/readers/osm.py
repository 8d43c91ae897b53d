"""OpenStreetMap files, XML (.osm) and binary (.osm.pbf), as features with their tags."""

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import osmium
from osmium.geom import GeoJSONFactory
from osmium.io import FileBuffer
from osmium.osm import Area, Node, Relation, Way

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.feature_roles import speaks_of_flying
from uas_coverage_env.operations.area_import.geo_features import GeoFeature, attributes_of
from uas_coverage_env.operations.area_import.osm_tags import BUILDING, FOREST, KEYS, standing_of
from uas_coverage_env.operations.area_import.readers import content

_KEYS = frozenset((*KEYS, "highway"))
LACKS_CORNERS = "outline that lacks corners"
_MOST_OBJECTS = 2_000_000
"""A file of 20 MB may hold more; a town with its surroundings has some ten thousand."""


def read_osm(path: Path) -> list[GeoFeature]:
    """What a town may be made of: outlines, lines and points with tags.

    An outline of which the file lacks corners, as at the edge of an extract, comes as the line of
    those that it has, called `LACKS_CORNERS`.

    Args:
        path: Of a .osm or .osm.pbf file.

    Raises:
        InputError: It cannot be used.
    """
    data, kind = content(path), path.suffix[1:].lower()
    try:
        if not _in_order(path, FileBuffer(data, kind)):
            data, kind = _sorted(data, kind), "pbf"
        return list(_features(str(path), FileBuffer(data, kind)))
    except (RuntimeError, osmium.InvalidLocationError) as error:  # all that libosmium raises
        reason = " ".join(str(error).split())[:80]
        raise InputError(
            f"{path}: is no OpenStreetMap file ({reason}); export the buildings again"
        ) from None


def _in_order(path: Path, data: Any) -> bool:
    """Whether objects come by kind and number, as those that put outlines together need them."""
    last, ordered = (0, 0), True
    for number, thing in enumerate(osmium.FileProcessor(data), 1):
        if number > _MOST_OBJECTS:
            raise InputError(
                f"{path}: holds more than {_MOST_OBJECTS} objects; cut out the surroundings of "
                f"the area"
            )
        this = "nwr".find(thing.type_str()), thing.id
        ordered &= this > last and thing.id > 0  # new things of an editor have numbers below 0
        last = this
    return ordered


def _sorted(data: bytes, kind: str) -> bytes:
    """The same file in order, as editors and servers of extracts do not always write it."""
    reader = osmium.MergeInputReader()
    reader.add_buffer(data, kind)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "sorted.osm.pbf"
        with osmium.SimpleWriter(str(file)) as writer:
            reader.apply(writer, simplify=False)
        return file.read_bytes()


def _features(file: str, data: Any) -> Iterator[GeoFeature]:
    shapes = GeoJSONFactory()
    corners: dict[int, list[float]] = {}  # of each way one
    outlines: dict[tuple[bool, int], GeoFeature] = {}  # by whether it is a way, and number

    def feature(thing: Any, geometry: dict[str, Any], what: str = "") -> GeoFeature:
        number = thing.orig_id() if isinstance(thing, Area) else thing.id
        word = "way" if isinstance(thing, Area) and thing.from_way() else thing.__class__.__name__
        return GeoFeature(file, f"{word.lower()} {number}", geometry, _tags(thing), what=what)

    for thing in osmium.FileProcessor(data).with_areas():
        line: list[list[float]] = []
        lacks = LACKS_CORNERS
        if isinstance(thing, Way):
            known = [node.location for node in thing.nodes if node.location.valid()]
            line = [[place.lon, place.lat] for place in known]
            if line:
                corners[thing.id] = line[0]
            if thing.is_closed() and len(known) == len(thing.nodes):
                lacks = ""  # and is an outline, also where it crosses itself
        if not any(map(_matters, thing.tags)):
            continue
        what = standing_of(_tags(thing))
        along = what is not None and what.along
        if isinstance(thing, Area):
            if thing.num_rings()[0] > 0 and not (along and thing.from_way()):
                outlines.pop((thing.from_way(), thing.orig_id()), None)
                yield feature(thing, json.loads(shapes.create_multipolygon(thing)))
        elif isinstance(thing, Way):
            is_outline = thing.is_closed() or (what is not None and what.kind in (BUILDING, FOREST))
            if is_outline and not along:
                if what is not None:
                    outlines[True, thing.id] = feature(thing, _line(line), lacks)
            else:
                yield feature(thing, _line(line))
        elif isinstance(thing, Relation) and what is not None and not along:
            ways = (corners.get(member.ref) for member in thing.members if member.type == "w")
            places = [place for place in ways if place]
            outlines[False, thing.id] = feature(thing, _line(places), LACKS_CORNERS)
        elif isinstance(thing, Node) and thing.location.valid():
            place = [thing.location.lon, thing.location.lat]
            yield feature(thing, {"type": "Point", "coordinates": place})
    yield from outlines.values()


def _matters(tag: Any) -> bool:
    key = tag.k.strip().lower()
    return key in _KEYS or (key == "name" and speaks_of_flying(tag.v))


def _line(places: list[list[float]]) -> dict[str, Any]:
    return {"type": "LineString", "coordinates": places}


def _tags(thing: Any) -> dict[str, Any]:
    return attributes_of({tag.k: tag.v for tag in thing.tags})

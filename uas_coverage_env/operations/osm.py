"""OpenStreetMap files, XML (.osm) and binary (.osm.pbf), as features of GeoJSON with their tags."""

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import osmium
from osmium.filter import KeyFilter
from osmium.geom import GeoJSONFactory
from osmium.io import FileBuffer
from osmium.osm import Area, Node, Relation, Way

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.drawing import content

_AREAS = ("building", "building:part", "natural", "landuse")
_LINES = ("power", "highway", "natural")
_POINTS = ("natural", "man_made", "power")
_MOST_OBJECTS = 2_000_000
"""A file of 20 MB may hold more; a town with its surroundings has some ten thousand."""


def read_osm(path: Path) -> list[dict[str, Any]]:
    """What a town may be made of: outlines, lines and points with tags.

    An outline of which the file lacks corners, as at the edge of an extract, comes as the line of
    those that it has.

    Args:
        path: Of a .osm or .osm.pbf file.

    Raises:
        InputError: It cannot be used.
    """
    data, kind = content(path), path.suffix[1:].lower()
    try:
        if not _in_order(path, FileBuffer(data, kind)):
            data, kind = _sorted(data, kind), "pbf"
        return list(_features(FileBuffer(data, kind)))
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


def _features(data: Any) -> Iterator[dict[str, Any]]:
    shapes = GeoJSONFactory()
    corners: dict[int, list[float]] = {}  # of each way one
    outlines: dict[tuple[bool, int], dict[str, Any]] = {}  # by whether it is a way, and number
    for thing in osmium.FileProcessor(data).with_areas(KeyFilter(*_AREAS)):
        tags = thing.tags
        is_whole = isinstance(thing, Area) and thing.num_rings()[0] > 0
        if isinstance(thing, Area) and is_whole and _has(tags, _AREAS):
            outlines.pop((thing.from_way(), thing.orig_id()), None)
            yield _feature(tags, json.loads(shapes.create_multipolygon(thing)))
        elif isinstance(thing, Way):
            known = [node.location for node in thing.nodes if node.location.valid()]
            line = [[place.lon, place.lat] for place in known]
            if line:
                corners[thing.id] = line[0]
            if _has(tags, _LINES) and not thing.is_closed():
                yield _line(tags, line)
            elif _has(tags, _AREAS):
                outlines[True, thing.id] = _line(tags, line)
        elif isinstance(thing, Relation) and _has(tags, _AREAS):
            ways = (corners.get(member.ref) for member in thing.members if member.type == "w")
            outlines[False, thing.id] = _line(tags, [place for place in ways if place])
        elif isinstance(thing, Node) and _has(tags, _POINTS) and thing.location.valid():
            place = [thing.location.lon, thing.location.lat]
            yield _feature(tags, {"type": "Point", "coordinates": place})
    yield from outlines.values()


def _line(tags: Any, places: list[list[float]]) -> dict[str, Any]:
    return _feature(tags, {"type": "LineString", "coordinates": places})


def _has(tags: Any, keys: tuple[str, ...]) -> bool:
    return any(key in tags for key in keys)


def _feature(tags: Any, geometry: dict[str, Any]) -> dict[str, Any]:
    return {"geometry": geometry, "properties": {tag.k: tag.v for tag in tags}}

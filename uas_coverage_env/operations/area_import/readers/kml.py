"""KML and KMZ: the placemarks of a file, with the folders that they lie in.

Entities and document types are refused (defusedxml), archives are unpacked up to a limit.
"""

import io
import math
import re
import zipfile
import zlib
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.geo_features import GeoFeature, attributes_of
from uas_coverage_env.operations.area_import.osm_tags import LEAST_M
from uas_coverage_env.operations.area_import.readers import MOST_BYTES, content

_GEOMETRIES = ("Polygon", "LinearRing", "LineString", "Point", "Track")
_NOT_READ = ("NetworkLink", "GroundOverlay", "PhotoOverlay", "ScreenOverlay", "Tour", "Model")
_FOLDERS = ("Document", "Folder")


def read_kml(path: Path) -> Iterator[GeoFeature]:
    """The placemarks of a file; attributes are their names, descriptions and extended data.

    Raises:
        InputError: The file cannot be used.
    """
    yield from _features(path, path.stem, content(path), count(1))


def read_kmz(path: Path) -> Iterator[GeoFeature]:
    """The same from all KML files of an archive, but for what macOS adds to one.

    Raises:
        InputError: The file cannot be used.
    """
    packed, found, left = content(path), [], MOST_BYTES + 1
    try:
        with zipfile.ZipFile(io.BytesIO(packed)) as archive:
            for name in archive.namelist():
                parts = name.replace("\\", "/").split("/")
                if "__MACOSX" in parts or parts[-1].startswith("._"):
                    continue
                if name.lower().endswith(".kml"):
                    with archive.open(name) as file:
                        # what the archive says about sizes need not be true
                        found.append((Path(parts[-1]).stem, file.read(left)))
                        left -= len(found[-1][1])
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise InputError(f"{path}: cannot be unpacked ({error}); export it again") from None
    if not found:
        raise InputError(f"{path}: holds no .kml; export it again")
    if left <= 0:
        megabytes = MOST_BYTES // 1_000_000
        raise InputError(f"{path}: unpacks to more than {megabytes} MB; save the area alone")
    numbers = count(1)
    for stem, text in found:
        yield from _features(path, stem if stem.lower() != "doc" else path.stem, text, numbers)


class _Within(NamedTuple):
    """What an element lies in, the innermost first."""

    folders: tuple[str, ...] = ()
    role: str = ""


def _features(path: Path, layer: str, text: bytes, numbers: Iterator[int]) -> Iterator[GeoFeature]:
    try:
        root = fromstring(text, forbid_dtd=True)
    except DefusedXmlException:
        raise InputError(f"{path}: has a document type or entities; export plain KML") from None
    except (ParseError, ValueError, LookupError) as error:
        raise InputError(f"{path}: is no XML ({error}); export it again") from None
    for placemark, within in _placemarks(root):
        number, attributes = next(numbers), _attributes(placemark)
        if within.role:
            attributes.setdefault("role", within.role)
        shapes = list(_outermost(placemark, *_GEOMETRIES, *_NOT_READ))
        other = [_tag(shape) for shape in shapes if _tag(shape) in _NOT_READ]
        geometries = [_geometry(shape) for shape in shapes if _tag(shape) in _GEOMETRIES]
        heights = [found for found in map(_extruded, shapes) if found]
        parts: list[tuple[str, Any]] = [(tag, None) for tag in other]
        if geometries or not other:
            what = "" if geometries else "placemark without geometry"
            parts.append((what, {"type": "GeometryCollection", "geometries": geometries}))
        for what, geometry in parts:
            yield GeoFeature(
                str(path),
                f"placemark {number}",
                geometry,
                attributes_of(attributes, *heights),
                within.folders,
                (layer,),
                f"area_{number}",
                what,
            )


def _placemarks(root: Element) -> Iterator[tuple[Element, _Within]]:
    """Placemarks and what is not read, in their order, with what they lie in."""
    left = [(root, _Within())]
    while left:
        element, within = left.pop()
        tag = _tag(element)
        if tag == "Placemark" or tag in _NOT_READ:
            yield element, within
            continue
        if tag in _FOLDERS:
            own = _attributes(element)
            folders = (own["name"], *within.folders) if own.get("name") else within.folders
            within = _Within(folders, str(own.get("role") or within.role))
        left += [(child, within) for child in reversed(element)]


def _geometry(element: Element) -> dict[str, Any]:
    """As in GeoJSON; a ring may stand without a polygon, as some programs write it."""
    tag = _tag(element)
    if tag == "Polygon":
        outer, *more = _lines(element, "outerBoundaryIs") or [[]]
        parts = [[outer, *_lines(element, "innerBoundaryIs")], *([ring] for ring in more)]
        return {"type": "MultiPolygon", "coordinates": parts}
    if tag == "LinearRing":
        return {"type": "Polygon", "coordinates": _lines(element, None)[:1]}
    if tag == "Track":
        places = [
            _positions((at.text or "").replace(" ", ",")) for at in _outermost(element, "coord")
        ]
        return {"type": "LineString", "coordinates": [place for one in places for place in one]}
    places = [place for line in _lines(element, None) for place in line]
    return {"type": tag, "coordinates": places if tag == "LineString" else [*places, []][0]}


def _extruded(element: Element) -> dict[str, str]:
    """The height of a polygon that is drawn as a block from the ground up, or of a model."""
    if _tag(element) == "Model":
        return {"height": "of a model"}
    if _tag(element) not in ("Polygon", "LinearRing") or _text(element, "extrude") not in (
        "1",
        "true",
    ):
        return {}
    mode = _text(element, "altitudeMode")
    places = [place for line in _lines(element, "outerBoundaryIs") for place in line]
    top_m = max((place[2] for place in places if len(place) > 2), default=0.0)
    if mode not in ("relativeToGround", "absolute") or not top_m > LEAST_M:
        return {}
    return {"height": f"{top_m:g}" if mode == "relativeToGround" else "above sea level"}


def _tag(element: Element) -> str:
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def _outermost(root: Element, *tags: str) -> Iterator[Element]:
    """The elements with one of some tags that are in no other one of them, in their order."""
    left = [root]
    while left:
        element = left.pop()
        if _tag(element) in tags:
            yield element
        else:
            left += reversed(element)


def _lines(element: Element, boundary: str | None) -> list[list[tuple[float, ...]]]:
    """The coordinates in an element, of one boundary or directly."""
    parts = [element] if boundary is None else _outermost(element, boundary)
    found = [one for part in parts for one in _outermost(part, "coordinates")]
    return [_positions(one.text or "") for one in found]


def _text(element: Element, tag: str) -> str:
    found = element.find(f"{{*}}{tag}")
    return (found.text or "").strip() if found is not None else ""


def _attributes(element: Element) -> dict[str, Any]:
    """Name, description, and what the extended data says: Data, SimpleData, or elements at will."""
    values = {"name": _text(element, "name"), "description": _text(element, "description")}
    for extended in element.findall("{*}ExtendedData"):
        for one in _outermost(extended, "Data"):
            values[one.get("name", "")] = _text(one, "value")
        for one in extended.iter():
            if _tag(one) == "SimpleData":
                values[one.get("name", "")] = (one.text or "").strip()
            elif _tag(one) not in ("Data", "value", "displayName") and not len(one):
                values[_tag(one)] = (one.text or "").strip()
    return attributes_of(values)


def _positions(text: str) -> list[tuple[float, ...]]:
    """(longitude, latitude, ...) of each place; one without any where a number is broken."""
    try:
        if "_" in text:  # which Python takes for a number's
            raise ValueError
        places = re.sub(r"\s*,\s*", ",", text).split()
        found = [tuple(map(float, place.rstrip(",").split(","))) for place in places]
    except ValueError:
        return [()]
    return found if all(math.isfinite(n) for place in found for n in place) else [()]

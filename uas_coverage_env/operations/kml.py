"""KML and KMZ: the polygons and points of placemarks.

Entities and document types are refused (defusedxml), archives are unpacked up to a limit.
"""

import io
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.drawing import MOST_BYTES, Drawn, content, polygon, take_off


def read_kml(path: Path) -> Iterator[Drawn]:
    """Polygons, with attributes from ExtendedData (see `polygon`), or a role before the name.

    Raises:
        InputError: The file cannot be used.
    """
    yield from _drawn(path, content(path))


def read_kmz(path: Path) -> Iterator[Drawn]:
    """The same from the first KML file of an archive.

    Raises:
        InputError: The file cannot be used.
    """
    packed = content(path)
    try:
        with zipfile.ZipFile(io.BytesIO(packed)) as archive:
            names = [name for name in archive.namelist() if name.lower().endswith(".kml")]
            if not names:
                raise InputError(f"{path}: holds no .kml; export it again")
            with archive.open(names[0]) as file:
                # what the archive says about sizes need not be true
                text = file.read(MOST_BYTES + 1)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise InputError(f"{path}: cannot be unpacked ({error}); export it again") from None
    if len(text) > MOST_BYTES:
        megabytes = MOST_BYTES // 1_000_000
        raise InputError(f"{path}: unpacks to more than {megabytes} MB; save the area alone")
    yield from _drawn(path, text)


def _drawn(path: Path, text: bytes) -> Iterator[Drawn]:
    try:
        root = fromstring(text, forbid_dtd=True)
    except DefusedXmlException:
        raise InputError(f"{path}: has a document type or entities; export plain KML") from None
    except (ParseError, ValueError, LookupError) as error:
        raise InputError(f"{path}: is no XML ({error}); export it again") from None
    for number, placemark in enumerate(_outermost(root, "Placemark")):
        attributes = {"name": _text(placemark, "name"), **_extended_data(placemark)}
        # a ring may stand without a polygon, as some programs write it
        for element in _outermost(placemark, "Polygon", "LinearRing", "Point"):
            kind = _tag(element)
            outer = _rings(element, "outerBoundaryIs" if kind == "Polygon" else None)
            if kind == "Point":
                yield take_off(str(path), [*outer, [()]][0][0], attributes)
            elif outer:
                rings = [outer[0], *_rings(element, "innerBoundaryIs")]
                yield polygon(str(path), rings, attributes, f"area_{number + 1}")


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


def _rings(element: Element, boundary: str | None) -> list[list[tuple[float, ...]]]:
    """The coordinates in an element, of one boundary or directly."""
    parts = [element] if boundary is None else _outermost(element, boundary)
    return [_positions(found) for part in parts for found in _outermost(part, "coordinates")]


def _text(element: Element, tag: str) -> str:
    found = element.find(f"{{*}}{tag}")
    return (found.text or "").strip() if found is not None else ""


def _extended_data(placemark: Element) -> dict[str, Any]:
    """What Data and SimpleData elements say of a placemark."""
    values = {data.get("name", ""): _text(data, "value") for data in _outermost(placemark, "Data")}
    simple = _outermost(placemark, "SimpleData")
    return values | {data.get("name", ""): (data.text or "").strip() for data in simple}


def _positions(coordinates: Element) -> list[tuple[float, ...]]:
    """(longitude, latitude, ...) of each place; empty where one is broken."""
    text = coordinates.text or ""
    try:
        if "_" in text:  # which Python takes for a number's
            raise ValueError
        return [tuple(float(number) for number in place.split(",")) for place in text.split()]
    except ValueError:
        return [()]

"""ESRI shapefiles: the shapes of a layer, in whatever coordinates its .prj names."""

import codecs
import io
import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import pyproj
import shapefile
from pyproj.exceptions import ProjError

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.drawn_areas import MOST_CORNERS
from uas_coverage_env.operations.area_import.geo_features import GeoFeature, attributes_of
from uas_coverage_env.operations.area_import.osm_tags import KEYS
from uas_coverage_env.operations.area_import.readers import content

_LANGUAGES: Mapping[int, str] = {
    **{0x01: "cp437", 0x02: "cp850", 0x03: "cp1252", 0x08: "cp865", 0x0D: "cp437"},
    **{0x13: "cp932", 0x26: "cp866", 0x4D: "gbk", 0x4E: "cp949", 0x4F: "big5", 0x57: "cp1252"},
    **{0x58: "cp1252", 0x59: "cp1252", 0x64: "cp852", 0x65: "cp866", 0x66: "cp865"},
    **{0x67: "cp861", 0x6A: "cp737", 0x6B: "cp857", 0x78: "big5", 0x79: "cp949", 0x7A: "gbk"},
    **{0x7B: "cp932", 0x7C: "cp874", 0x86: "cp737", 0x87: "cp852", 0x88: "cp857"},
    **{0xC8: "cp1250", 0xC9: "cp1251", 0xCA: "cp1254", 0xCB: "cp1253", 0xCC: "cp1257"},
}
"""Language byte of a .dbf -> encoding (dBASE's list of code pages, as GDAL and Esri read it)."""

_LANGUAGE_AT = 29
_LONGEST_NAME = 10
"""Of a field: longer keys of tags are cut off there."""


def read_shapefile(path: Path) -> Iterator[GeoFeature]:
    """The shapes of a layer, with attributes from the fields of its table.

    Raises:
        InputError: The file cannot be used.
    """
    beside = _beside(path)
    if "prj" not in beside:
        raise InputError(f"{path}: has no .prj beside it, so its units are unknown; add the file")
    projection = beside["prj"]
    try:
        crs = pyproj.CRS.from_wkt(content(projection).decode("utf-8", "replace"))
        to_degrees = pyproj.Transformer.from_crs(crs, 4326, always_xy=True)
    except ProjError:
        raise InputError(f"{projection}: names no coordinate system; export it again") from None
    parts = {
        ending: content(beside[ending]) for ending in ("shp", "shx", "dbf") if ending in beside
    }
    page = content(beside["cpg"]) if "cpg" in beside else b""
    try:
        entries = _entries(parts, page)
        for number, (shape, fields) in enumerate(entries):
            yield _feature(path, number, shape, fields, to_degrees)
    except InputError:
        raise
    except Exception as error:  # whatever bytes at random lead to: struct, index, memory, ...
        reason = " ".join(str(error).split())[:80] or type(error).__name__
        raise InputError(f"{path}: is no sound shapefile ({reason}); export it again") from None


def _beside(path: Path) -> dict[str, Path]:
    """The files of a layer by their endings, in whatever case; the same case as the .shp first."""
    found = {"shp": path}
    folder = [path.parent / name for name in sorted(_names(path.parent))]
    upper = path.suffix.isupper()
    for file in sorted(folder, key=lambda f: (f.stem != path.stem, f.suffix.isupper() != upper)):
        if file.stem.lower() == path.stem.lower():
            found.setdefault(file.suffix[1:].lower(), file)
    return found


def _names(folder: Path) -> list[str]:
    return [file.name for file in folder.iterdir()] if folder.is_dir() else []


def _entries(
    parts: Mapping[str, bytes], page: bytes
) -> list[tuple[shapefile.Shape | None, dict[str, Any] | None]]:
    """Shapes and fields, in the first encoding in which all can be read; None: a deleted row."""
    encodings = _encodings(parts.get("dbf", b""), page)
    for encoding in encodings:
        files: dict[str, Any] = {ending: io.BytesIO(data) for ending, data in parts.items()}
        try:
            # what its reader warns of is an error a little later, or harmless
            ignored = warnings.catch_warnings(action="ignore")
            with ignored, closing(shapefile.Reader(**files, encoding=encoding)) as reader:
                shapes = reader.shapes()
                if "dbf" not in parts:
                    return [(shape, {}) for shape in shapes]
                rows = len(reader) if reader.numRecords is None else reader.numRecords
                if rows != len(shapes):
                    raise ValueError(f"{len(shapes)} shapes, but {rows} rows")
                records = map(reader.record, range(rows))
                return [
                    (s, None if r is None else r.as_dict())
                    for s, r in zip(shapes, records, strict=True)
                ]
        except (UnicodeError, shapefile.dbfFileException):
            if encoding == encodings[-1]:
                raise
    return []


def _encodings(table: bytes, page: bytes) -> list[str]:
    """What names are written in: the .cpg says it, else the table may; the last reads anything."""
    said = page.decode("ascii", "ignore").strip().lower()
    digits = re.search(r"\d{3,5}", said.replace("-", ""))
    found = [said, re.sub(r"^(?:ansi|oem|ms|windows)[ _-]*", "cp", said)]
    if digits:
        found += ["utf-8"] if digits[0] == "65001" else [f"cp{digits[0]}"]
        if digits[0].startswith("8859"):
            found.append(f"iso8859-{digits[0].removeprefix('8859') or 1}")
    language = _LANGUAGES.get(table[_LANGUAGE_AT]) if len(table) > _LANGUAGE_AT else None
    known = []
    for name in [*found, "utf-8", language or "utf-8", "latin-1"]:
        try:
            known.append(codecs.lookup(name).name)
        except (LookupError, ValueError):
            continue
    return list(dict.fromkeys(known))


def _feature(
    path: Path,
    number: int,
    shape: shapefile.Shape | None,
    fields: Mapping[str, Any] | None,
    to_degrees: pyproj.Transformer,
) -> GeoFeature:
    if fields is None:
        return GeoFeature(str(path), f"row {number + 1}", None, {}, what="deleted row")
    kind = shapefile.NULL if shape is None else shape.shapeType
    if shape is not None and len(getattr(shape, "points", ())) > MOST_CORNERS:
        raise InputError(
            f"{path}: has more than {MOST_CORNERS} corners; simplify it or save the area alone"
        )
    attributes = attributes_of(fields, *(_whole_keys(key, fields[key]) for key in fields))
    geometry: Any = None
    if kind == shapefile.MULTIPATCH:
        attributes["height"] = "of solid bodies"
    elif shape is not None and kind != shapefile.NULL and shape.points:
        geometry = shape.__geo_interface__
        geometry = {**geometry, "coordinates": _turned(geometry["coordinates"], to_degrees)}
    return GeoFeature(
        str(path),
        f"row {number + 1}",
        geometry,
        attributes,
        layers=(path.stem,),
        fallback=f"area_{number + 1}",
        what="MultiPatch" if kind == shapefile.MULTIPATCH else "",
    )


def _whole_keys(key: str, value: Any) -> dict[str, Any]:
    """The tags of which a field's name holds the first letters: `building:l`."""
    cut = key.lower()
    return {k: value for k in KEYS if len(cut) == _LONGEST_NAME and k[:_LONGEST_NAME] == cut}


def _turned(coordinates: Any, to_degrees: pyproj.Transformer) -> Any:
    """Coordinates of any geometry, nested as they are, in degrees."""
    if not coordinates:
        return []
    if isinstance(coordinates[0], int | float):
        return list(to_degrees.transform(*coordinates[:2]))
    if isinstance(coordinates[0][0], int | float):
        x, y = zip(*(point[:2] for point in coordinates), strict=True)
        return [list(place) for place in zip(*to_degrees.transform(x, y), strict=True)]
    return [_turned(one, to_degrees) for one in coordinates]

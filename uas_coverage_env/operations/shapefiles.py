"""ESRI shapefiles: the polygons of a layer, in whatever coordinates its .prj names."""

import io
import warnings
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import pyproj
import shapefile
from pyproj.exceptions import ProjError

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.drawing import MOST_CORNERS, Drawn, content, polygon, take_off


def read_shapefile(path: Path) -> Iterator[Drawn]:
    """Polygons, with attributes from the fields of the table (see `polygon`), and points.

    Raises:
        InputError: The file cannot be used.
    """
    projection = path.with_suffix(".prj")
    if not projection.is_file():
        raise InputError(f"{path}: has no .prj beside it, so its units are unknown; add the file")
    try:
        crs = pyproj.CRS.from_wkt(content(projection).decode("utf-8", "replace"))
        to_degrees = pyproj.Transformer.from_crs(crs, 4326, always_xy=True)
    except ProjError:
        raise InputError(f"{projection}: names no coordinate system; export it again") from None
    parts: dict[str, Any] = {
        ending: io.BytesIO(content(path.with_suffix(f".{ending}")))
        for ending in ("shp", "shx", "dbf")
        if ending == "shp" or path.with_suffix(f".{ending}").is_file()
    }
    try:
        # what its reader warns of is an error a little later, or harmless
        ignored = warnings.catch_warnings(action="ignore")
        with ignored, closing(shapefile.Reader(**parts)) as reader:
            entries = list(reader.iterShapeRecords())
        for number, entry in enumerate(entries):
            fields = entry.record.as_dict() if entry.record else {}
            if entry.shape is not None:
                yield from _drawn(path, number, entry.shape, fields, to_degrees)
    except InputError:
        raise
    except Exception as error:  # whatever bytes at random lead to: struct, index, memory, ...
        reason = " ".join(str(error).split())[:80] or type(error).__name__
        raise InputError(f"{path}: is no sound shapefile ({reason}); export it again") from None


def _drawn(
    path: Path,
    number: int,
    shape: shapefile.Shape,
    fields: Mapping[str, Any],
    to_degrees: pyproj.Transformer,
) -> Iterator[Drawn]:
    attributes = {str(key).lower(): value for key, value in fields.items()}
    if len(shape.points) > MOST_CORNERS:
        raise InputError(
            f"{path}: has more than {MOST_CORNERS} corners; simplify it or save the area alone"
        )
    geometry: Any = shape.__geo_interface__
    if geometry["type"] == "Point":
        place = _transformed([geometry["coordinates"]], to_degrees)[0]
        yield take_off(str(path), place, attributes)
    elif geometry["type"] in ("Polygon", "MultiPolygon"):
        parts = geometry["coordinates"]
        for rings in [parts] if geometry["type"] == "Polygon" else parts:
            turned = [_transformed(ring, to_degrees) for ring in rings]
            yield polygon(str(path), turned, attributes, f"area_{number + 1}")


def _transformed(ring: Any, to_degrees: pyproj.Transformer) -> list[tuple[float, float]]:
    x, y = zip(*(point[:2] for point in ring), strict=True)
    return list(zip(*to_degrees.transform(x, y), strict=True))

"""Drawings from files of any known format."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.drawn_areas import (
    Drawn,
    DrawnPolygon,
    drawn_of,
    limited,
)
from uas_coverage_env.operations.area_import.geo_features import GeoFeature
from uas_coverage_env.operations.area_import.readers.geojson import read_geojson
from uas_coverage_env.operations.area_import.readers.kml import read_kml, read_kmz
from uas_coverage_env.operations.area_import.readers.qgc_plan import read_plan
from uas_coverage_env.operations.area_import.readers.shapefile import read_shapefile

_EXAMPLES = Path(__file__).with_name("examples")

READERS: dict[str, Callable[[Path], Iterator[GeoFeature]]] = {
    ".geojson": read_geojson,
    ".json": read_geojson,
    ".kml": read_kml,
    ".kmz": read_kmz,
    ".shp": read_shapefile,
    ".plan": read_plan,
}
"""Ending of a file -> what reads it; a new format is a line here."""


def read_drawings(paths: Sequence[Path]) -> list[Drawn]:
    """All that was drawn in some files, in their order, and what is left out of them.

    Args:
        paths: Files, or names of shipped examples (`karhula`, `zones`).

    Raises:
        InputError: A file cannot be used, or there is nothing to search in them.
    """
    found = [thing for path in paths for thing in _read(or_example(path, ".geojson", ".kml"))]
    polygons = [thing for thing in found if isinstance(thing, DrawnPolygon)]
    if not any(thing.role == "search" for thing in polygons):
        names = ", ".join(map(str, paths))
        other = "; ".join(f"{one.name!r} is {one.role}" for one in polygons[:3])
        said = f" ({other}; the role search makes an area of one)" if other else ""
        raise InputError(f"{names}: no area to search; draw it as a closed polygon{said}")
    return found


def _read(path: Path) -> list[Drawn]:
    if path.suffix.lower() not in READERS:
        known = ", ".join(READERS)
        raise InputError(f"{path}: unknown kind of file; save the area as {known}")
    features = READERS[path.suffix.lower()](path)
    return list(limited(str(path), (thing for one in features for thing in drawn_of(one))))


def or_example(path: Path, *endings: str) -> Path:
    """The file of a shipped example where its name is given, otherwise the path itself."""
    is_name = len(path.parts) == 1 and not path.suffix and not path.exists()
    files = [_EXAMPLES / f"{path.name}{ending}" for ending in endings] if is_name else []
    return next((file for file in files if file.is_file()), path)

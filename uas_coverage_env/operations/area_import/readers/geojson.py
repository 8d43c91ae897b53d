"""GeoJSON (RFC 7946): features in longitude and latitude."""

import json
import re
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any, NoReturn

import pyproj
from pyproj.exceptions import ProjError

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.geo_features import (
    GEOMETRIES,
    GeoFeature,
    attributes_of,
)
from uas_coverage_env.operations.area_import.readers import content

_DEEPEST = 20
_OWN = {"type", "geometry", "geometries", "coordinates", "properties", "features", "bbox", "crs"}
_OLD_EPSG = re.compile(r".*epsg\.xml#(\d+)", re.IGNORECASE)


def read_geojson(path: Path) -> Iterator[GeoFeature]:
    """The features of a file.

    Raises:
        InputError: The file cannot be used.
    """
    yield from features(path, read_json(path))


def features(path: Path, data: dict[str, Any]) -> Iterator[GeoFeature]:
    """The features of what a file holds: a collection, a feature or a geometry.

    Args:
        path: The file.
        data: What it holds.

    Raises:
        InputError: It is no GeoJSON, or not in degrees of WGS 84.
    """
    yield from _features(path, data, (path.stem,), count(), 0)


def _features(
    path: Path, data: Any, layers: tuple[str, ...], numbers: Iterator[int], depth: int
) -> Iterator[GeoFeature]:
    _check_crs(path, data.get("crs"))
    kind = data.get("type")
    own = {key: value for key, value in data.items() if key not in _OWN}
    if kind == "FeatureCollection":
        found = data.get("features")
        if not isinstance(found, list) or depth > _DEEPEST:
            raise InputError(f"{path}: has no list of features; export it as GeoJSON")
        within = (str(data["name"]), *layers) if isinstance(data.get("name"), str) else layers
        for number, one in enumerate(found):
            if not isinstance(one, dict):
                raise InputError(f"{path}: features[{number}] is no object; export it again")
            yield from _features(path, one, within, numbers, depth + 1)
        return
    if kind != "Feature" and kind not in GEOMETRIES and depth == 0:
        raise InputError(f"{path}: is no GeoJSON, its type is {str(kind)[:40]!r}; export it again")
    number = next(numbers)
    is_feature = kind == "Feature"
    geometry = data.get("geometry") if is_feature else data
    if isinstance(geometry, dict):
        _check_crs(path, geometry.get("crs"))
    yield GeoFeature(
        str(path),
        f"features[{number}]",
        geometry,
        attributes_of(data.get("properties"), own),
        layers=layers,
        fallback=f"area_{number + 1}",
    )


def _check_crs(path: Path, crs: Any) -> None:
    """Refuse any coordinate system but WGS 84, however it is written."""
    if crs is None:
        return
    name = _crs_name(crs)
    try:
        system = pyproj.CRS.from_user_input(name)
        if system.equals(pyproj.CRS(4326), ignore_axis_order=True):
            return
    except (ProjError, ValueError):
        pass
    raise InputError(f"{path}: crs {name[:80]!r} is not WGS 84; export it in EPSG:4326")


def _crs_name(crs: Any) -> str:
    """The name in a `crs` of the years before RFC 7946, as pyproj knows it."""
    if isinstance(crs, dict):
        within = crs.get("properties")
        within = within if isinstance(within, dict) else crs
        name = within.get("name", within.get("code"))
        crs = json.dumps(crs) if name is None else name
    text = str(crs).strip()
    if text.isdigit():
        return f"EPSG:{text}"
    old = _OLD_EPSG.fullmatch(text)
    if old:
        return f"EPSG:{old[1]}"
    return f"OGC:{text}" if text.upper().startswith("CRS84") else text


def read_json(path: Path) -> dict[str, Any]:
    """A JSON file that holds an object, without NaN and infinity.

    Raises:
        InputError: It is none.
    """
    text = content(path)
    try:
        data = json.loads(text.decode("utf-8-sig"), parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else str(error)[:80]
        raise InputError(f"{path}: is not JSON ({reason}); export it again") from None
    if not isinstance(data, dict):
        raise InputError(f"{path}: holds no JSON object; export it again")
    return data


def _refuse(text: str) -> NoReturn:
    raise ValueError(f"{text} is no number of JSON")

"""GeoJSON (RFC 7946): polygons and points in longitude and latitude."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.drawing import Drawn, content, polygon, take_off

_WGS_84 = re.compile(r"CRS84|EPSG:+4326")


def read_geojson(path: Path) -> Iterator[Drawn]:
    """Polygons, with attributes from their properties (see `polygon`), and take-off points.

    Raises:
        InputError: The file cannot be used.
    """
    for number, feature in enumerate(features(path, read_json(path))):
        geometry, properties = feature["geometry"], feature["properties"]
        kind, coordinates = geometry.get("type"), geometry.get("coordinates")
        if kind == "Point":
            yield take_off(str(path), coordinates, properties)
        elif kind in ("Polygon", "MultiPolygon"):
            parts = [coordinates] if kind == "Polygon" else coordinates
            if not isinstance(parts, list) or not all(isinstance(p, list) and p for p in parts):
                raise InputError(f"{path}: features[{number}] has no rings; export it again")
            for rings in parts:
                yield polygon(str(path), rings, properties, f"area_{number + 1}")
        elif properties.get("role"):
            # a no-fly zone that is left out is flown into
            role = str(properties["role"])[:40]
            raise InputError(
                f"{path}: features[{number}] has the role {role!r} but is a {str(kind)[:40]}; "
                f"draw a polygon"
            )


def features(path: Path, data: dict[str, Any]) -> list[dict[str, Any]]:
    """The features of a file, each with a geometry and properties that are objects.

    Args:
        path: The file, for messages.
        data: What it holds.

    Raises:
        InputError: It is no GeoJSON, or not in degrees.
    """
    crs = json.dumps(data["crs"])[:60] if data.get("crs") else None
    if crs and not _WGS_84.search(crs):
        raise InputError(f"{path}: crs {crs} is not WGS 84; export it in EPSG:4326")
    found = data.get("features") if data.get("type") == "FeatureCollection" else [data]
    if not isinstance(found, list):
        raise InputError(f"{path}: has no list of features; export it as GeoJSON")
    result = []
    for number, feature in enumerate(found):
        if not isinstance(feature, dict):
            raise InputError(f"{path}: features[{number}] is no object; export it again")
        geometry = feature.get("geometry") if feature.get("type") == "Feature" else feature
        properties = feature.get("properties")
        if isinstance(geometry, dict):
            result.append(
                {
                    "id": feature.get("id", number),
                    "geometry": geometry,
                    "properties": properties if isinstance(properties, dict) else {},
                }
            )
    return result


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

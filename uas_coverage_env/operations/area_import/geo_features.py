"""What readers of files hand on: features with a geometry, attributes, and where they came from."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.osm_tags import plain_tags

Shape = Literal["polygon", "closed line", "line", "point", "nothing"]

CLOSED_M, CLOSED_SHARE = 1.0, 0.02
"""A line is closed where its ends are so close, or by this share of its length."""

_DEEPEST = 20
_METRES_PER_DEGREE = 111_320.0


@dataclass(frozen=True)
class GeoFeature:
    """A thing in a file.

    Attributes:
        file: Where it is from, for messages.
        place: Which of the file it is: `features[3]`.
        geometry: As in GeoJSON; None: it has none.
        attributes: What the file says of it; keys in small letters, nothing empty.
        folders: Names of what it lies in, the innermost first.
        layers: Names of the file and its layer: they count where they say nothing but a role.
        fallback: Name of an area where the file gives none.
        what: What it is, where it is none of the geometries: `NetworkLink`.
        together: Fences with the same one are one, of several parts; empty: those of the feature.
        along: Whether it is what lies along its line even where that is closed.
        ground_m: Height of the ground there above mean sea level, where the file says it [m].
    """

    file: str
    place: str
    geometry: Any
    attributes: Mapping[str, Any]
    folders: tuple[str, ...] = ()
    layers: tuple[str, ...] = ()
    fallback: str = ""
    what: str = ""
    together: str = ""
    along: bool = False
    ground_m: float | None = None

    @property
    def name(self) -> str:
        """As drawn; empty where it has none."""
        given = (self.attributes.get(key) for key in ("name", "title", "label"))
        return next((" ".join(str(one).split())[:80] for one in given if one), "")

    @property
    def source(self) -> str:
        """File and name, for messages."""
        return f"{self.file}: {self.name!r}" if self.name else f"{self.file}: {self.place}"


class Part(NamedTuple):
    """A simple geometry of a feature.

    Attributes:
        shape: What it is.
        positions: Rings of a polygon, or the places of a line or point: (longitude, latitude, ...).
        kind: The geometry's own word, for messages.
    """

    shape: Shape
    positions: Any
    kind: str


def attributes_of(*tables: Any) -> dict[str, Any]:
    """Attributes with plain keys; of tables that have the same key the first one counts.

    Args:
        *tables: Mappings; what is none is passed over. One in the attribute `tags` counts too.
    """
    found: dict[str, Any] = {}
    for table in tables:
        if isinstance(table, Mapping):
            plain = plain_tags(table)
            nested = plain.pop("tags", None)
            found = {**(plain_tags(nested) if isinstance(nested, Mapping) else {}), **plain} | found
    return found


def parts_of(feature: GeoFeature) -> Iterator[Part]:
    """The simple geometries of a feature; one of `nothing` where it has no place.

    Raises:
        InputError: A geometry is no geometry.
    """
    found = list(_parts(feature, feature.geometry, 0))
    yield from found or [Part("nothing", (), feature.what or "empty geometry")]


def _parts(feature: GeoFeature, geometry: Any, depth: int) -> Iterator[Part]:
    if geometry is None or geometry == {}:
        return
    if not isinstance(geometry, Mapping) or depth > _DEEPEST:
        raise InputError(f"{feature.source} has no geometry that can be read; export it again")
    kind = str(geometry.get("type"))[:40]
    if kind == "GeometryCollection":
        for one in _list(feature, geometry.get("geometries"), "no list of geometries"):
            yield from _parts(feature, one, depth + 1)
        return
    if kind not in _SIMPLE:
        raise InputError(f"{feature.source} is a {kind}, which is not read; draw a polygon")
    shape, many = _SIMPLE[kind]
    what = "no rings" if shape == "polygon" else "a broken coordinate"
    given = _list(feature, geometry.get("coordinates"), what)
    for one in given if many else [given]:
        places = _list(feature, one, what)
        if shape == "polygon":
            rings = [ring for ring in (_list(feature, ring, what) for ring in places) if ring]
            if rings and places[0]:
                yield Part("polygon", rings, kind)
        elif places and shape == "point":
            yield Part("point", [places], kind)
        elif places:
            yield Part("closed line" if _closed(places) else "line", places, kind)


_SIMPLE: Mapping[str, tuple[Shape, bool]] = {
    "Polygon": ("polygon", False),
    "MultiPolygon": ("polygon", True),
    "LineString": ("line", False),
    "MultiLineString": ("line", True),
    "Point": ("point", False),
    "MultiPoint": ("point", True),
}
"""Type of a geometry -> what it is made of, and whether of many."""

GEOMETRIES = (*_SIMPLE, "GeometryCollection")


def _list(feature: GeoFeature, given: Any, what: str) -> list[Any]:
    if given is None:
        return []
    if not isinstance(given, list | tuple):
        raise InputError(f"{feature.source} has {what}; export it again")
    return list(given)


def _closed(places: list[Any]) -> bool:
    """Whether a line ends about where it begins; what is no line is not."""
    try:
        lon_lat = np.array([place[:2] for place in places], dtype=np.float64)
    except (TypeError, ValueError, KeyError, OverflowError):
        return False  # it is refused where it is used
    if lon_lat.ndim != 2 or lon_lat.shape[1] != 2 or len(np.unique(lon_lat, axis=0)) < 3:
        return False
    lon_lat = np.column_stack([np.unwrap(lon_lat[:, 0], period=360.0), lon_lat[:, 1]])
    scale = _METRES_PER_DEGREE * np.array([np.cos(np.radians(lon_lat[0, 1])), 1.0])
    local_m = (lon_lat - lon_lat[0]) * scale
    length_m = np.hypot(*np.diff(local_m, axis=0).T).sum()
    return bool(np.hypot(*local_m[-1]) <= max(CLOSED_M, CLOSED_SHARE * length_m))

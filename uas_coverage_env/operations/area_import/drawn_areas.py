"""What a person drew on a map, in degrees: polygons, take-off places, and what was left out."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from shapely.geometry import Polygon

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.area_options import (
    NAMES,
    NO_OPTIONS,
    AreaOptions,
    area_options_of,
)
from uas_coverage_env.operations.area_import.buffers import Rings, circle, strip
from uas_coverage_env.operations.area_import.feature_roles import ROLES, Meaning, meaning_of
from uas_coverage_env.operations.area_import.geo_features import GeoFeature, Part, parts_of
from uas_coverage_env.operations.area_import.length_texts import length_m, length_with_unit_m
from uas_coverage_env.operations.area_import.osm_tags import LEAST_M, OTHER, half_width_m, height_m

MOST_CORNERS = 100_000
_HEAVIEST = 1e6
_WIDEST_M = 20_000.0


class Solid(NamedTuple):
    """What stands on an outline.

    Attributes:
        kind: Of the obstacle that it becomes.
        height_m: Of its top above the ground [m].
        known: Whether the file says its height; otherwise it is that of its kind.
    """

    kind: str
    height_m: float
    known: bool


@dataclass(frozen=True, eq=False)
class DrawnPolygon:
    """A polygon with holes.

    Attributes:
        source: File and name, for messages.
        name: As drawn.
        role: What it is for.
        weight: Of the waypoints in it [-].
        outer: (N, 2) latitude and longitude of the corners [degrees].
        holes: The same of each hole.
        camera: Name of the one that is to see it; None: the usual one.
        options: How it is to be looked at.
        solid: What stands on it, where it is an obstacle.
        together: Fences with the same one are one, of several parts.
    """

    source: str
    name: str
    role: Literal["search", "no_fly", "fence", "obstacle"]
    weight: float
    outer: NDArray[np.float64]
    holes: tuple[NDArray[np.float64], ...] = ()
    camera: str | None = None
    options: AreaOptions = NO_OPTIONS
    solid: Solid | None = None
    together: str = ""


@dataclass(frozen=True)
class TakeOff:
    """A place to take off from and to land at.

    Attributes:
        source: File and name, for messages.
        latitude_deg: [degrees].
        longitude_deg: [degrees].
        height_m: Of its ground above mean sea level [m]; None where the file does not say.
        name: As drawn; empty where it has none.
        said: Whether the file says that it is one; otherwise it is a point that says nothing.
    """

    source: str
    latitude_deg: float
    longitude_deg: float
    height_m: float | None = None
    name: str = field(default="", compare=False)
    said: bool = field(default=True, compare=False)


class LeftOut(NamedTuple):
    """Something in a file that does no harm where it is passed over.

    Attributes:
        what: `point`, `line`, `empty geometry`, `NetworkLink`.
        name: As drawn; empty where it has none.
    """

    what: str
    name: str


class Remark(NamedTuple):
    """Something that is to be said of a file.

    Attributes:
        text: A line.
    """

    text: str


Drawn = DrawnPolygon | TakeOff | LeftOut | Remark


def drawn_of(feature: GeoFeature, *, on_map: bool = False) -> Iterator[Drawn]:
    """What a feature becomes, by the table of roles.

    Args:
        feature: As a reader hands it on.
        on_map: It is from a map of what stands there (`meaning_of`).

    Raises:
        InputError: It says something that cannot be kept.
    """
    parts = list(parts_of(feature))
    has_area = any(part.shape == "polygon" for part in parts)
    for part in parts:
        if has_area and part.shape == "point":  # where programs write its label
            yield LeftOut("label of a polygon", feature.name)
            continue
        meaning = meaning_of(feature, part.shape, on_map=on_map)
        if part.shape == "closed line" and (feature.along or (meaning.solid or OTHER).along):
            part = part._replace(shape="line")
            meaning = meaning_of(feature, part.shape, on_map=on_map)
        if meaning.against:
            yield Remark(f"{feature.source}: {meaning.said_by} counts, against {meaning.against}")
        yield from _MAKE[meaning.becomes](feature, part, meaning)


def limited(source: str, things: Iterable[Drawn]) -> Iterator[Drawn]:
    """The same things, as long as they have no more corners than anyone draws.

    Raises:
        InputError: They have more.
    """
    corners = 0
    for thing in things:
        if isinstance(thing, DrawnPolygon):
            corners += sum(map(len, (thing.outer, *thing.holes)))
        if corners > MOST_CORNERS:
            raise InputError(
                f"{source}: has more than {MOST_CORNERS} corners; simplify it, or save it alone"
            )
        yield thing


def _area(feature: GeoFeature, part: Part, meaning: Meaning) -> Iterator[Drawn]:
    source, name = _named(feature)
    outer, holes = _rings(source, part)
    weight = _weight(source, feature.attributes.get("weight"))
    yield DrawnPolygon(
        source,
        name,
        "search",
        weight,
        outer,
        holes,
        _camera(feature),
        area_options_of(source, feature.attributes),
    )


def _zone(feature: GeoFeature, part: Part, meaning: Meaning) -> Iterator[Drawn]:
    source, name = _named(feature)
    _check_not_seen(source, feature)
    outer, holes = _rings(source, part)
    yield DrawnPolygon(source, name, "no_fly", 1.0, outer, holes)


def _fence(feature: GeoFeature, part: Part, meaning: Meaning) -> Iterator[Drawn]:
    source, name = _named(feature)
    _check_not_seen(source, feature)
    outer, holes = _rings(source, part)
    together = feature.together or f"{feature.file}, {feature.place}"
    yield DrawnPolygon(source, name, "fence", 1.0, outer, holes, together=together)


def _obstacle(feature: GeoFeature, part: Part, meaning: Meaning) -> Iterator[Drawn]:
    source, name = _named(feature)
    what = meaning.solid or OTHER
    _check_not_seen(source, feature, but="height_m")
    top_m, known = height_m(feature.attributes, what.guessed_m)
    named_m = length_with_unit_m(feature.name)
    if not known and named_m >= LEAST_M:  # `Chimney 85 m`
        top_m, known = named_m, True
    said = feature.attributes.get("height", feature.attributes.get("height_m"))
    is_area = part.shape in ("polygon", "closed line")
    if is_area and not known and not meaning.sure:
        raise InputError(
            f"{source}: {meaning.said_by} says an obstacle, but its height is not given; give "
            f"height_m (of its top above the ground), or the role search"
        )
    if math.isnan(top_m):
        why = f"the height {str(said)[:40]!r} cannot be read" if said else "has no height"
        raise InputError(
            f"{source}: is an obstacle by {meaning.said_by}, but {why}; give height_m (of its top "
            f"above the ground), or another role"
        )
    if said is not None and not known:
        yield Remark(f"{source}: the height {str(said)[:40]!r} cannot be read; taken: {top_m:g} m")
    solid = Solid(what.kind, top_m, known)
    if is_area:
        outlines = [_rings(source, part)]
    else:
        wide_m = half_width_m(feature.attributes, what)
        given = [
            key for key in ("radius_m", "radius", "diameter", "width") if key in feature.attributes
        ]
        if what == OTHER and not given:
            raise InputError(
                f"{source}: is an obstacle by {meaning.said_by}, but it is a {part.kind}; draw a "
                f"polygon, or give {'radius_m' if part.shape == 'point' else 'width'}"
            )
        places = _degrees(source, part.positions)
        if part.shape == "point" or len(np.unique(places, axis=0)) < 2:
            found = [circle(places[0], wide_m, around=True)]
        else:
            found = strip(places, wide_m, beyond=True)
        outlines = [(outer, tuple(holes)) for outer, *holes in found]
    for outer, holes in outlines:
        yield DrawnPolygon(source, name, "obstacle", 1.0, outer, holes, solid=solid)


def _take_off(feature: GeoFeature, part: Part, meaning: Meaning) -> Iterator[Drawn]:
    latitude, longitude = _degrees(feature.source, part.positions)[0].tolist()
    source = feature.source if feature.name else feature.file
    said = meaning.role == "home"
    yield TakeOff(source, latitude, longitude, feature.ground_m, feature.name, said)


def _left_out(feature: GeoFeature, part: Part, meaning: Meaning) -> Iterator[Drawn]:
    if part.shape != "nothing":
        what = {"closed line": "line"}.get(part.shape, part.shape)
    else:
        what = part.kind
    yield LeftOut(what, feature.name)


def _refused(feature: GeoFeature, part: Part, meaning: Meaning) -> Iterator[Drawn]:
    source, said = feature.source, f"{meaning.said_by} says {meaning.role}"
    if meaning.role == "home":
        raise InputError(f"{source}: {said}, but it is a {part.kind}; draw a point")
    if part.shape == "nothing":
        what = f"it is a {part.kind}, which is not read" if feature.what else "it has no place"
        raise InputError(f"{source}: {said}, but {what}; draw a polygon, or remove it")
    outlines = _outlines(feature, part, around=meaning.role == "no_fly")
    if not outlines:
        how = {"point": ", or give radius_m", "line": ", or give its width"}[part.shape]
        raise InputError(f"{source}: {said}, but it is a {part.kind}; draw a polygon{how}")
    becomes = _MAKE[ROLES[meaning.role or "search"].polygon]
    for rings in outlines:
        turned = [ring[:, ::-1].tolist() for ring in rings]
        yield from becomes(feature, part._replace(shape="polygon", positions=turned), meaning)


def _outlines(feature: GeoFeature, part: Part, *, around: bool) -> list[Rings]:
    """Outlines of a point with a radius, or of a line with a width; none, where it has none."""
    point = part.shape == "point"
    keys = ("radius_m", "radius") if point else ("width_m", "width")
    given = next((feature.attributes[key] for key in keys if key in feature.attributes), None)
    if given is None:
        return []
    size_m = length_m(given)
    if not 0.0 < size_m <= _WIDEST_M:
        raise InputError(f"{feature.source}: {keys[1]} {str(given)[:40]!r}; give it in metres")
    places = _degrees(feature.source, part.positions)
    if point:
        return [circle(places[0], size_m, around=around)]
    return strip(places, 0.5 * size_m, beyond=around)


_MAKE: Mapping[str, Callable[[GeoFeature, Part, Meaning], Iterator[Drawn]]] = {
    "area": _area,
    "zone": _zone,
    "fence": _fence,
    "obstacle": _obstacle,
    "take-off place": _take_off,
    "left out": _left_out,
    "refused": _refused,
}


def _named(feature: GeoFeature) -> tuple[str, str]:
    """File and name for messages, and the name."""
    name = feature.name or feature.fallback or feature.place
    return f"{feature.file}: {name!r}", name


def _rings(source: str, part: Part) -> tuple[NDArray[np.float64], tuple[NDArray[np.float64], ...]]:
    """Outer ring and holes of a polygon or closed line."""
    rings = part.positions if part.shape == "polygon" else [part.positions]
    outer, *holes = (_ring(source, ring) for ring in rings)
    if part.shape == "closed line" and not Polygon(outer).is_valid:
        outer = _ring(source, part.positions[:-1])  # its end went a little too far
    return outer, tuple(holes)


def _camera(feature: GeoFeature) -> str | None:
    given = feature.attributes.get("camera")
    return str(given).strip()[:80] or None if given is not None else None


def _check_not_seen(source: str, feature: GeoFeature, but: str = "") -> None:
    """What is no area to be seen asks for nothing of the kind."""
    camera = _camera(feature)
    if camera:
        raise InputError(f"{source} is no area to be seen, but names the camera {camera!r}")
    said = [name for name in NAMES if name != but and name in feature.attributes]
    if said:
        raise InputError(f"{source} is no area to be seen, but has {', '.join(said)}")


def _weight(source: str, given: Any) -> float:
    if given is None or given == "":
        return 1.0
    try:
        weight = math.nan if isinstance(given, bool) else float(given)
    except (TypeError, ValueError, OverflowError):
        weight = math.nan
    if not 0.0 < weight <= _HEAVIEST:
        raise InputError(
            f"{source}: weight {str(given)[:40]!r} should be a number greater than 0, at most "
            f"{_HEAVIEST:g}"
        )
    return weight


def _ring(source: str, positions: Any) -> NDArray[np.float64]:
    corners = _degrees(source, positions)
    if len(np.unique(corners, axis=0)) < 3:
        raise InputError(f"{source} has fewer than three corners; draw a closed polygon")
    return corners


def _degrees(source: str, positions: Any) -> NDArray[np.float64]:
    """(N, 2) latitude and longitude of a list of (longitude, latitude, ...)."""
    try:
        points = np.array([position[:2] for position in positions])
        if points.dtype.kind not in "iuf" or points.ndim != 2 or points.shape[1] != 2:
            raise ValueError
        points = points.astype(np.float64)
        if not np.isfinite(points).all():
            raise ValueError
    except (TypeError, ValueError, KeyError, OverflowError):
        raise InputError(f"{source} has a broken coordinate; export it again") from None
    longitude, latitude = points.T
    if np.abs(points).max() > 180.0:
        worst = points.flat[np.abs(points).argmax()]
        raise InputError(
            f"{source} has the coordinate {worst:.10g}, which is no degree; export it in WGS 84 "
            f"(EPSG:4326)"
        )
    if np.abs(latitude).max() > 90.0:
        worst = latitude[np.abs(latitude).argmax()]
        raise InputError(
            f"{source} has the latitude {worst:.10g}; latitude and longitude seem to be swapped"
        )
    return np.column_stack([latitude, longitude])

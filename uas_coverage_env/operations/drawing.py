"""What a person drew on a map: polygons and take-off places in degrees, from any file format."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.plain_files import read_bytes
from uas_coverage_env.operations.wishes import NAMES, NOTHING, Wishes, wishes_of

Role = Literal["search", "no_fly", "fence"]

MOST_BYTES = 20_000_000
MOST_CORNERS = 100_000
_HEAVIEST = 1e6

_SPELLINGS: dict[Role | Literal["home"], tuple[str, ...]] = {
    "search": ("search", "survey", "area"),
    "no_fly": ("no_fly", "nofly", "keep_out", "exclusion"),
    "fence": ("fence", "geofence"),
    "home": ("home", "take_off", "takeoff", "launch"),
}
_ROLES: dict[str, Role | Literal["home"]] = {
    written: role for role, spellings in _SPELLINGS.items() for written in spellings
}
"""How roles are written in files, `-` and spaces read as `_`."""


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
        wishes: How it is to be looked at.
    """

    source: str
    name: str
    role: Role
    weight: float
    outer: NDArray[np.float64]
    holes: tuple[NDArray[np.float64], ...] = ()
    camera: str | None = None
    wishes: Wishes = NOTHING


@dataclass(frozen=True)
class TakeOff:
    """A place to take off from and to land at.

    Attributes:
        source: File and name, for messages.
        latitude_deg: [degrees].
        longitude_deg: [degrees].
        height_m: Of its ground above mean sea level [m]; None where the file does not say.
    """

    source: str
    latitude_deg: float
    longitude_deg: float
    height_m: float | None = None


Drawn = DrawnPolygon | TakeOff


def polygon(
    source: str, rings: Iterable[Any], attributes: Mapping[str, Any], fallback_name: str
) -> DrawnPolygon:
    """A polygon from the rings of a file, checked as far as degrees tell.

    Args:
        source: The file.
        rings: Outer ring and holes, each a list of (longitude, latitude, ...).
        attributes: `name`, `role`, `weight`, `camera` and those of `wishes.NAMES`, where the file
            has them.
        fallback_name: Where it has no name.

    Raises:
        InputError: Something in it is wrong.
    """
    name = str(attributes.get("name") or attributes.get("title") or fallback_name)[:80]
    source = f"{source}: {name!r}"
    role = _role(source, name, attributes.get("role"))
    if role == "home":
        raise InputError(f"{source} is a take-off place but drawn as a polygon; draw a point")
    outer, *holes = (_ring(source, ring) for ring in rings)
    weight, camera = _weight(source, attributes.get("weight")), attributes.get("camera")
    camera = str(camera).strip()[:80] or None if camera is not None else None
    if camera and role != "search":
        raise InputError(f"{source} is no area to be seen, but names the camera {camera!r}")
    wishes = wishes_of(source, attributes)
    if wishes != NOTHING and role != "search":
        said = ", ".join(name for name in NAMES if attributes.get(name) not in (None, ""))
        raise InputError(f"{source} is no area to be seen, but has {said}")
    return DrawnPolygon(source, name, role, weight, outer, tuple(holes), camera, wishes)


def take_off(source: str, position: Any, attributes: Mapping[str, Any]) -> TakeOff:
    """A take-off place from (longitude, latitude, ...).

    Args:
        source: The file.
        position: Longitude and latitude, maybe more.
        attributes: `name` and `role`, where the file has them.

    Raises:
        InputError: It is no place on the Earth, or drawn for something else.
    """
    name = str(attributes.get("name") or "")[:80]
    source = f"{source}: {name!r}" if name else source
    if attributes.get("role") and _role(source, name, attributes["role"]) != "home":
        raise InputError(f"{source} has the role of an area but is a point; draw a polygon")
    latitude, longitude = _degrees(source, [position])[0]
    return TakeOff(source, float(latitude), float(longitude))


def content(path: Path) -> bytes:
    """What a file holds, if it is a plain one and not larger than anything drawn.

    Raises:
        InputError: It is not, or cannot be read.
    """
    try:
        return read_bytes(path, MOST_BYTES)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path") from None
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"{path}: cannot be read ({reason}); check the path") from None


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


def _role(source: str, name: str, given: Any) -> Role | Literal["home"]:
    if given is None or given == "":
        written = _plain(name)
        # what a map program cannot tag is told by its name: "no-fly school", "fence"
        for role in ("no_fly", "nofly", "keep_out", "fence", "geofence"):
            if written.startswith(role):
                return _ROLES[role]
        return "search"
    try:
        return _ROLES[_plain(str(given))]
    except KeyError:
        known = ", ".join(dict.fromkeys(_ROLES.values()))
        raise InputError(f"{source}: unknown role {str(given)[:40]!r}; take {known}") from None


def _plain(text: str) -> str:
    return text.strip().lower().replace("-", "_").replace(" ", "_")


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

"""Missions in a plane: `[planar]`, in which all UAS keep one height.

An earlier version of the paper's planner plans two-dimensional paths indoors (Gasche et al.,
Sec. III). The vertical axis is a constraint here, not a controller: height and vertical speed are
fixed, and lift is what carries the weight at the tilt that is flown.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.geometry import ConvexPolytope

_UPRIGHT = 1e-9
_TALL_M = 100.0
_AWAY_M = np.array([1e6, 0.0, 1e6])  # beyond all coordinates of scenario files, and below
_SAME_HEIGHT_M = 1e-9

PLACES: Mapping[str, tuple[str, ...]] = {
    "uas": ("start_m", "land_m"),
    "waypoints": ("position_m",),
    "events": ("position_m", "alternative_m"),
}
"""Table -> keys of places at which UAS start, land or cover."""


class Planar(StrictModel):
    """All UAS fly at one height.

    Attributes:
        height_m: Above the ground, z = 0; of starts, landing places and waypoints as well [m].
    """

    height_m: Annotated[float, Field(gt=0.0, le=10_000.0)]

    def kept(self, hull: ConvexPolytope, distance_m: float) -> ConvexPolytope:
        """What commands at this height keep a distance from, instead of a hull.

        It is upright, and far taller than anything. A place at the height keeps the distance from
        it exactly where it keeps it from the hull.

        Args:
            hull: The hull.
            distance_m: Kept from every face [m].

        Returns:
            The body; far below and beside everything, where all places at the height keep the
            distance anyway.
        """
        level = np.hypot(hull.normals[:, 0], hull.normals[:, 1])
        # d_h of a place at the height, without its horizontal part
        at_height_m = hull.offsets_m - hull.normals[:, 2] * self.height_m
        sides = level > _UPRIGHT
        normals = hull.normals[sides, :2] / level[sides, None]
        # a slanted face keeps the distance at a right angle, which is farther along the plane
        offsets_m = (at_height_m[sides] - distance_m) / level[sides] + distance_m
        outline_m = _polygon(normals, offsets_m) or _polygon(normals, offsets_m - distance_m)
        if (at_height_m[~sides] >= distance_m).any() or not outline_m:
            return ConvexPolytope(
                hull.normals, hull.offsets_m - hull.normals @ _AWAY_M, hull.vertices_m + _AWAY_M
            )
        low_m, high_m = -self.height_m + _TALL_M, -self.height_m - _TALL_M
        upright = np.column_stack([normals, np.zeros(len(normals))])
        return ConvexPolytope(
            np.vstack([upright, [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]]),
            np.append(offsets_m, [high_m, -low_m]),
            np.array([(*place_m, z) for z in (low_m, high_m) for place_m in outline_m]),
        )

    def section(self, body: ConvexPolytope) -> ConvexPolytope:
        """What of a body's faces tells places at this height apart: those that are not level.

        Their normals are level and shorter than 1 where the face is slanted, so that distances are
        those from the body's own faces.
        """
        sides = np.hypot(body.normals[:, 0], body.normals[:, 1]) > _UPRIGHT
        normals = body.normals[sides] * (1.0, 1.0, 0.0)
        offsets_m = body.offsets_m - body.normals[:, 2] * self.height_m
        return ConvexPolytope(normals, offsets_m[sides], body.vertices_m)


def completed(data: Mapping[str, Any]) -> Mapping[str, Any]:
    """The data of a file in which places of a planar mission have their height.

    Where the mission is planar, places may be given by north and east alone. What is wrong
    otherwise is left to the fields' own checks.
    """
    planar = data.get("planar")
    height_m = planar.get("height_m") if isinstance(planar, Mapping) else None
    if not isinstance(height_m, int | float) or isinstance(height_m, bool):
        return data
    whole = dict(data)
    for table, keys in PLACES.items():
        if isinstance(data.get(table), list | tuple):
            whole[table] = [_with_height(entry, keys, -height_m) for entry in data[table]]
    return whole


def _with_height(entry: Any, keys: Iterable[str], down_m: float) -> Any:
    if not isinstance(entry, Mapping):
        return entry
    places = {key: entry.get(key) for key in keys}
    level = {k: p for k, p in places.items() if isinstance(p, list | tuple) and len(p) == 2}
    return {**entry, **{key: [*place, down_m] for key, place in level.items()}}


def off_height(
    planar: Planar, table: str, key: str, places_m: Iterable[tuple[float, float, float]]
) -> Iterator[str]:
    """One line for each place that does not lie at the height of a planar mission.

    Args:
        planar: The table.
        table: Where the places are given.
        key: Likewise.
        places_m: North, east, down [m].
    """
    for index, place_m in enumerate(places_m):
        if abs(place_m[2] + planar.height_m) > _SAME_HEIGHT_M:
            yield (
                f"{table}[{index}].{key}: z = {place_m[2]:g} is not at planar.height_m "
                f"{planar.height_m:g}; give north and east alone, or z = {-planar.height_m:g}"
            )


def _polygon(normals: NDArray[Any], offsets_m: NDArray[Any]) -> list[tuple[float, float]]:
    """Corners of {p : normals · p + offsets_m ≤ 0} in the plane; none where it has no area.

    Sides are few: each pair of them is looked at.
    """
    corners: list[tuple[float, float]] = []
    for a in range(len(normals)):
        for b in range(a):
            turn = normals[b, 0] * normals[a, 1] - normals[b, 1] * normals[a, 0]
            if abs(turn) < _UPRIGHT:
                continue
            north = (normals[b, 1] * offsets_m[a] - normals[a, 1] * offsets_m[b]) / turn
            east = (normals[a, 0] * offsets_m[b] - normals[b, 0] * offsets_m[a]) / turn
            away_m = normals @ (north, east) + offsets_m
            if away_m.max() <= 1e-7:
                corners.append((float(north), float(east)))
    return corners if len(corners) > 2 else []

"""The site of a mission in local metres: what is searched, the fence, what stands in the way."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import shapely
from shapely.geometry import Point, Polygon
from shapely.geometry.base import BaseGeometry

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.area_options import NO_OPTIONS, AreaOptions
from uas_coverage_env.operations.area_import.drawn_areas import (
    Drawn,
    DrawnPolygon,
    LeftOut,
    TakeOff,
)
from uas_coverage_env.operations.area_import.local_polygons import (
    frame_around,
    local_place,
    local_polygon,
)
from uas_coverage_env.operations.area_import.osm_tags import BUILDING, FOREST, STRUCTURE
from uas_coverage_env.operations.area_import.prisms import Standing, prisms
from uas_coverage_env.operations.convex import convex_pieces, hull_of, without_holes
from uas_coverage_env.operations.geodesy import LocalFrame

SAFE_DISTANCE_M = 3.0
"""Kept from buildings and no-fly zones: as much as satellite navigation may be off."""

FENCE_MARGIN_M = 0.5
FENCE_AROUND_M = 25.0
"""Between areas or take-off places and a fence that was not drawn."""

LARGEST_UAS_M = 0.5
"""Radius for which gaps between buildings are judged."""

_MERGED = (BUILDING, FOREST, STRUCTURE)
_FENCE_DETAIL_M = 3.0
_ABOVE_CEILING_M = 5.0
_SLIVER_M, _EDGE_M = 0.25, 0.1
_NO_FLY_SLACK, _BUILDING_GAP_M = 1.02, 2.0 * (SAFE_DISTANCE_M + LARGEST_UAS_M)


@dataclass(frozen=True, eq=False)
class Wall:
    """An upright convex prism from the ground.

    Attributes:
        kind: Of the obstacle that it becomes.
        footprint: x east, y north [m].
        top_m: Above the ground [m].
        safe_distance_m: Kept from it in addition to the radius of a UAS [m].
    """

    kind: str
    footprint: Polygon
    top_m: float
    safe_distance_m: float


class Area(NamedTuple):
    """What is searched.

    Attributes:
        weight: Of the waypoints in it [-].
        shape: Polygons (x east, y north) [m].
        camera: Name of the one that is to see it; None: the usual one.
        source: File and name, for messages.
        options: How it is to be looked at.
    """

    weight: float
    shape: BaseGeometry
    camera: str | None
    source: str
    options: AreaOptions = NO_OPTIONS


@dataclass(frozen=True, eq=False)
class MissionSite:
    """A site in local metres, x east, y north.

    Attributes:
        frame: Where on the Earth it is.
        areas: What is searched; those for the same camera do not overlap.
        homes: The take-off places.
        homes_m: East and north of these.
        fence: Convex; what lies in it but outside the drawn fence is walled off.
        no_fly: Zones that no UAS flies into.
        outside_fence: Convex pieces of what lies in `fence`, but outside the drawn one.
        standing: What was drawn as standing there.
        outside: What was drawn as such or as a no-fly zone outside the fence.
        notes: What is to be said of it.
    """

    frame: LocalFrame
    areas: tuple[Area, ...]
    homes: tuple[TakeOff, ...]
    homes_m: tuple[tuple[float, float], ...]
    fence: Polygon
    no_fly: tuple[Polygon, ...]
    outside_fence: tuple[Polygon, ...]
    standing: tuple[Standing, ...] = ()
    outside: tuple[DrawnPolygon, ...] = ()
    notes: tuple[str, ...] = ()


def make_site(things: Sequence[Drawn], homes: Sequence[tuple[float, float]]) -> MissionSite:
    """The site that was drawn.

    Args:
        things: Polygons and take-off places.
        homes: Latitude and longitude of take-off places, in place of the drawn ones [degrees].

    Raises:
        InputError: Something in it cannot be meant.
    """
    frame = _with_height(frame_around(list(things)), things)
    polygons = [
        (thing, local_polygon(frame, thing)) for thing in things if isinstance(thing, DrawnPolygon)
    ]
    places = _take_off_places(things, homes, frame)
    homes_m = tuple(local_place(frame, place) for place in places)
    areas = _apart(
        [
            Area(t.weight, a, t.camera, t.source, t.options)
            for t, a in polygons
            if t.role == "search"
        ]
    )
    drawn_fence, notes = _drawn_fence([(t, area) for t, area in polygons if t.role == "fence"])
    fence = _fence(drawn_fence, areas, homes_m)
    within = (fence if drawn_fence.is_empty else drawn_fence).buffer(1.0)
    for thing, area in polygons:
        if thing.role == "search" and area.difference(within).area > 1.0:
            raise InputError(f"{thing.source} reaches beyond the fence; enlarge the fence")
    standing = [
        Standing(thing.solid.kind, area, thing.solid.height_m, thing.solid.known)
        for thing, area in polygons
        if thing.solid is not None
    ]
    return MissionSite(
        frame=frame,
        areas=areas,
        homes=places,
        homes_m=homes_m,
        fence=fence,
        no_fly=tuple(area for thing, area in polygons if thing.role == "no_fly"),
        outside_fence=tuple(_outside(fence, drawn_fence)),
        standing=tuple(standing),
        outside=tuple(
            thing
            for thing, area in polygons
            if thing.role in ("no_fly", "obstacle") and not area.intersects(fence)
        ),
        notes=tuple(notes),
    )


def zone_walls(site: MissionSite, more: Sequence[Polygon], ceiling_m: float) -> list[Wall]:
    """Walls that reach beyond the ceiling: no-fly zones, and what is outside the drawn fence.

    Args:
        site: The site.
        more: Further no-fly zones (x east, y north) [m].
        ceiling_m: Top of the fence above the ground [m].
    """
    top_m = ceiling_m + _ABOVE_CEILING_M

    def no_fly(zones: Sequence[Polygon]) -> list[Wall]:
        pieces = [piece for zone in zones for piece in convex_pieces(zone, _NO_FLY_SLACK)]
        return [Wall("no_fly", piece, top_m, SAFE_DISTANCE_M) for piece in pieces]

    outside = [Wall("outside_fence", piece, top_m, FENCE_MARGIN_M) for piece in site.outside_fence]
    drawn = [*no_fly(site.no_fly), *outside]
    return [wall for wall in drawn if wall.footprint.intersects(site.fence)] + no_fly(more)


def town_walls(standing: Sequence[Standing], fence: Polygon) -> list[Wall]:
    """Walls that hold all that stands within a fence; what may be many and close is merged."""
    merged = [
        prism
        for kind in _MERGED
        for prism in prisms([thing for thing in standing if thing.kind == kind], _BUILDING_GAP_M)
    ]
    single = [thing for thing in standing if thing.kind not in _MERGED]
    return [
        Wall(thing.kind, hull_of(thing.footprint), thing.height_m, SAFE_DISTANCE_M)
        for thing in (*merged, *single)
        if thing.footprint.intersects(fence)
    ]


def _drawn_fence(drawn: Sequence[tuple[DrawnPolygon, Polygon]]) -> tuple[BaseGeometry, list[str]]:
    """Where UAS stay by all fences that were drawn, and how several are taken."""
    groups: dict[str, list[Polygon]] = {}
    for thing, shape in drawn:
        groups.setdefault(thing.together, []).append(shape)
    fences = [shapely.union_all(parts) for parts in groups.values()]
    if not fences:
        return Polygon(), []
    within = shapely.intersection_all(fences)
    source = drawn[0][0].source
    if within.area < 1.0:
        raise InputError(
            f"{source}: the {len(fences)} fences have no ground in common, and UAS stay in each; "
            f"draw one fence around all of it"
        )
    if len(fences) > 1:
        return within, [f"{len(fences)} fences: UAS stay in all of them at once, as ArduPilot does"]
    if len(drawn) > 1:
        return within, [f"{len(drawn)} fences are taken as one: UAS stay in any, as PX4 does"]
    return within, []


def _with_height(frame: LocalFrame, things: Sequence[Drawn]) -> LocalFrame:
    """The frame with the height of the ground that a file tells with a take-off place."""
    for thing in things:
        if isinstance(thing, TakeOff) and thing.height_m is not None:
            if not -1_000.0 <= thing.height_m <= 10_000.0:
                raise InputError(f"{thing.source}: height {thing.height_m:g} m is on no ground")
            return frame.at_height(thing.height_m)
    return frame


def _take_off_places(
    things: Sequence[Drawn], homes: Sequence[tuple[float, float]], frame: LocalFrame
) -> tuple[TakeOff, ...]:
    """The take-off places: given ones, else points said to be, else those that say nothing."""
    drawn = [thing for thing in things if isinstance(thing, TakeOff)]
    said = [place for place in drawn if place.said]
    places = tuple([TakeOff("--home", *home) for home in homes] or said or drawn)
    if not places:
        points = [
            thing.name for thing in things if isinstance(thing, LeftOut) and thing.what == "point"
        ]
        other = f" (no take-off places: {', '.join(map(repr, points[:3]))})" if points else ""
        middle = f"{frame.place.latitude_deg:.5f},{frame.place.longitude_deg:.5f}"
        raise InputError(
            f"no take-off place: draw a point, or give --home LAT,LON near the areas, whose middle "
            f"is {middle}{other}"
        )
    return places


def _outside(fence: Polygon, drawn: BaseGeometry) -> list[Polygon]:
    """Convex pieces of a fence that are outside the drawn one; none where none was drawn."""
    if drawn.is_empty:
        return []
    return [
        piece
        for part in shapely.get_parts(fence.difference(drawn))
        if isinstance(part, Polygon) and not part.buffer(-_SLIVER_M).is_empty
        for whole in without_holes(part)
        for piece in convex_pieces(whole, 1.0 + 1e-9)
    ]


def _apart(areas: list[Area]) -> tuple[Area, ...]:
    """The areas without what a heavier one for the same camera holds already."""
    result: list[Area] = []
    taken_by: dict[str | None, BaseGeometry] = {}
    for area in sorted(areas, key=lambda entry: -entry.weight):
        taken, left = taken_by.get(area.camera), area.shape
        if taken is not None:
            left = left.difference(taken)
            # what is thinner than can be drawn is where two edges nearly agree
            left = left.buffer(-_EDGE_M, join_style="mitre").buffer(_EDGE_M, join_style="mitre")
        if not left.is_empty:
            result.append(area._replace(shape=left))
        taken_by[area.camera] = area.shape if taken is None else taken.union(area.shape)
    return tuple(result)


def _fence(
    drawn: BaseGeometry, areas: tuple[Area, ...], homes_m: tuple[tuple[float, float], ...]
) -> Polygon:
    if drawn.is_empty:
        around = shapely.union_all([*(area.shape for area in areas), *map(Point, homes_m)])
        hull = around.convex_hull.buffer(FENCE_AROUND_M, quad_segs=2)
    else:
        hull = drawn.convex_hull
    # some of the corners of something convex: never larger than it
    return hull_of(hull.simplify(_FENCE_DETAIL_M))

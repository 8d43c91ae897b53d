"""Polygons cut into convex pieces that together hold them: obstacles of a scenario are convex."""

import heapq
import itertools
import math

import shapely
from shapely.affinity import rotate
from shapely.geometry import GeometryCollection, Polygon
from shapely.geometry.base import BaseGeometry

_SLIVER_M2 = 1e-6
_MOST_CORNERS = 8


def polygons_of(shape: BaseGeometry) -> list[Polygon]:
    """The polygons of any geometry, of collections within collections too."""
    if isinstance(shape, GeometryCollection):
        return [found for part in shape.geoms for found in polygons_of(part)]
    parts = shapely.get_parts(shape)
    return [part for part in parts if isinstance(part, Polygon) and not part.is_empty]


def without_holes(polygon: Polygon) -> list[Polygon]:
    """Polygons that have no holes and are together the given one; it, where it has none."""
    if not polygon.interiors:
        return [polygon]
    west, south, east, north = polygon.bounds
    cut = Polygon(polygon.interiors[0]).centroid.x
    halves = (shapely.box(west, south, cut, north), shapely.box(cut, south, east, north))
    parts = [part for half in halves for part in polygons_of(polygon.intersection(half))]
    return [piece for part in parts for piece in without_holes(part)]


def hull_of(shape: BaseGeometry) -> Polygon:
    """The convex hull of something that has an area."""
    hull = shape.convex_hull
    assert isinstance(hull, Polygon)
    return hull


def convex_pieces(polygon: Polygon, slack: float) -> list[Polygon]:
    """Convex polygons whose union holds a polygon; its holes are filled.

    Triangles of the polygon are merged, those first whose hull wastes least.

    Args:
        polygon: What is to be held.
        slack: A piece may have so many times the area of what it holds [-], at least 1.
    """
    solid = Polygon(polygon.exterior)
    if solid.convex_hull.area <= slack * solid.area:
        return [few_corners(hull_of(solid))]
    triangles = polygons_of(shapely.constrained_delaunay_triangles(solid))
    merged = _merged([t for t in triangles if t.area > _SLIVER_M2], slack)
    return [few_corners(piece) for piece in merged]


def few_corners(hull: Polygon) -> Polygon:
    """A convex polygon of at most 8 corners that holds the given one; it, where it has no more."""
    if len(hull.exterior.coords) - 1 <= _MOST_CORNERS:
        return hull
    rectangle = hull_of(shapely.minimum_rotated_rectangle(hull))
    (x0, y0), (x1, y1) = rectangle.exterior.coords[:2]
    angle_rad = math.atan2(y1 - y0, x1 - x0) + 0.25 * math.pi
    turned = rotate(hull, -angle_rad, origin=(0.0, 0.0), use_radians=True)
    # a box across the corners of the rectangle makes it an octagon
    across = rotate(shapely.box(*turned.bounds), angle_rad, origin=(0.0, 0.0), use_radians=True)
    return hull_of(rectangle.intersection(across))


def _merged(parts: list[Polygon], slack: float) -> list[Polygon]:
    """Hulls of neighbours merged greedily until each further merge would waste too much."""
    alive: dict[int, BaseGeometry] = dict(enumerate(parts))
    touching: dict[int, set[int]] = {i: set() for i in alive}
    tree = shapely.STRtree(parts)
    for i, j in zip(*tree.query(parts, predicate="intersects"), strict=True):
        if i < j and parts[i].intersection(parts[j]).length > 0.0:
            touching[int(i)].add(int(j))
            touching[int(j)].add(int(i))
    queue: list[tuple[float, int, int]] = []

    def offer(i: int, j: int) -> None:
        union = alive[i].union(alive[j])
        waste = union.convex_hull.area / union.area
        if waste <= slack:
            heapq.heappush(queue, (waste, i, j))

    for i, j in itertools.chain.from_iterable(
        ((i, j) for j in neighbours if i < j) for i, neighbours in touching.items()
    ):
        offer(i, j)
    fresh = itertools.count(len(parts))
    while queue:
        _, i, j = heapq.heappop(queue)
        if i not in alive or j not in alive:
            continue
        new = next(fresh)
        alive[new] = alive.pop(i).union(alive.pop(j))
        touching[new] = {k for k in touching[i] | touching[j] if k in alive}
        for k in touching[new]:
            touching[k].add(new)
            offer(k, new)
    return [hull_of(part) for part in alive.values()]

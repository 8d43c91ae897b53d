"""Buildings and trees as convex prisms: few that hold them all, as obstacles of a scenario are."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import shapely
from shapely.geometry import Polygon

from uas_coverage_env.operations.convex import convex_pieces, polygons_of

_LIKE_HEIGHT_M = 4.0
_SLACK = 1.25


@dataclass(frozen=True, eq=False)
class Standing:
    """Something that stands on the ground.

    Attributes:
        kind: Of the obstacle that it becomes.
        footprint: x east, y north [m].
        height_m: Of its top above the ground [m].
        known: Whether its tags say how high it is.
    """

    kind: str
    footprint: Polygon
    height_m: float
    known: bool = True


def prisms(things: Sequence[Standing], gap_m: float) -> list[Standing]:
    """Convex footprints that hold all of some things of one kind.

    Args:
        things: In local metres.
        gap_m: Things closer to each other than this are one block where they are of like
            height: a shed does not raise a house.
    """
    if not things:
        return []
    grown = [thing.footprint.buffer(gap_m / 2.0, join_style="mitre") for thing in things]
    group = list(range(len(things)))

    def root(i: int) -> int:
        while group[i] != i:
            i = group[i]
        return i

    near = shapely.STRtree(grown).query(grown, predicate="intersects").T.tolist()
    for i, j in near:
        if i < j and abs(things[i].height_m - things[j].height_m) <= _LIKE_HEIGHT_M:
            group[root(j)] = root(i)
    blocks: dict[int, list[int]] = {}
    for i in range(len(things)):
        blocks.setdefault(root(i), []).append(i)
    found = [
        prism
        for members in blocks.values()
        for prism in _block([things[i] for i in members], gap_m)
    ]
    return _without_hidden(found)


def _block(members: list[Standing], gap_m: float) -> Iterator[Standing]:
    merged = shapely.union_all([one.footprint for one in members])
    if len(members) > 1:  # close the gaps that no UAS passes
        closed = merged.buffer(gap_m / 2.0, join_style="mitre")
        merged = merged.union(closed.buffer(-gap_m / 2.0, join_style="mitre"))
    for part in polygons_of(merged):
        for piece in convex_pieces(part, _SLACK):
            inside = [one for one in members if one.footprint.intersects(piece)] or members
            yield Standing(members[0].kind, piece, max(one.height_m for one in inside))


def _without_hidden(found: list[Standing]) -> list[Standing]:
    """Leave out what lies inside something higher."""
    kept: list[Standing] = []
    for prism in sorted(found, key=lambda one: (-one.height_m, -one.footprint.area)):
        if not any(k.footprint.covers(prism.footprint) for k in kept):
            kept.append(prism)
    return kept

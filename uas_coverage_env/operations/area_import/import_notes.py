"""What an import says: what is seen, what stands there, who takes off where, what is left out."""

import re
from collections.abc import Sequence
from itertools import takewhile

from uas_coverage_env.operations.area_import.camera_geometry import CameraView
from uas_coverage_env.operations.area_import.drawn_areas import (
    Drawn,
    DrawnPolygon,
    LeftOut,
    Remark,
    TakeOff,
)
from uas_coverage_env.operations.area_import.osm_tags import (
    BUILDING,
    FOREST,
    MAST,
    POWER_LINE,
    STRUCTURE,
)
from uas_coverage_env.operations.area_import.prisms import Standing
from uas_coverage_env.operations.area_import.site import Area, MissionSite
from uas_coverage_env.operations.area_import.town_map import Town

_STANDING = {
    BUILDING: "buildings",
    FOREST: "woods and trees",
    POWER_LINE: "power lines",
    MAST: "masts and towers",
    STRUCTURE: "structures",
}
_DRAWN = {"search": "area", "no_fly": "no-fly zone", "fence": "fence", "obstacle": "obstacle"}
_MOST_NAMES = 3
_SHORTEST = 3  # letters that names share, to be said once for all


def drawn_notes(
    things: Sequence[Drawn], site: MissionSite, uas: Sequence[str], town: Town
) -> list[str]:
    """Remarks on files, who takes off where, and what is left out.

    Args:
        things: What was drawn.
        site: What was made of it.
        uas: Names of the UAS.
        town: What stands there.
    """
    polygons = [thing for thing in things if isinstance(thing, DrawnPolygon)]
    notes = [f"drawn: {in_words([LeftOut(_DRAWN[one.role], one.name) for one in polygons])}"]
    guessed = [
        LeftOut(f"obstacle of {p.solid.height_m:g} m", p.name)
        for p in polygons
        if p.solid and not p.solid.known
    ]
    if guessed:
        notes.append(f"heights guessed from their kind: {in_words(guessed)}")
    if site.outside:
        outside = [LeftOut(_DRAWN[one.role], one.name) for one in site.outside]
        notes.append(f"outside the fence, where no UAS flies: {in_words(outside)}")
    notes += [*site.notes, *(thing.text for thing in things if isinstance(thing, Remark))]
    notes += town.remarks
    starts: dict[int, list[str]] = {}
    for n, name in enumerate(uas):
        starts.setdefault(n % len(site.homes), []).append(name)
    parts = []
    for n, names in starts.items():
        place = site.homes[n]
        called = repr(place.name[:40]) if place.name else place.source
        where = f"{called} at {place.latitude_deg:.6f}, {place.longitude_deg:.6f}"
        parts.append(f"{', '.join(names)} from {where}")
    says = "" if all(place.said for place in site.homes) else " (points that say nothing else)"
    notes.append(f"take-off{says}: {'; '.join(parts)}")
    used = {id(site.homes[n]) for n in starts}
    points = [t for t in things if isinstance(t, TakeOff) and id(t) not in used]
    left = [*(thing for thing in things if isinstance(thing, LeftOut)), *town.left_out]
    left += [LeftOut("point", place.name) for place in points]
    if left:
        notes.append(f"left out: {in_words(left)}")
    return notes


def in_words(left: Sequence[LeftOut]) -> str:
    """Things by kind and name: `3 points 'GCP …', 1 line 'path'`."""
    names: dict[str, list[str]] = {}
    for what, name in left:
        names.setdefault(what, []).append(name[:40])
    return ", ".join(
        " ".join(part for part in (f"{len(of)} {_many(what, len(of))}", _called(of)) if part)
        for what, of in names.items()
    )


def _many(what: str, count: int) -> str:
    if count == 1:
        return what
    head, *rest = re.split(r"( without | of )", what, maxsplit=1)
    plural = f"{head[:-1]}ies" if head.endswith("y") else f"{head}s"
    return "".join((plural, *rest))


def _called(names: Sequence[str]) -> str:
    given = [name for name in dict.fromkeys(names) if name]
    if len(given) < 2:
        return "".join(map(repr, given))
    shared = "".join(
        a
        for a, b in takewhile(lambda ab: ab[0] == ab[1], zip(min(given), max(given), strict=False))
    )
    shared = shared.rstrip("0123456789 ")
    if len(shared) >= _SHORTEST:
        return repr(f"{shared} …")
    shown = ", ".join(map(repr, given[:_MOST_NAMES]))
    return f"{shown} …" if len(given) > _MOST_NAMES else shown


def view_notes(
    seen: Sequence[tuple[Area, CameraView]], above_m: Sequence[Sequence[float]], *, uneven: bool
) -> list[str]:
    """What each camera sees, from how many waypoints.

    Args:
        seen: Areas, and how each is looked at.
        above_m: Heights of the waypoints of each above the lowest ground that they see [m].
        uneven: Whether the ground is.
    """
    notes = []
    views = list(dict.fromkeys(view for _, view in seen))
    for view in views:
        hectares = sum(area.shape.area for area, by in seen if by == view) / 1e4
        heights_m = [
            each_m
            for (_, by), heights_m in zip(seen, above_m, strict=True)
            for each_m in heights_m
            if by == view
        ]
        named = f"{view.name}, {view.height_m:g} m: " if len(views) > 1 else ""
        notes.append(named + view.note(hectares, heights_m, uneven=uneven))
    return notes


def standing_notes(standing: Sequence[Standing], town: Town) -> list[str]:
    """How many things stand there, and what of a map could not be read.

    Args:
        standing: All of them.
        town: The map.
    """
    notes = []
    for kind, words in _STANDING.items():
        guessed = [not thing.known for thing in standing if thing.kind == kind]
        if guessed:
            if len(guessed) == 1:
                many, how = f"1 {kind.replace('_', ' ')}", "its height guessed from its kind"
            else:
                many = f"{len(guessed)} {words}"
                how = f"the heights of {sum(guessed)} of them guessed from their kind"
            notes.append(f"{many}, {how}" if any(guessed) else many)
    if town.incomplete:
        notes.append(
            f"{town.incomplete} outlines in the area lack corners in the file and are "
            "left out: cut out more of the surroundings"
        )
    if town.unread:
        tag, _ = town.unread.most_common(1)[0]
        notes.append(f"{town.unread.total()} tags of heights cannot be read, such as {tag!r}")
    if town.not_read:
        met = ", ".join(f"{n} {tag}" for tag, n in sorted(town.not_read.items()))
        notes.append(f"may be tall, and not read: {met}; give those that are a height")
    return notes

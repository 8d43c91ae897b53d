"""What the signs of the map mean: of those that are on it, each once."""

from collections.abc import Iterable, Sequence

from matplotlib.artist import Artist
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from uas_coverage_env.draw import colours
from uas_coverage_env.flight import Flight, SeenGround
from uas_coverage_env.replay.figures.style import shade, uas_colour

SEEN_ALPHA = 0.4
_RING = {"marker": "o", "linestyle": "", "mfc": "none", "markersize": 8}


def legend_of(flight: Flight, seen: Sequence[SeenGround]) -> list[Artist]:
    """The entries of the legend of a map.

    Args:
        flight: Whose map it is.
        seen: What its cameras have seen, as far as it is drawn.
    """
    weights = {waypoint.weight for waypoint in flight.scenario.waypoints}
    ink = shade(colours.INK)
    marks: list[Artist] = [Line2D([], [], **_RING, mec=ink, label="waypoint")]
    if len(weights) > 1:
        twice = {"marker": "$◎$", "ls": "", "color": ink, "ms": 9, "markeredgewidth": 0}
        marks.append(Line2D([], [], **twice, label="weighs more"))
    covered = {"mfc": (*shade(colours.COVERED), 0.5), "mec": shade(colours.COVERED_EDGE)}
    marks += [
        Line2D([], [], **{**_RING, **covered}, label="covered"),
        Line2D([], [], color=uas_colour(0), label="flown"),
    ]
    if len(flight.plan):
        marks.append(
            Line2D([], [], color=uas_colour(0), marker=".", ls="", ms=3, label="predicted")
        )
    start = {"mfc": "white", "mec": uas_colour(0), "markersize": 4}
    marks.append(Line2D([], [], marker="o", ls="", **start, label="start, home"))
    charge = [
        Line2D([], [], **_RING, mec=shade(colours.of_charge(soc)), markeredgewidth=2, label=label)
        for soc, label in ((0.9, "charged"), (0.5, "medium"), (0.1, "discharged"))
    ]
    return [*marks, *charge, *_seen(seen), *_places(flight)]


def _seen(seen: Sequence[SeenGround]) -> list[Artist]:
    return [
        Patch(
            facecolor=(*shade(tint), SEEN_ALPHA),
            label=f"seen by {ground.sensor}, {ground.share:.0%}",
        )
        for ground, tint in zip(seen, colours.SEEN, strict=False)
    ]


def _places(flight: Flight) -> list[Artist]:
    """Kinds of obstacles and of other things on the ground, and what moves."""
    scenario = flight.scenario
    obstacles = {
        item.kind or "obstacle": colours.OBSTACLES.get(item.kind or "", colours.OTHER_OBSTACLE)
        for item in scenario.obstacles
    }
    others = {
        item.kind or "": colours.DECORATIONS.get(item.kind or "", colours.OTHER_DECORATION)
        for item in scenario.decorations
    }
    patches: list[Artist] = [
        *_patches(obstacles.items(), colours.INK),
        *_patches(((kind, tint) for kind, tint in others.items() if kind), None),
    ]
    if scenario.moving_obstacles:
        red = shade(colours.RED)
        kinds = {item.kind or "moving obstacle" for item in scenario.moving_obstacles}
        name = _words(kinds.pop()) if len(kinds) == 1 else "moving obstacle"
        patches += [
            Line2D([], [], marker="o", ls="", color=red, mec="black", ms=6, label=name),
            Line2D([], [], color=red, ls="--", lw=0.8, label="safe distance of it"),
        ]
    return patches


def _patches(
    kinds: Iterable[tuple[str, colours.Colour]], edge: colours.Colour | None
) -> list[Patch]:
    ink = "none" if edge is None else shade(edge)
    return [
        Patch(facecolor=shade(tint), edgecolor=ink, lw=0.5, label=_words(kind))
        for kind, tint in kinds
    ]


def _words(kind: str) -> str:
    return kind.replace("_", " ")

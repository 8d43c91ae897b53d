"""What the signs of the map mean: of those that are on it, each once."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from uas_coverage_env.draw import colours
from uas_coverage_env.draw.signs import decoration_kinds, in_words, obstacle_kinds
from uas_coverage_env.flight import MODES, Flight
from uas_coverage_env.flight.seen import SeenGround
from uas_coverage_env.replay.figures.style import shade, uas_colour
from uas_coverage_env.scenario import Scenario

SEEN_ALPHA = 0.4
LOST: Mapping[str, Any] = {
    "marker": "X",
    "ls": "",
    "color": shade(colours.RED),
    "mec": "white",
    "ms": 9,
}
LANDED: Mapping[str, Any] = {"marker": "o", "ls": "", "mec": "white", "ms": 6}
_RING: dict[str, Any] = {"marker": "o", "linestyle": "", "mfc": "none", "markersize": 8}


def legend_of(
    flight: Flight,
    scenario: Scenario,
    moving_m: NDArray[np.float64],
    seen: Sequence[SeenGround],
    now: int,
    *,
    heights: bool,
) -> list[Artist]:
    """The entries of the legend of a map.

    Args:
        flight: Whose map it is.
        scenario: As it is at that sample.
        moving_m: (now + 1, M, 3) [m] where its moving obstacles have been.
        seen: What its cameras have seen, as far as it is drawn.
        now: Number of the sample that is drawn.
        heights: Whether the height of an obstacle is written on it.
    """
    weights = {waypoint.weight for waypoint in scenario.waypoints}
    ink = shade(colours.INK)
    marks: list[Artist] = [Line2D([], [], **_RING, mec=ink, label="waypoint")]
    if len(weights) > 1:
        twice: dict[str, Any] = {
            "marker": "$◎$",
            "ls": "",
            "color": ink,
            "ms": 9,
            "markeredgewidth": 0,
        }
        marks.append(Line2D([], [], **twice, label="weighs more"))
    covered: dict[str, Any] = {
        "mfc": (*shade(colours.COVERED), 0.5),
        "mec": shade(colours.COVERED_EDGE),
    }
    marks += [
        Line2D([], [], **{**_RING, **covered}, label="covered"),
        Line2D([], [], color=uas_colour(0), label="flown"),
    ]
    if (flight.plan["step"] == now).any():
        marks.append(
            Line2D([], [], color=uas_colour(0), marker=".", ls="", ms=3, label="predicted")
        )
    start: dict[str, Any] = {"mfc": "white", "mec": uas_colour(0), "markersize": 4}
    marks.append(Line2D([], [], marker="o", ls="", **start, label="start, home"))
    return [*marks, *_uas(flight, now), *_seen(seen), *_places(scenario, moving_m, heights)]


def _uas(flight: Flight, now: int) -> list[Artist]:
    """What stands for a UAS: a ring of its charge while it flies, else how it ended."""
    there = {MODES[mode] for mode in flight.mode[now]}
    hit = any(violation.time_s <= flight.time_s[now] for violation in flight.violations)
    entries: list[Artist] = []
    if there - {"landed", "lost"}:
        entries += [
            Line2D([], [], **_RING, mec=shade(colours.of_charge(soc)), mew=2, label=label)
            for soc, label in ((0.9, "charged"), (0.5, "medium"), (0.1, "discharged"))
        ]
    if "landed" in there:
        entries.append(Line2D([], [], color=uas_colour(0), **LANDED, label="landed"))
    if "lost" in there or hit:
        entries.append(Line2D([], [], **LOST, label="violation" if hit else "lost"))
    return entries


def _seen(seen: Sequence[SeenGround]) -> list[Artist]:
    return [
        Patch(
            facecolor=(*shade(tint), SEEN_ALPHA),
            label=f"seen by {ground.sensor}, {ground.share:.0%}",
        )
        for ground, tint in zip(seen, colours.SEEN, strict=False)
    ]


def _places(scenario: Scenario, moving_m: NDArray[np.float64], heights: bool) -> list[Artist]:
    """Fence, kinds of obstacles and of other things on the ground, and what moves."""
    ink, ground = shade(colours.INK), shade(colours.GROUND)
    patches: list[Artist] = [Patch(facecolor=ground, edgecolor=ink, lw=1.2, label="geofence")]
    patches += [
        Patch(facecolor=shade(tint), edgecolor=ink, lw=0.5, label=words)
        for words, tint in obstacle_kinds(scenario).items()
    ]
    patches += [
        Patch(facecolor=shade(tint), edgecolor="none", label=words)
        for words, tint in decoration_kinds(scenario).items()
    ]
    if heights:
        patches.append(
            Line2D([], [], marker="$9\\,m$", ls="", color=ink, ms=13, mew=0, label="height")
        )
    if scenario.moving_obstacles:
        red = shade(colours.RED)
        kinds = {item.kind or "moving obstacle" for item in scenario.moving_obstacles}
        name = in_words(kinds.pop()) if len(kinds) == 1 else "moving obstacle"
        patches += [
            Line2D([], [], marker="o", ls="", color=red, mec="black", ms=6, label=name),
            Line2D([], [], color=red, ls="--", lw=0.8, label="its safe distance"),
        ]
        if np.ptp(moving_m[..., :2], axis=0).any():
            patches.append(Line2D([], [], color=red, lw=0.7, label="its path"))
    return patches

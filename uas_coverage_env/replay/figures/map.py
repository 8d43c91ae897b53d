"""The map with past and predicted paths and charge rings (Gasche et al., Fig. 1 and 2)."""

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from matplotlib.patheffects import withStroke
from matplotlib.transforms import offset_copy
from numpy.typing import NDArray

from uas_coverage_env.draw import colours
from uas_coverage_env.draw.labels import Box, free_place, overlap, short_name
from uas_coverage_env.draw.marks import heavy_waypoints
from uas_coverage_env.draw.terrain import height_words, lintels
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import MODES, Flight, seen_ground
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.flight.seen import SeenGround
from uas_coverage_env.geometry.outline import outline_of
from uas_coverage_env.replay.figures.map_legend import LANDED, LOST, SEEN_ALPHA, legend_of
from uas_coverage_env.replay.figures.style import (
    MANY,
    columns_of,
    printed,
    shade,
    uas_colour,
    width_in,
    words_colour,
)
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle.layout import PSI

_LEGEND_IN = 0.2
_LEGEND_ROW_IN = 0.175
_LABEL_PT = 6.5
_NAME_PT, _NAME_PT_OF_MANY = 8.0, 6.5
_LETTER = 0.62  # width of a letter for its height
_NAME_ROWS, _NAME_ROWS_OF_MANY = (0, -1, 1, -2, 2, -3, 3), (0, -1, 1)
_TICK_PT = 6.0
_TITLE_PER_IN = 12  # letters that fit
_PT_PER_IN = 72.0
_SIZE_OF_MANY = 0.55  # of paths and marks, where there are many UAS


def map_figure(flight: Flight, *, step: int | None = None) -> Figure:
    """The area from above at a sample, north up, with everything flown until then.

    Args:
        flight: The flight.
        step: Number of the sample; the last by default.

    Raises:
        InputError: The flight has no such sample.
    """
    now = flight.steps if step is None else step
    if not 0 <= now <= flight.steps:
        raise InputError(f"--step is {step}; the flight has samples 0 to {flight.steps}")
    history = SceneHistory.of(flight)
    scenario, there = history.scene_at(now)
    covered = history.covered_at[there] <= now
    moving_m = history.moving_m(now)
    fence = scenario.fence.vertices_m
    low, high = fence.min(axis=0), fence.max(axis=0)
    with printed():
        m_per_pt = float((high - low)[1]) / (width_in() * _PT_PER_IN)
        heights = _heights(scenario, m_per_pt)
        seen = seen_ground(flight, now)
        legend = legend_of(flight, scenario, moving_m, seen, now, heights=bool(heights))
        columns = columns_of(max(len(str(entry.get_label())) for entry in legend), 6)
        legend_in = _LEGEND_IN + _LEGEND_ROW_IN * -(-len(legend) // columns)
        height_in = width_in() * float((high[0] - low[0]) / (high[1] - low[1]))
        size = (width_in(), min(9.0, max(0.4 * width_in(), height_in)) + legend_in)
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplots()
        margin_m = 0.02 * float((high - low)[:2].max())
        axes.set_xlim(low[1] - margin_m, high[1] + margin_m)
        axes.set_ylim(low[0] - margin_m, high[0] + margin_m)
        axes.set_aspect("equal")
        axes.set(xlabel="East, m", ylabel="North, m")
        axes.grid(visible=False)
        # the fence is the frame
        axes.spines[["left", "bottom"]].set_visible(False)
        _terrain(axes, scenario)
        _seen_ground(axes, seen)
        _waypoints(axes, scenario, covered, m_per_pt)
        for place, words, ink in heights:
            axes.text(*place, words, color=ink, fontsize=_LABEL_PT, ha="center", va="center")
        _north(figure, axes)
        _moving_obstacles(axes, scenario, moving_m)
        for i in range(len(flight.names)):
            _uas(axes, flight, now, i)
        _violations(axes, flight, now)
        axes.set_title(_title(flight, scenario, now), fontsize=9, parse_math=False)
        figure.legend(handles=legend, loc="outside lower center", ncols=columns, columnspacing=1.2)
        _names(figure, axes, flight, now)
    return figure


def _title(flight: Flight, scenario: Scenario, now: int) -> str:
    """What is drawn, in as many lines as the width asks for."""
    parts = (
        f"{flight.scenario.name},",
        f"{flight.planner},",
        f"{flight.time_s[now]:g} s:",
        f"{flight.covered[now]} of {len(scenario.waypoints)} waypoints",
    )
    no_break = "\N{NO-BREAK SPACE}"
    whole = " ".join(part.replace(" ", no_break) for part in parts)
    lines = textwrap.fill(whole, int(_TITLE_PER_IN * width_in()), break_on_hyphens=False)
    return lines.replace(no_break, " ")


def _flat(points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """(..., 2) east and north of NED positions."""
    return points_m[..., [1, 0]]


def _terrain(axes: Axes, scenario: Scenario) -> None:
    fence = _flat(outline_of(scenario.fence.vertices_m))
    axes.add_patch(Polygon(fence, facecolor=shade(colours.GROUND), edgecolor="none"))
    for item in scenario.decorations:
        tint = colours.of_decoration(item.kind)
        corners = _flat(np.array(item.polygon_m))
        axes.add_patch(Polygon(corners, facecolor=shade(tint), edgecolor="none"))
    for obstacle, hull, overhead in zip(
        scenario.obstacles, scenario.hulls, lintels(scenario), strict=True
    ):
        tint = colours.of_obstacle(obstacle.kind)
        face = "none" if overhead else shade(tint)
        edge = shade(colours.FAINT if overhead else colours.shaded(tint, 0.6))
        corners = _flat(outline_of(hull.vertices_m))
        axes.add_patch(Polygon(corners, facecolor=face, edgecolor=edge, linewidth=0.6))
    axes.add_patch(Polygon(fence, fill=False, edgecolor=shade(colours.INK), linewidth=1.2))


def _seen_ground(axes: Axes, seen: Sequence[SeenGround]) -> None:
    """The ground that cameras have seen, under waypoints and paths; darker where several have."""
    for ground, tint in zip(seen, colours.SEEN, strict=False):
        if ground.seen.any():
            axes.contourf(
                *(ground.east_m, ground.north_m, ground.seen.astype(float)),
                levels=(0.5, 1.5),
                colors=[shade(tint)],
                alpha=SEEN_ALPHA,
                zorder=1,
            )


def _waypoints(axes: Axes, scenario: Scenario, covered: NDArray[np.bool_], m_per_pt: float) -> None:
    heavy = heavy_waypoints(scenario)
    for waypoint, weighs_more, done in zip(scenario.waypoints, heavy, covered, strict=True):
        x, y = waypoint.position_m[1], waypoint.position_m[0]
        edge = shade(colours.COVERED_EDGE if done else colours.INK)
        # a ring in a ring counts more
        radii = [waypoint.radius_m, *([0.82 * waypoint.radius_m] * weighs_more)]
        for radius in radii:
            axes.add_patch(Circle((x, y), radius, fill=False, edgecolor=edge, linewidth=0.7))
        if done:
            green = shade(colours.COVERED)
            axes.add_patch(Circle((x, y), waypoint.radius_m, color=green, alpha=0.5, linewidth=0))
            tick_pt = min(_TICK_PT, 1.4 * waypoint.radius_m / m_per_pt)
            axes.plot(x, y, marker="$✓$", color=edge, markersize=tick_pt, markeredgewidth=0)


def _heights(
    scenario: Scenario, m_per_pt: float
) -> list[tuple[tuple[float, float], str, tuple[float, float, float]]]:
    """How high the obstacles are, where no waypoint lies over the words: place, words, colour."""
    discs_m = np.array(
        [(*_flat(np.array(w.position_m[:2])), w.radius_m) for w in scenario.waypoints]
    ).reshape(-1, 3)
    heights = []
    for obstacle, hull in zip(scenario.obstacles, scenario.hulls, strict=True):
        words = height_words(hull, scenario.fence)
        box_m = m_per_pt * _LABEL_PT * np.array([_LETTER * len(words), 1.1])
        place = free_place(_flat(outline_of(hull.vertices_m)), box_m, discs_m)
        if place is not None:
            tint = colours.of_obstacle(obstacle.kind)
            heights.append((place, words, shade(colours.shaded(tint, 0.35))))
    return heights


def _north(figure: Figure, axes: Axes) -> None:
    """An arrow to the north, beside the upper right corner."""
    axes.annotate(
        "N",
        xy=(1.0, 1.0),
        xycoords="axes fraction",
        xytext=(9, -25),
        textcoords="offset points",
        ha="center",
        fontsize=8,
    )
    corner = offset_copy(axes.transAxes, figure, x=9, y=-12, units="points")
    axes.plot(1.0, 1.0, marker="^", ms=5, color=shade(colours.INK), transform=corner, clip_on=False)


def _moving_obstacles(axes: Axes, scenario: Scenario, moving_m: NDArray[np.float64]) -> None:
    """Where they are, and a thin line where they have been."""
    for m, obstacle in enumerate(scenario.moving_obstacles):
        been = _flat(moving_m[:, m])
        axes.plot(been[:, 0], been[:, 1], color=shade(colours.RED), linewidth=0.7)
        x, y = been[-1].tolist()
        red = shade(colours.RED)
        axes.add_patch(Circle((x, y), obstacle.radius_m, facecolor=red, edgecolor="black", lw=0.6))
        kept_m = obstacle.radius_m + obstacle.safe_distance_m
        axes.add_patch(Circle((x, y), kept_m, fill=False, edgecolor=red, linestyle="--", lw=0.8))


def _names(figure: Figure, axes: Axes, flight: Flight, now: int) -> None:
    """The name of each UAS beside its mark; where there is no free place within the frame, none."""
    figure.draw_without_rendering()  # lays out the axes, so that distances are known
    pt_per_px = _PT_PER_IN / figure.dpi
    lowest_pt, highest_pt = (pt_per_px * edge for edge in axes.bbox.intervaly)
    taken: list[Box] = []
    many = len(flight.names) > MANY
    # far from their marks, the names of many would be taken for those of others
    name_pt = _NAME_PT_OF_MANY if many else _NAME_PT
    rows = _NAME_ROWS_OF_MANY if many else _NAME_ROWS
    off_pt = 9.0 * _size(flight)
    for i, whole in enumerate(flight.names):
        name = short_name(whole) if many else whole
        east, north = _flat(flight.x[min(now, int(flight.last_sample[i])), i, :3]).tolist()
        # where there is no room to the right, the name stands to the left
        crowded = east > np.dot(axes.get_xlim(), (0.12, 0.88))
        x_pt, y_pt = pt_per_px * axes.transData.transform((east, north))
        width = _LETTER * name_pt * len(name)
        beside = -off_pt if crowded else off_pt
        left = x_pt + beside - (width if crowded else 0.0)
        for row in rows:
            up = off_pt - 3.0 + 1.2 * name_pt * row
            box = (left, y_pt + up, width, name_pt)
            outside = y_pt + up < lowest_pt or y_pt + up + name_pt > highest_pt
            if outside or any(overlap(box, it) for it in taken):
                continue
            taken.append(box)
            axes.annotate(
                name,
                (east, north),
                xytext=(beside, up),
                textcoords="offset points",
                ha="right" if crowded else "left",
                color=words_colour(i),
                fontsize=name_pt,
                fontweight="bold",
                path_effects=[withStroke(linewidth=2, foreground="white")],
            )
            break


def _size(flight: Flight) -> float:
    """How large paths and marks of UAS are, beside those of a few."""
    return _SIZE_OF_MANY if len(flight.names) > MANY else 1.0


def _uas(axes: Axes, flight: Flight, now: int, i: int) -> None:
    colour, size = uas_colour(i), _size(flight)
    until = min(now, int(flight.last_sample[i]))
    path = _flat(flight.x[: until + 1, i, :3])
    axes.plot(path[:, 0], path[:, 1], color=colour, linewidth=1.2 * size)
    start = _flat(flight.x[0, i, :3])
    axes.plot(*start, "o", mfc="white", mec=colour, ms=4 * size, mew=size)
    rows = flight.plan[(flight.plan["step"] == now) & (flight.plan["uas"] == i)]
    predicted = _flat(rows["position_m"])
    axes.plot(predicted[:, 0], predicted[:, 1], ".", color=colour, markersize=2.6)
    x, y = path[-1]
    mode = MODES[flight.mode[now, i]]
    if mode == "lost":
        axes.plot(x, y, **LOST)
    elif mode == "landed":
        landed: dict[str, Any] = {**LANDED, "ms": size * LANDED["ms"], "mew": size}
        axes.plot(x, y, color=colour, **landed)
    else:
        _charge_ring(axes, (x, y), float(flight.soc[now, i]), size)
        heading = float(np.degrees(flight.x[now, i, PSI]))
        axes.plot(x, y, marker=(4, 2, 45 - heading), color=shade(colours.INK), ms=7 * size)


def _charge_ring(axes: Axes, place: tuple[float, float], soc: float, size: float) -> None:
    """A ring as long and as green as the charge, of a size in points."""
    angles = np.linspace(0.0, 2 * np.pi * min(1.0, max(0.0, soc)), 60)
    whole = np.linspace(0.0, 2 * np.pi, 60)
    for points, colour, width in (
        (whole, colours.WHITE, 3.4),
        (whole, colours.FAINT, 0.7),
        (angles, colours.of_charge(soc), 2.4),
    ):
        arc = np.column_stack([np.sin(points), np.cos(points)])
        ring = {"marker": arc, "ms": 15 * size, "mec": shade(colour), "mew": width * size}
        axes.plot(*place, mfc="none", **ring)


def _violations(axes: Axes, flight: Flight, now: int) -> None:
    for violation in flight.violations:
        k = round(violation.time_s / flight.scenario.dt_s)
        if k <= now:
            x, y = _flat(flight.x[k, flight.names.index(violation.uas), :3])
            axes.plot(x, y, **LOST)

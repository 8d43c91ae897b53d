"""The map with past and predicted paths and charge rings (Gasche et al., Fig. 1 and 2)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from uas_coverage_env.draw import colours
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import MODES, Flight, SeenGround, covered_at, seen_ground
from uas_coverage_env.replay.figures.style import WIDTH_IN, printed, shade, uas_colour
from uas_coverage_env.replay.outline import outline_of
from uas_coverage_env.vehicle import PSI

_LEGEND_IN = 0.55
_SEEN_ALPHA = 0.4


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
    fence = flight.scenario.fence.vertices_m
    low, high = fence.min(axis=0), fence.max(axis=0)
    with printed():
        height_in = WIDTH_IN * float((high[0] - low[0]) / (high[1] - low[1]))
        size = (WIDTH_IN, min(9.0, max(2.5, height_in)) + _LEGEND_IN)
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
        _terrain(axes, flight)
        seen = seen_ground(flight, now)
        _seen_ground(axes, seen)
        _waypoints(axes, flight, now)
        _moving_obstacles(axes, flight, now)
        for i in range(len(flight.names)):
            _uas(axes, flight, now, i)
        _violations(axes, flight, now)
        title = f"{flight.scenario.name}, {flight.planner}, {flight.time_s[now]:g} s: "
        title += f"{flight.covered[now]} of {len(flight.scenario.waypoints)} waypoints"
        axes.set_title(title, fontsize=9, parse_math=False)
        figure.legend(
            handles=_legend(flight, seen),
            loc="outside lower center",
            ncols=4 if seen else 6,
            columnspacing=1.2,
        )
    return figure


def _flat(points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """(..., 2) east and north of NED positions."""
    return points_m[..., [1, 0]]


def _terrain(axes: Axes, flight: Flight) -> None:
    scenario = flight.scenario
    fence = _flat(outline_of(scenario.fence))
    axes.add_patch(Polygon(fence, facecolor=shade(colours.GROUND), edgecolor="none"))
    for item in scenario.decorations:
        tint = colours.DECORATIONS.get(item.kind or "", colours.OTHER_DECORATION)
        corners = _flat(np.array(item.polygon_m))
        axes.add_patch(Polygon(corners, facecolor=shade(tint), edgecolor="none"))
    for obstacle, hull in zip(scenario.obstacles, scenario.hulls, strict=True):
        tint = colours.OBSTACLES.get(obstacle.kind or "", colours.OTHER_OBSTACLE)
        edge = shade(colours.shaded(tint, 0.6))
        corners = _flat(outline_of(hull))
        axes.add_patch(Polygon(corners, facecolor=shade(tint), edgecolor=edge, linewidth=0.6))
    axes.add_patch(Polygon(fence, fill=False, edgecolor=shade(colours.INK), linewidth=1.2))


def _seen_ground(axes: Axes, seen: Sequence[SeenGround]) -> None:
    """The ground that cameras have seen, under waypoints and paths; darker where several have."""
    for ground, tint in zip(seen, colours.SEEN, strict=False):
        if ground.seen.any():
            axes.contourf(
                *(ground.east_m, ground.north_m, ground.seen.astype(float)),
                levels=(0.5, 1.5),
                colors=[shade(tint)],
                alpha=_SEEN_ALPHA,
                zorder=1,
            )


def _waypoints(axes: Axes, flight: Flight, now: int) -> None:
    covered = covered_at(flight) <= now
    lightest = min(waypoint.weight for waypoint in flight.scenario.waypoints)
    for waypoint, done in zip(flight.scenario.waypoints, covered, strict=True):
        x, y = waypoint.position_m[1], waypoint.position_m[0]
        edge = shade(colours.COVERED_EDGE if done else colours.INK)
        # a ring in a ring counts more
        radii = [waypoint.radius_m, *([0.82 * waypoint.radius_m] * (waypoint.weight > lightest))]
        for radius in radii:
            axes.add_patch(Circle((x, y), radius, fill=False, edgecolor=edge, linewidth=0.7))
        if done:
            green = shade(colours.COVERED)
            axes.add_patch(Circle((x, y), waypoint.radius_m, color=green, alpha=0.5, linewidth=0))
            axes.plot(x, y, marker="$✓$", color=edge, markersize=6, markeredgewidth=0)


def _moving_obstacles(axes: Axes, flight: Flight, now: int) -> None:
    for obstacle, position_m in zip(
        flight.scenario.moving_obstacles, flight.moving_position_m[now], strict=True
    ):
        x, y = float(position_m[1]), float(position_m[0])
        red = shade(colours.RED)
        axes.add_patch(Circle((x, y), obstacle.radius_m, facecolor=red, edgecolor="black", lw=0.6))
        kept_m = obstacle.radius_m + obstacle.safe_distance_m
        axes.add_patch(Circle((x, y), kept_m, fill=False, edgecolor=red, linestyle="--", lw=0.8))


def _uas(axes: Axes, flight: Flight, now: int, i: int) -> None:
    colour = uas_colour(i)
    until = min(now, int(flight.last_sample[i]))
    path = _flat(flight.x[: until + 1, i, :3])
    axes.plot(path[:, 0], path[:, 1], color=colour, linewidth=1.2)
    start = _flat(flight.x[0, i, :3])
    axes.plot(*start, "o", mfc="white", mec=colour, markersize=4, markeredgewidth=1)
    rows = flight.plan[(flight.plan["step"] == now) & (flight.plan["uas"] == i)]
    predicted = _flat(rows["position_m"])
    axes.plot(predicted[:, 0], predicted[:, 1], ".", color=colour, markersize=2.6)
    x, y = path[-1]
    mode = MODES[flight.mode[now, i]]
    if mode == "lost":
        axes.plot(x, y, "X", color=shade(colours.RED), markeredgecolor="white", markersize=9)
    elif mode == "landed":
        axes.plot(x, y, "o", color=colour, markeredgecolor="white", markersize=6)
    else:
        _charge_ring(axes, (x, y), float(flight.soc[now, i]))
        heading = float(np.degrees(flight.x[now, i, PSI]))
        axes.plot(x, y, marker=(4, 2, 45 - heading), color=shade(colours.INK), markersize=7)
    # where there is no room to the right, the name stands to the left
    crowded = x > np.dot(axes.get_xlim(), (0.12, 0.88))
    axes.annotate(
        flight.names[i],
        (x, y),
        xytext=(-9 if crowded else 9, 6),
        textcoords="offset points",
        ha="right" if crowded else "left",
        color=colour,
        fontsize=8,
        fontweight="bold",
        path_effects=[withStroke(linewidth=2, foreground="white")],
    )


def _charge_ring(axes: Axes, place: tuple[float, float], soc: float) -> None:
    """A ring as long and as green as the charge, of the same size on every map."""
    angles = np.linspace(0.0, 2 * np.pi * min(1.0, max(0.0, soc)), 60)
    whole = np.linspace(0.0, 2 * np.pi, 60)
    for points, colour, width in (
        (whole, colours.WHITE, 3.4),
        (whole, colours.FAINT, 0.7),
        (angles, colours.of_charge(soc), 2.4),
    ):
        arc = np.column_stack([np.sin(points), np.cos(points)])
        axes.plot(
            *place, marker=arc, markersize=15, mfc="none", mec=shade(colour), markeredgewidth=width
        )


def _violations(axes: Axes, flight: Flight, now: int) -> None:
    for violation in flight.violations:
        k = round(violation.time_s / flight.scenario.dt_s)
        if k <= now:
            x, y = _flat(flight.x[k, flight.names.index(violation.uas), :3])
            axes.plot(x, y, "X", color=shade(colours.RED), markeredgecolor="white", markersize=9)


def _legend(flight: Flight, seen: Sequence[SeenGround]) -> list[Line2D]:
    ring = {"marker": "o", "linestyle": "", "mfc": "none", "markersize": 8}
    charge = [
        Line2D([], [], **ring, mec=shade(colours.of_charge(soc)), markeredgewidth=2, label=label)
        for soc, label in ((0.9, "charged"), (0.5, "medium"), (0.1, "discharged"))
    ]
    marks = [
        Line2D([], [], **ring, mec=shade(colours.INK), label="waypoint"),
        Line2D([], [], color=uas_colour(0), label="flown"),
    ]
    if len(flight.plan):
        marks.append(
            Line2D([], [], color=uas_colour(0), marker=".", ls="", ms=3, label="predicted")
        )
    marks += [
        Line2D(
            *([], []),
            color=(*shade(tint), _SEEN_ALPHA),
            marker="s",
            ls="",
            ms=7,
            label=f"seen by {ground.sensor}, {ground.share:.0%}",
        )
        for ground, tint in zip(seen, colours.SEEN, strict=False)
    ]
    return [*marks, *charge]

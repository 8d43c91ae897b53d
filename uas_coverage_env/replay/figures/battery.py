"""Charge, voltage and current of every UAS (Gasche et al., Fig. 3)."""

from importlib.resources import files
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from uas_coverage_env.draw import colours
from uas_coverage_env.flight import Flight
from uas_coverage_env.replay.figures.style import (
    MANY,
    columns_of,
    line_style,
    printed,
    rows,
    shade,
    uas_colour,
)

_PUBLISHED_SCENARIOS = ("village", "gasche2025")
"""The paper's mission; beside another one its curves would say nothing."""

# broad and pale: seen on either side of ours where the two agree
_GREY, _BREADTH = "#bcbcbc", 1.9
_SPAN: dict[str, Any] = {"color": uas_colour(0), "alpha": 0.2, "linewidth": 0.0}
_MEDIAN: dict[str, Any] = {"color": uas_colour(0), "linewidth": 0.8}
_LEAST: dict[str, Any] = {"color": uas_colour(0), "linewidth": 1.6}
_PANELS = (("State of charge, %", 100.0), ("Voltage, V", 1.0), ("Current, A", 1.0))


def battery_figure(flight: Flight, *, published: bool | None = None) -> Figure:
    """Three panels over time, one line per UAS; of many their median, the least and the span.

    Args:
        flight: The flight.
        published: Draw the paper's curves too, in grey; by default where the flight is of the
            village mission. The paper flew a map of its own, which is not published: the curves
            are alike, not equal.
    """
    if published is None:
        published = flight.scenario.name in _PUBLISHED_SCENARIOS
    with printed():
        figure, axes = rows(5.4, [1.0, 1.0, 1.0])
        if published:
            _draw_published(axes)
        many = len(flight.names) > MANY
        panels = (flight.soc, flight.voltage_V, flight.current_A)
        for axis, series, (_, scale) in zip(axes, panels, _PANELS, strict=True):
            (_draw_span if many else _draw_lines)(axis, flight, scale * series)
        for axis, (label, _) in zip(axes, _PANELS, strict=True):
            axis.set_ylabel(label)
            axis.margins(x=0.01)
        for floor in sorted({1.0 - dod for dod in flight.scenario.dod_landed}):
            axes[0].axhline(100 * floor, color=shade(colours.RED), linewidth=0.8, linestyle=":")
        axes[0].set_ylim(bottom=0)
        axes[-1].set_xlabel("Time, s")
        figure.align_ylabels(axes)
        handles = _span_legend(flight) if many else _lines_legend(flight)
        handles += _other_legend(published)
        longest = max(len(str(handle.get_label())) for handle in handles)
        columns = columns_of(longest, 3)
        figure.legend(handles=handles, loc="outside upper center", ncols=columns)
    return figure


def published_battery() -> dict[str, NDArray[np.float64]]:
    """The curves of the paper's Fig. 3, read from the figure; one row per second.

    Columns: `t_s`, and `soc_uas1`, `voltage_uas1_V`, `current_uas1_A`, the same for `uas2`.
    Equal to `tests/paper/fig3_battery_reference.csv`.
    """
    file = files("uas_coverage_env.replay.figures").joinpath("published_battery.csv")
    table = np.genfromtxt(file.read_text().splitlines(), delimiter=",", names=True)
    return {name: table[name] for name in table.dtype.names or ()}


def _draw_lines(axis: Axes, flight: Flight, series: NDArray[np.float64]) -> None:
    for i in range(len(flight.names)):
        airborne = slice(0, int(flight.last_sample[i]))
        axis.plot(
            flight.time_s[airborne],
            series[airborne, i],
            color=uas_colour(i),
            linestyle=line_style(i),
        )


def _draw_span(axis: Axes, flight: Flight, series: NDArray[np.float64]) -> None:
    """Least, median and greatest of the UAS that are airborne."""
    airborne = np.arange(len(series))[:, None] < flight.last_sample
    until = int(flight.last_sample.max())
    flown = np.where(airborne, series, np.nan)[:until]
    least, median, greatest = np.nanquantile(flown, (0.0, 0.5, 1.0), axis=1)
    time_s = flight.time_s[:until]
    axis.fill_between(time_s, least, greatest, **_SPAN)
    axis.plot(time_s, least, **_LEAST)
    axis.plot(time_s, median, **_MEDIAN)


def _draw_published(axes: list[Axes]) -> None:
    table = published_battery()
    for i, uas in enumerate(("uas1", "uas2")):
        current_A = table[f"current_{uas}_A"]
        # without current it has landed
        airborne = slice(0, int(np.count_nonzero(current_A)))
        panels = (table[f"soc_{uas}"], table[f"voltage_{uas}_V"], current_A)
        for axis, series, (_, scale) in zip(axes, panels, _PANELS, strict=True):
            axis.plot(
                table["t_s"][airborne],
                scale * series[airborne],
                color=_GREY,
                linestyle=line_style(i),
                linewidth=_BREADTH,
            )


def _lines_legend(flight: Flight) -> list[Artist]:
    return [
        Line2D([], [], color=uas_colour(i), linestyle=line_style(i), label=name)
        for i, name in enumerate(flight.names)
    ]


def _span_legend(flight: Flight) -> list[Artist]:
    return [
        Line2D([], [], **_MEDIAN, label="median"),
        Line2D([], [], **_LEAST, label="least"),
        Patch(**_SPAN, label=f"{len(flight.names)} UAS"),
    ]


def _other_legend(published: bool) -> list[Artist]:
    limit = Line2D(
        [], [], color=shade(colours.RED), linestyle=":", linewidth=0.8, label="lowest allowed"
    )
    style = {"color": _GREY, "linewidth": _BREADTH}
    theirs = [
        Line2D([], [], **style, linestyle=line_style(i), label=f"UAS {i + 1}, Gasche et al.")
        for i in range(2)
    ]
    return [*(theirs if published else []), limit]

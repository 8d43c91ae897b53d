"""What each UAS was doing when, under the coverage reached until then."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from uas_coverage_env.draw import colours
from uas_coverage_env.flight import MODES, Flight
from uas_coverage_env.flight.metrics import open_waypoints
from uas_coverage_env.replay.figures.style import columns_of, printed, rows, shade
from uas_coverage_env.replay.runs import mode_runs

_HATCHES = {"covering": "", "transit": "///", "return": "...", "landed": "", "lost": "xxx"}
_PAINT = {mode: (colours.MODES[mode], hatch) for mode, hatch in _HATCHES.items()}

_MOST_BARS = 16


def modes_figure(flight: Flight) -> Figure:
    """The waypoints covered over time, and below it a bar per UAS, or of many how many do what."""
    used = [mode for k, mode in enumerate(MODES) if (flight.mode == k).any()]
    many = len(flight.names) > _MOST_BARS
    with printed():
        tall = 8 if many else len(flight.names)
        figure, (coverage, bars) = rows(2.2 + 0.24 * tall, [2.0, 0.5 + 0.5 * tall])
        coverage.step(flight.time_s, flight.covered, where="post", color=shade(colours.GREEN))
        asked = int(flight.covered[-1]) + open_waypoints(flight)
        coverage.axhline(asked, color=shade(colours.FAINT), linewidth=0.8, ls=":")
        coverage.set(ylabel="Covered", ylim=(0, 1.08 * max(asked, 1)))
        (_draw_counts if many else _draw_bars)(bars, flight)
        bars.set_xlabel("Time, s")
        bars.set_xlim(0.0, 1.005 * max(float(flight.time_s[-1]), flight.scenario.dt_s))
        legend = [
            Patch(facecolor=shade(_PAINT[mode][0]), hatch=_PAINT[mode][1], ec="white", label=mode)
            for mode in used
        ]
        figure.legend(handles=legend, loc="outside upper center", ncols=columns_of(8, len(legend)))
        figure.align_ylabels([coverage, bars])
    return figure


def _draw_bars(bars: Axes, flight: Flight) -> None:
    names = flight.names
    every = [(i, *run) for i in range(len(names)) for run in mode_runs(flight, i)]
    for i, mode, first, after in every:
        colour, hatch = _PAINT[MODES[mode]]
        start_s, end_s = flight.time_s[[first, after]].tolist()
        bars.barh(
            i,
            end_s - start_s,
            left=start_s,
            height=0.72,
            color=shade(colour),
            hatch=hatch,
            edgecolor="white",
            linewidth=0.4,
        )
    for violation in flight.violations:
        i = names.index(violation.uas)
        bars.plot(violation.time_s, i, "X", color=shade(colours.RED), mec="white", ms=8)
    bars.set_yticks(range(len(names)), names)
    bars.set_ylim(len(names) - 0.4, -0.6)
    bars.grid(axis="y", visible=False)


def _draw_counts(axes: Axes, flight: Flight) -> None:
    below = np.zeros(len(flight.time_s))
    for k, mode in enumerate(MODES):
        above = below + (flight.mode == k).sum(axis=1)
        colour, hatch = _PAINT[mode]
        style = {"facecolor": shade(colour), "hatch": hatch, "edgecolor": "white", "linewidth": 0.4}
        axes.fill_between(flight.time_s, below, above, step="post", **style)
        below = above
    top = 1.05 * len(flight.names)
    for violation in flight.violations:
        axes.plot(violation.time_s, 0.98 * top, "X", color=shade(colours.RED), mec="white", ms=8)
    axes.set(ylabel="UAS", ylim=(0.0, top))

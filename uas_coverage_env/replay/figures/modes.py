"""What each UAS was doing when, under the coverage reached until then."""

import itertools

from matplotlib.figure import Figure
from matplotlib.patches import Patch

from uas_coverage_env.draw import colours
from uas_coverage_env.flight import MODES, Flight
from uas_coverage_env.flight.metrics import open_waypoints
from uas_coverage_env.replay.figures.style import columns_of, printed, rows, shade

_PAINT = {
    "covering": (colours.BLUE, ""),
    "transit": (colours.ORANGE, "///"),
    "return": ((217, 154, 192), "..."),
    "landed": ((205, 205, 200), ""),
    "lost": (colours.RED, "xxx"),
}


def modes_figure(flight: Flight) -> Figure:
    """The waypoints covered over time, and below it one bar per UAS in the order of the fleet."""
    names = flight.names
    used = [mode for k, mode in enumerate(MODES) if (flight.mode == k).any()]
    with printed():
        figure, (coverage, bars) = rows(2.2 + 0.24 * len(names), [2.0, 0.5 + 0.5 * len(names)])
        coverage.step(flight.time_s, flight.covered, where="post", color=shade(colours.GREEN))
        asked = int(flight.covered[-1]) + open_waypoints(flight)
        coverage.axhline(asked, color=shade(colours.FAINT), linewidth=0.8, ls=":")
        coverage.set(ylabel="Covered", ylim=(0, 1.08 * max(asked, 1)))
        for i, mode, start_s, end_s in _runs(flight):
            colour, hatch = _PAINT[mode]
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
        bars.set(ylim=(len(names) - 0.4, -0.6), xlabel="Time, s")
        bars.grid(axis="y", visible=False)
        bars.set_xlim(0.0, 1.005 * max(float(flight.time_s[-1]), flight.scenario.dt_s))
        legend = [
            Patch(facecolor=shade(_PAINT[mode][0]), hatch=_PAINT[mode][1], ec="white", label=mode)
            for mode in used
        ]
        figure.legend(handles=legend, loc="outside upper center", ncols=columns_of(8, len(legend)))
        figure.align_ylabels([coverage, bars])
    return figure


def _runs(flight: Flight) -> list[tuple[int, str, float, float]]:
    """[(place of the UAS, mode, from [s], to [s])], a run to the sample where the next begins."""
    result = []
    end = flight.steps
    for i in range(len(flight.names)):
        first = 0
        for mode, samples in itertools.groupby(flight.mode[:, i].tolist()):
            count = len(list(samples))
            start_s, end_s = (flight.time_s[min(k, end)] for k in (first, first + count))
            result.append((i, MODES[mode], float(start_s), float(end_s)))
            first += count
    return result

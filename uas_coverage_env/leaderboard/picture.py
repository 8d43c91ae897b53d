"""The picture of a comparison: coverage against energy, a mark per player, a dot per flight."""

from collections.abc import Sequence
from io import BytesIO

from uas_coverage_env.leaderboard.row import Row
from uas_coverage_env.leaderboard.scores import Scores
from uas_coverage_env.leaderboard.statistics import Estimate

_SIZE_IN = (8.0, 5.0)
_DPI = 150
_MARKS = "osD^vP*X<>"


def picture(scores: Sequence[Scores], rows: Sequence[Row], reference: str) -> bytes | None:
    """A PNG; None where matplotlib (extra `view`) is not installed.

    Energy is in percent of the reference's mean on the same scenario, so that small and large
    scenarios can stand in one picture; flights with a violation are not in it.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        return None
    figure = Figure(figsize=_SIZE_IN, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for n, one in enumerate(scores):
        energy, coverage = one.relative_energy_percent, one.mean_coverage_percent
        if energy.value is None or coverage.value is None:
            continue
        colour, mark = f"C{n % 10}", _MARKS[n % len(_MARKS)]
        axes.plot(*_dots(rows, one.player, reference), ".", color=colour, alpha=0.35, markersize=4)
        axes.errorbar(
            *(energy.value, coverage.value),
            xerr=_whiskers(energy),
            yerr=_whiskers(coverage),
            **{"fmt": mark, "color": colour, "markersize": 8, "capsize": 3, "label": one.player},
        )
    axes.set_xlabel(f"energy of flights without violation, % of {reference} on the same scenario")
    axes.set_ylabel("waypoints covered, %")
    axes.set_title("Players: interquartile mean energy, mean coverage, 95 % intervals", fontsize=10)
    axes.grid(alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="best", fontsize=9)
    png = BytesIO()
    figure.savefig(png, format="png", dpi=_DPI)
    return png.getvalue()


def _dots(rows: Sequence[Row], player: str, reference: str) -> tuple[list[float], list[float]]:
    """Energy and coverage of each flight of a player that counts, in percent."""
    base: dict[str, list[float]] = {}
    for row in rows:
        if row.player == reference and row.ranked and row.energy_Wh:
            base.setdefault(row.scenario, []).append(row.energy_Wh)
    mine = [row for row in rows if row.player == player and row.ranked and row.scenario in base]
    return (
        [
            100.0 * (row.energy_Wh or 0.0) / (sum(base[row.scenario]) / len(base[row.scenario]))
            for row in mine
        ],
        [100.0 * row.coverage for row in mine],
    )


def _whiskers(found: Estimate) -> list[list[float]] | None:
    if found.value is None or found.low is None or found.high is None:
        return None
    # a mean of equal numbers may lie a rounding outside of its interval
    return [[max(0.0, found.value - found.low)], [max(0.0, found.high - found.value)]]

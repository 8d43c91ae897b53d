"""The picture of a comparison: coverage and energy, a row per planner, a dot per flight."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from uas_coverage_env.draw import colours
from uas_coverage_env.leaderboard.row import Row
from uas_coverage_env.leaderboard.scores import Scores
from uas_coverage_env.leaderboard.statistics import Estimate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# The mean stands above its flights; these in some lines, so that equal ones are seen to be many.
_MEAN, _FIRST_LINE, _LINES, _SPREAD = -0.16, 0.08, 5, 0.28
_LONGEST_NAME = 26


def leaderboard_figure(scores: Sequence[Scores], rows: Sequence[Row], reference: str) -> "Figure":
    """Coverage on the left, energy on the right, planners in the order of their scores.

    Energy is in percent of the reference's mean on the same scenario, so that small and large
    scenarios can stand in one picture; flights with a violation have none.

    Args:
        scores: Of each planner, best first.
        rows: The flights.
        reference: Label of the planner that the others are compared with.

    Raises:
        ImportError: matplotlib (extra `view`) is not installed.
    """
    from matplotlib.figure import Figure

    from uas_coverage_env.replay.figures.style import printed, shade, width_in

    with printed():
        size = (width_in(), 1.1 + 0.32 * len(scores))
        figure = Figure(figsize=size, layout="constrained")
        coverage, energy = figure.subplots(1, 2, sharey=True)
        for place, one in enumerate(scores):
            covered = [100.0 * row.coverage for row in rows if row.label == one.label]
            _draw(coverage, place, covered, one.mean_coverage_percent)
            relative = _relative_energies(rows, one.label, reference)
            _draw(energy, place, relative, one.relative_energy_percent)
        energy.axvline(100.0, color=shade(colours.FAINT), linewidth=0.8, linestyle=":", zorder=1)
        coverage.set_yticks(range(len(scores)), [_short(one.label) for one in scores])
        coverage.set_ylim(len(scores) - 0.5, -0.5)
        worst = min(one.worst_coverage_percent for one in scores)
        coverage.set_xlim(min(worst, 90.0) - 2.0, 102.0)
        coverage.set_xlabel("Waypoints covered, %")
        energy.set_xlabel(f"Energy, % of {_short(reference)}")
        for axes in (coverage, energy):
            axes.grid(axis="y", visible=False)
        note = "Dots: flights. Diamonds: mean coverage, interquartile mean energy, 95 % intervals."
        figure.suptitle(note, fontsize=8)
    return figure


def drawn(figure: Callable[[], "Figure"]) -> bytes | None:
    """A figure as a PNG; None where matplotlib (extra `view`) is not installed."""
    try:
        from uas_coverage_env.replay.figures import png_of
    except ImportError:
        return None
    return png_of(figure())


def _draw(axes: "Axes", place: int, values: Sequence[float], found: Estimate) -> None:
    """One planner in one panel."""
    from uas_coverage_env.replay.figures.style import shade

    heights = [place + _FIRST_LINE + _SPREAD * (k % _LINES) / _LINES for k in range(len(values))]
    axes.plot(values, heights, ".", color=shade(colours.SKY), markersize=3)
    if found.value is None:
        return
    height, blue = place + _MEAN, shade(colours.BLUE)
    if found.low is not None and found.high is not None:
        ends = [found.low, found.high]
        axes.plot(ends, [height, height], "|-", color=blue, linewidth=1.6, markersize=6)
    axes.plot(found.value, height, "D", color=blue, markeredgecolor="white", mew=0.6, markersize=5)


def _short(name: str) -> str:
    """A label may be the path of a policy: its end tells it from others."""
    return name if len(name) <= _LONGEST_NAME else f"...{name[3 - _LONGEST_NAME :]}"


def _relative_energies(rows: Sequence[Row], label: str, reference: str) -> list[float]:
    """Energy of each flight of a planner that counts, in percent."""
    base: dict[str, list[float]] = {}
    for row in rows:
        if row.label == reference and row.ranked and row.energy_Wh:
            base.setdefault(row.scenario, []).append(row.energy_Wh)
    mean = {scenario: sum(energies) / len(energies) for scenario, energies in base.items()}
    mine = [row for row in rows if row.label == label and row.ranked and row.scenario in mean]
    return [100.0 * (row.energy_Wh or 0.0) / mean[row.scenario] for row in mine]

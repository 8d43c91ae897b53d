"""Time against energy: one planner with different options, and which of them are worth flying."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean, median
from typing import TYPE_CHECKING

from uas_coverage_env.draw import colours
from uas_coverage_env.leaderboard.bounds import Bounds
from uas_coverage_env.leaderboard.row import Row
from uas_coverage_env.leaderboard.scores import NOTHING
from uas_coverage_env.leaderboard.table import Cells

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Choice:
    """A planner with its options on one mission, as a point in the plane of time and energy.

    Attributes:
        settings: The options that were varied, as text; the planner before them, where several are.
        flown: Flights, of as many seeds.
        accomplished: How many of them accomplished the mission; the figures are means of these.
        time_s: Until the last UAS has landed.
        energy_Wh: Of the swarm.
        flew: UAS that flew.
        bound_Wh: The least energy in this time; None where there is no bound.
        on_front: Whether no other one is better in one of time and energy, and as good in the
            other; of equal ones the first. One that does not always accomplish the mission is not.
    """

    settings: str
    flown: int
    accomplished: int
    time_s: float
    energy_Wh: float
    flew: int
    bound_Wh: float | None
    on_front: bool


Fronts = Mapping[str, Sequence[Choice]]
"""By mission."""


def choices_of(
    rows: Sequence[Row], keys: Sequence[str], dt_s: float, bounds: Bounds
) -> list[Choice]:
    """The planners that accomplished one mission, quickest first.

    Args:
        rows: Its flights; those that did not accomplish it are dropped.
        keys: The options that were varied.
        dt_s: Of the scenario.
        bounds: See `bounds_of`.
    """
    several = len({row.planner for row in rows}) > 1
    found = []
    for label in dict.fromkeys(row.label for row in rows):
        mine = [row for row in rows if row.label == label]
        done = [row for row in mine if row.accomplished and row.steps and row.energy_Wh]
        if done:
            least = [bounds.get((row.scenario, row.steps)) for row in done]
            known = [bound for bound in least if bound is not None]
            found.append(
                (
                    fmean(row.steps for row in done) * dt_s,
                    fmean(row.energy_Wh for row in done),
                    label,
                    _settings(done[0], keys, several=several),
                    (len(mine), len(done), round(median(row.flew for row in done))),
                    fmean(known) if len(known) == len(done) else None,
                )
            )
    choices, least_Wh = [], float("inf")
    for time_s, energy_Wh, _, settings, (flown, accomplished, flew), bound_Wh in sorted(
        found, key=lambda one: one[:3]
    ):
        counts = flown == accomplished
        best = counts and energy_Wh < least_Wh
        choices.append(
            Choice(settings, flown, accomplished, time_s, energy_Wh, flew, bound_Wh, best)
        )
        least_Wh = min(least_Wh, energy_Wh) if counts else least_Wh
    return choices


def _settings(row: Row, keys: Sequence[str], *, several: bool) -> str:
    options = json.loads(row.options)
    chosen = [f"{key} {options[key]}" for key in keys if key in options]
    return ", ".join([*([row.planner] if several else []), *chosen])


def front_cells(choices: Sequence[Choice]) -> Cells:
    """Headings and rows: all flights, quickest first."""
    several = any(one.flown > 1 for one in choices)
    headings = ["options", *(["accomplished"] if several else []), "UAS flying", "time, s"]
    headings += ["energy, Wh", "above the bound, %", "front"]
    return headings, [
        [
            one.settings,
            *([f"{one.accomplished}/{one.flown}"] if several else []),
            str(one.flew),
            f"{one.time_s:g}",
            f"{one.energy_Wh:.2f}",
            NOTHING
            if one.bound_Wh is None
            else f"{100.0 * (one.energy_Wh / one.bound_Wh - 1.0):.1f}",
            "yes" if one.on_front else "",
        ]
        for one in choices
    ]


def front_figure(choices: Fronts) -> "Figure":
    """Energy over time, a panel for each mission: flights, their front, and the lower bound.

    Args:
        choices: By scenario; at least one, each with at least one flight.

    Raises:
        ImportError: matplotlib (extra `view`) is not installed.
    """
    from matplotlib.figure import Figure

    from uas_coverage_env.replay.figures.style import printed, shade, width_in

    with printed():
        columns = min(len(choices), 3)
        lines = -(-len(choices) // columns)
        size = (width_in(), 0.4 + 2.4 * lines)
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(lines, columns, squeeze=False).ravel()
        for axes in panels[len(choices) :]:
            axes.set_axis_off()
        for axes, (name, found) in zip(panels, choices.items(), strict=False):
            blue, faint = shade(colours.BLUE), shade(colours.SKY)
            energy_Wh = [one.energy_Wh for one in found]
            axes.plot([one.time_s for one in found], energy_Wh, ".", color=faint, label="flights")
            best = [one for one in found if one.on_front]
            axes.plot(
                [one.time_s for one in best],
                [one.energy_Wh for one in best],
                "o-",
                color=blue,
                markersize=3.5,
                drawstyle="steps-post",
                label="front",
            )
            for one in best:
                offset = {"textcoords": "offset points", "xytext": (3, 4), "fontsize": 7}
                axes.annotate(str(one.flew), (one.time_s, one.energy_Wh), **offset)
            bound = sorted({(one.time_s, one.bound_Wh) for one in found if one.bound_Wh})
            if bound:
                style = {"drawstyle": "steps-pre", "color": "black", "label": "lower bound"}
                style["marker"] = "_" if len(bound) == 1 else ""  # a line has no length there
                axes.plot(*zip(*bound, strict=True), ":", **style)  # of less time, it is higher
            axes.set_title(name, fontsize=8)
            axes.set_xlabel("Time, s")
        panels[0].set_ylabel("Energy, Wh")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
        figure.suptitle("Each point is a flight; numbers: UAS that fly.", fontsize=8)
    return figure

"""Time against energy: one planner with different options, and which of them are worth flying."""

import itertools
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from uas_coverage_env.draw import colours
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard.planner_specs import PlannerSpec, planner_specs_of
from uas_coverage_env.leaderboard.row import Row
from uas_coverage_env.leaderboard.table import NOTHING, Cells

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Choice:
    """One flight of a mission, as a point in the plane of time and energy.

    Attributes:
        settings: The options that were varied, as text.
        row: The flight.
        time_s: Until the last UAS has landed.
        n_flying: UAS that flew; None where it is not known.
        bound_Wh: The least energy in this time; None where there is no bound.
        on_front: Whether no other flight is better in one of time and energy, and as good in the
            other; of equal ones the first.
    """

    settings: str
    row: Row
    time_s: float
    n_flying: int | None
    bound_Wh: float | None
    on_front: bool


def varied_specs(planner: str, vary: Iterable[str]) -> dict[str, PlannerSpec]:
    """A planner with every combination of values, by label; the label names the values.

    Args:
        planner: Its name.
        vary: KEY=VALUE,VALUE,... each.

    Raises:
        InputError: An unknown planner or option, a value that does not fit, no value, or a key
            given twice.
    """
    values: dict[str, list[str]] = {}
    for text in vary:
        key, equals, listed = (part.strip() for part in text.partition("="))
        found = [value.strip() for value in listed.split(",") if value.strip()]
        if not (key and equals and found):
            raise InputError(
                f"--vary {text!r}: should be KEY=VALUE,VALUE,... as in weight_energy=0,0.6"
            )
        if key in values:
            raise InputError(f"--vary {key} is given twice; give all of its values at once")
        values[key] = list(dict.fromkeys(found))
    specs: dict[str, PlannerSpec] = {}
    for chosen in itertools.product(*values.values()):
        settings = [f"{key}={value}" for key, value in zip(values, chosen, strict=True)]
        label = "+".join(part.replace("=", "-") for part in settings) or "default"
        options = [f"{label}:{setting}" for setting in settings]
        specs |= planner_specs_of([f"{label}={planner}"], options)
    return specs


def choices_of(
    rows: Sequence[Row],
    keys: Sequence[str],
    dt_s: float,
    flying: Mapping[str, int],
    bounds: Mapping[tuple[str, int], float],
) -> list[Choice]:
    """The accomplished flights of one mission, quickest first.

    Args:
        rows: Flights; those that did not accomplish the mission are dropped.
        keys: The options that were varied.
        dt_s: Of the scenario.
        flying: Label -> UAS that flew.
        bounds: See `bounds_of`.
    """
    done = [row for row in rows if row.accomplished and row.steps and row.energy_Wh]
    done.sort(key=lambda row: (row.steps, row.energy_Wh, row.label))
    found, least_Wh = [], float("inf")
    for row in done:
        steps, energy_Wh = row.steps or 0, row.energy_Wh or 0.0
        options = json.loads(row.options)
        settings = ", ".join(f"{key} {options[key]}" for key in keys)
        found.append(
            Choice(
                settings,
                row,
                steps * dt_s,
                flying.get(row.label),
                bounds.get((row.scenario, steps)),
                energy_Wh < least_Wh,
            )
        )
        least_Wh = min(least_Wh, energy_Wh)
    return found


def front_cells(choices: Sequence[Choice]) -> Cells:
    """Headings and rows: all flights, quickest first."""
    headings = ["options", "UAS flying", "time, s", "energy, Wh", "above the bound, %", "front"]
    return headings, [
        [
            one.settings,
            NOTHING if one.n_flying is None else str(one.n_flying),
            f"{one.time_s:g}",
            f"{one.row.energy_Wh:.2f}",
            _above(one),
            "yes" if one.on_front else "",
        ]
        for one in choices
    ]


def front_figure(choices: Mapping[str, Sequence[Choice]]) -> "Figure":
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
            energy_Wh = [one.row.energy_Wh or 0.0 for one in found]
            axes.plot([one.time_s for one in found], energy_Wh, ".", color=faint, label="flights")
            best = [one for one in found if one.on_front]
            axes.plot(
                [one.time_s for one in best],
                [one.row.energy_Wh or 0.0 for one in best],
                "o-",
                color=blue,
                markersize=3.5,
                drawstyle="steps-post",
                label="front",
            )
            for one in best:
                if one.n_flying is not None:
                    at = (one.time_s, one.row.energy_Wh or 0.0)
                    offset = {"textcoords": "offset points", "xytext": (3, 4), "fontsize": 7}
                    axes.annotate(str(one.n_flying), at, **offset)
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


def _above(one: Choice) -> str:
    if one.bound_Wh is None or one.row.energy_Wh is None:
        return NOTHING
    return f"{100.0 * (one.row.energy_Wh / one.bound_Wh - 1.0):.1f}"

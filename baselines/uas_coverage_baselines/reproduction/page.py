"""The files of a reproduction: a page with its figures, a table as CSV, everything as JSON."""

import csv
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from statistics import median
from typing import Any

from uas_coverage_baselines.reproduction.comparison import FigureLine, ReproducedPaper
from uas_coverage_baselines.reproduction.sizes import GAP, SOLVED_FORM, ClassSize, Timing
from uas_coverage_baselines.reproduction.sweeps import Trade
from uas_coverage_env.files.output_dir import write_files
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.metrics import energy_Wh
from uas_coverage_env.leaderboard.hardware import machine
from uas_coverage_env.leaderboard.table import NOTHING, Cells, markdown
from uas_coverage_env.replay.figures import battery_figure, map_figure, png_of

PAGE, TABLE, DATA = "reproduction.md", "reproduction.csv", "reproduction.json"


def write_page(
    done: ReproducedPaper,
    sizes: Sequence[ClassSize],
    timings: Sequence[Timing],
    trades: Sequence[Trade],
    command: str,
    directory: Path,
) -> list[str]:
    """Write all files; returns their names.

    Args:
        done: What was compared.
        sizes: The program of the first decision by class.
        timings: A decision solved with classes left out.
        trades: The same under other parameters.
        command: The command line.
        directory: An existing folder.

    Raises:
        InputError: One cannot be written.
    """
    pictures = _pictures(done)
    text = _page(done, sizes, timings, trades, command, list(pictures))
    data = _data(done, sizes, timings, trades, command)
    files = {
        **{name: content for name, (_, content) in pictures.items()},
        TABLE: _csv(done.figures).encode(),
        DATA: (json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode(),
        PAGE: text.encode(),
    }
    write_files(directory, files)
    return [PAGE, TABLE, DATA, *pictures]


def figure_cells(done: ReproducedPaper) -> Cells:
    """Headings and rows: the paper's figures beside ours."""
    headings = [
        *("figure", "UAS", "paper", done.paper.scenario, "difference", "allowed", "kept"),
        *("drawn maps: median [least, most]", "mean [95 % interval]"),
    ]
    return headings, [_figure_row(line) for line in done.figures]


def event_cells(done: ReproducedPaper) -> Cells:
    """Headings and rows: what the text tells, flight by flight."""
    drawn = [name for name in done.flights if name != done.paper.scenario]
    headings = ["the paper's text", "place", done.paper.scenario, "behind it"]
    headings += ["of the drawn maps"] if drawn else []
    rows = []
    for line in done.events:
        main = line.flights[done.paper.scenario]
        row = [line.told.says, line.told.place, _told(main.happened, main.time_s), main.detail]
        if drawn:
            row.append(f"{sum(line.flights[name].happened for name in drawn)} of {len(drawn)}")
        rows.append(row)
    return headings, rows


def flight_cells(done: ReproducedPaper) -> Cells:
    """Headings and rows: each flight with its events."""
    headings = ["map", "steps", "Wh", "covered", "violations", "breaches"]
    headings += [line.told.name.replace("_", " ") for line in done.events]
    rows = []
    for name, flight in done.flights.items():
        told = [line.flights[name] for line in done.events]
        rows.append(
            [
                name,
                " / ".join(map(str, flight.last_sample)),
                " / ".join(f"{one:.2f}" for one in energy_Wh(flight)),
                f"{flight.covered[-1]} of {len(flight.scenario.waypoints)}",
                str(len(flight.violations)),
                str(flight.breaches),
                *(_told(event.happened, event.time_s) for event in told),
            ]
        )
    return headings, rows


def setting_cells(done: ReproducedPaper) -> Cells:
    """Headings and rows: the paper's table of parameters, and what was flown."""
    return ["parameter", "paper", "flown", "kept", "why it differs"], [
        [
            line.setting.symbol,
            _values(line.setting.value),
            _values(line.flown) or NOTHING,
            _yes(line.within),
            line.setting.reason,
        ]
        for line in done.settings
    ]


def size_cells(sizes: Sequence[ClassSize]) -> Cells:
    """Headings and rows: rows, columns and binaries by class of constraints."""
    counts = [(one.rows, one.columns, one.binaries) for one in sizes]
    totals = [sum(column) for column in zip(*counts, strict=True)]

    def row(name: str, *numbers: int) -> list[str]:
        parts = zip(numbers, totals, strict=True)
        return [name, *(f"{n} ({n / total:.0%})" if total else "0" for n, total in parts)]

    return ["class", "rows", "columns", "binaries"], [
        *(row(one.name, *count) for one, count in zip(sizes, counts, strict=True)),
        row("all", *totals),
    ]


def timing_cells(timings: Sequence[Timing]) -> Cells:
    """Headings and rows: how long a decision takes with a class left out."""
    return ["left out", *_TIMED], [[one.name, *_timed(one)] for one in timings]


def trade_cells(trades: Sequence[Trade]) -> Cells:
    """Headings and rows: what a parameter costs and gives."""
    return ["parameter", "value", *_TIMED, "gives"], [
        [
            one.parameter,
            str(one.value),
            *(_timed(one.timing) if one.timing else ["the same"] * len(_TIMED)),
            one.accuracy,
        ]
        for one in trades
    ]


_TIMED = ("rows", "columns", "binaries", "processor time, s", "gap")


def _timed(one: Timing) -> list[str]:
    took = f"{one.seconds:.1f}" if one.solved else f"not within {one.seconds:.1f}"
    gap = f"{one.gap:.1%}" if math.isfinite(one.gap) else "no solution"
    return [str(one.rows), str(one.columns), str(one.binaries), took, gap]


def _figure_row(line: FigureLine) -> list[str]:
    figure, digits = line.figure, line.figure.digits
    name = f"{figure.title}, {figure.unit}" if figure.unit else figure.title
    spread = mean = NOTHING
    if line.drawn:
        low, high = min(line.drawn), max(line.drawn)
        spread = f"{median(line.drawn):.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"
    if line.mean.low is not None and line.mean.high is not None:
        interval = f"[{line.mean.low:.{digits}f}, {line.mean.high:.{digits}f}]"
        mean = f"{line.mean.value:.{digits}f} {interval}"
    return [
        name,
        line.uas,
        f"{line.paper:.{digits}f}",
        f"{line.ours:.{digits}f}",
        f"{line.difference:+.1%}",
        f"{figure.tolerance:.0%}",
        _yes(line.within),
        spread,
        mean,
    ]


def _told(happened: bool, time_s: float | None) -> str:
    return _yes(happened) if time_s is None else f"{_yes(happened)}, {time_s:.0f} s"


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _values(value: Sequence[float]) -> str:
    return ", ".join(f"{number:.4g}" for number in value)


def _pictures(done: ReproducedPaper) -> dict[str, tuple[str, bytes]]:
    """File -> title and content: the paper's Figs. 1 to 3 of our flight."""
    flight: Flight = done.flights[done.paper.scenario]
    result = {}
    for title, step in done.paper.snapshots.items():
        shown = min(step, flight.steps)
        name = f"{title.lower().replace('. ', '_')}_step_{shown}.png"
        result[name] = (f"{title}, step {shown}", png_of(map_figure(flight, step=shown)))
    battery = png_of(battery_figure(flight, published=True))
    result["fig_3_battery.png"] = ("Fig. 3; the paper's curves in grey", battery)
    return result


def _page(
    done: ReproducedPaper,
    sizes: Sequence[ClassSize],
    timings: Sequence[Timing],
    trades: Sequence[Trade],
    command: str,
    pictures: Sequence[str],
) -> str:
    paper, failures = done.paper, done.failures()
    verdict = "Everything keeps its stated tolerance.\n"
    if failures:
        verdict = "Out of tolerance:\n\n" + "".join(f"- {line}\n" for line in failures)
    reasons = "".join(f"- {one.title}: {one.reason}.\n" for one in paper.figures)
    settings = ", ".join(f"`{key}={value}`" for key, value in paper.planner.options.items())
    return "\n".join(
        [
            f"# {paper.title}\n",
            f"{paper.authors}: the result section, flown again.\n",
            f"`{command}`\n",
            f"{machine()}; planner `{paper.planner.name}` with {settings}.\n",
            verdict,
            "## Figures\n",
            markdown(figure_cells(done)),
            "Why a figure may differ:\n",
            reasons,
            "## What the text tells\n",
            markdown(event_cells(done)),
            "## Flights\n",
            markdown(flight_cells(done)),
            "Steps and energy are those of the first / the second UAS.\n",
            *(f"![{name}]({name})\n" for name in pictures),
            "## Table I\n",
            markdown(setting_cells(done)),
            "## Size of the program\n",
            "The first decision with all waypoints, the rows as the paper has them:\n",
            markdown(size_cells(sizes)),
            f"A decision in flight in the form `{SOLVED_FORM}`, on one thread, with a part of it "
            f"left out, to a gap of {GAP:.0%} of what all open waypoints cost over the horizon:\n",
            markdown(timing_cells(timings)),
            "## What accuracy costs\n",
            markdown(trade_cells(trades)),
        ]
    )


def _csv(lines: Sequence[FigureLine]) -> str:
    text = io.StringIO()
    rows = [_flat(line) for line in lines]
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _flat(line: FigureLine) -> dict[str, Any]:
    return {
        "figure": line.figure.name,
        "unit": line.figure.unit,
        "uas": line.uas,
        "paper": line.paper,
        "ours": line.ours,
        "difference": line.difference,
        "tolerance": line.figure.tolerance,
        "within": line.within,
        "maps": len(line.drawn),
        "median": median(line.drawn) if line.drawn else None,
        "least": min(line.drawn, default=None),
        "most": max(line.drawn, default=None),
        "mean": line.mean.value,
        "mean_low": line.mean.low,
        "mean_high": line.mean.high,
        "reason": line.figure.reason,
    }


def _data(
    done: ReproducedPaper,
    sizes: Sequence[ClassSize],
    timings: Sequence[Timing],
    trades: Sequence[Trade],
    command: str,
) -> Mapping[str, Any]:
    return {
        "command": command,
        "machine": machine(),
        "failures": done.failures(),
        "figures": [_flat(line) for line in done.figures],
        "settings": [
            {**line.setting.model_dump(), "flown": line.flown, "within": line.within}
            for line in done.settings
        ],
        "events": [
            {
                **line.told.model_dump(),
                "flights": {name: asdict(event) for name, event in line.flights.items()},
            }
            for line in done.events
        ],
        "sizes": [asdict(one) for one in sizes],
        "timings": [_finite(asdict(one)) for one in timings],
        "trades": [
            {**asdict(one), "timing": one.timing and _finite(asdict(one.timing))} for one in trades
        ],
    }


def _finite(data: dict[str, Any]) -> dict[str, Any]:
    return {**data, "gap": data["gap"] if math.isfinite(data["gap"]) else None}

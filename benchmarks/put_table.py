"""Put the tables of a comparison where they are published.

    python benchmarks/put_table.py sweep         the leaderboard
    python benchmarks/put_table.py sweep test    the same planners on the `test` set
    python benchmarks/put_table.py sweep light   in light wind; likewise moderate, strong,
                                                 nonlinear (the plant), karhula, indoor, "air taxi",
                                                 searched (an order for milp-mpc), horizon (its N)
    python benchmarks/put_table.py sweep village its flights of the village, and "ten seeds":
                                                 median and range of each planner's flights
    python benchmarks/put_table.py sweep fronts  time and energy of each mission by `weight_energy`,
                                                 and the picture of the fronts

Fills what stands between the marks `<!-- leaderboard -->` of `baselines/README.md` (`table.md`
without what its columns mean, and without single scenarios) and of `README.md` (a short table),
and copies the picture to `docs/pictures`; or a short table between the marks of another name
(`<!-- test -->`) of `baselines/README.md`; `village` is on `README.md`, `ten seeds` and `fronts` on
`docs/trajectory.md`.
Exits 2 where a file or a mark is missing, or a file was damaged.
"""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from marks import ROOT, filled

from uas_coverage_env.files.digits import three_digits
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.leaderboard.row import Row
from uas_coverage_env.runner.store import rows_in

HARD = ("light", "moderate", "strong", "nonlinear", "indoor", "air taxi")  # not all is covered
OF_FLIGHTS = {
    "village": ROOT / "README.md",
    "ten seeds": ROOT / "docs" / "trajectory.md",
    "fronts": ROOT / "docs" / "trajectory.md",
}
MARKS = ("leaderboard", "test", "karhula", "searched", "horizon", *HARD, *OF_FLIGHTS)
WEIGHTS = {
    "0.4": "all that help (`weight_energy` 0.4)",
    "0.6": "0.6, the default",
    "20": "one UAS (20)",
}
COLUMNS_EXPLAINED = "Interquartile means"
PICTURES = {name: ROOT / "docs" / "pictures" / f"{name}.png" for name in ("leaderboard", "front")}


def short_table(data: dict[str, Any], mark: str = "leaderboard") -> str:
    """A row for each planner: missions accomplished, energy and steps beside the reference.

    Where missions may not be accomplished, coverage takes the place of decision times and bound.
    """
    reference = data["reference"]
    columns = dict(_HARD if mark in HARD else _STILL)
    columns[f"Δ energy to {reference}, %"] = lambda one: _difference(one, reference, "energy")
    columns["Δ steps, %"] = lambda one: _difference(one, reference, "steps")
    bounded = any(one["above_bound_percent"]["value"] is not None for one in data["scores"])
    if bounded and mark not in HARD:
        columns["above the bound, %"] = lambda one: _plain(_estimate(one["above_bound_percent"]))
    lines = [
        "| " + " | ".join(["planner", *columns]) + " |",
        "|---|" + "---:|" * len(columns),
    ]
    for one in data["scores"]:
        cells = [f"`{_label(one)}`", *(cell(one) for cell in columns.values())]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([f"`{data['command']}`", "", *lines])


def spread_table(rows: Sequence[Row], command: str) -> str:
    """A row for each planner, least energy first: flights, accomplished, steps and energy.

    Steps and energy are the median, and the range where there are several flights.
    """
    flown: dict[str, list[Row]] = {}
    for one in rows:
        flown.setdefault(one.label, []).append(one)
    lines = ["| planner | accomplished | steps | energy, Wh |", "|---|---:|---:|---:|"]
    by_energy = sorted(
        flown.items(), key=lambda item: np.median([one.energy_Wh for one in item[1]])
    )
    for label, mine in by_energy:
        steps = _spread([one.steps for one in mine], "g")
        energy = _spread([one.energy_Wh for one in mine], ".2f")
        done = sum(one.accomplished for one in mine)
        lines.append(f"| `{label}` | {done} of {len(mine)} | {steps} | {energy} |")
    return "\n".join([f"`{command}`", "", *lines])


def fronts_table(rows: Sequence[Row], command: str) -> str:
    """Steps and energy of each mission by the weight of energy that its flight was planned with."""
    headings = WEIGHTS.values()
    lines = [f"| mission | {' | '.join(headings)} |", "| --- |" + " ---: |" * len(headings)]
    flown: dict[str, dict[str, Row]] = {}
    for one in rows:
        weight = one.label.partition("+weight_energy-")[2].partition("+")[0]
        flown.setdefault(one.scenario, {})[weight] = one
    for scenario, by_weight in sorted(flown.items()):
        cells = [
            f"{by_weight[weight].steps} steps, {by_weight[weight].energy_Wh:.2f} Wh"
            if weight in by_weight and by_weight[weight].accomplished
            else "–"
            for weight in WEIGHTS
        ]
        lines.append(f"| {scenario} | {' | '.join(cells)} |")
    return "\n".join([f"`{command}`", "", *lines])


def _spread(values: Sequence[float], digits: str) -> str:
    if len(values) == 1:
        return f"{values[0]:{digits}}"
    low, high = min(values), max(values)
    return f"{np.median(values):{digits}} ({low:{digits}} to {high:{digits}})"


_Columns = dict[str, Callable[[dict[str, Any]], str]]

_STILL: _Columns = {
    "accomplished": lambda one: f"{one['accomplished']}/{one['flights']}",
    "violations": lambda one: str(one["violations"]),
    "decision p50, ms": lambda one: (
        "–" if one["decision_p50_ms"] is None else three_digits(one["decision_p50_ms"])
    ),
}

_HARD: _Columns = {
    "accomplished": _STILL["accomplished"],
    "all home": lambda one: f"{one['all_home']}/{one['flights']}",
    "violations": _STILL["violations"],
    "breaches": lambda one: str(one["breaches"]),
    "covered, %": lambda one: _plain(_estimate(one["mean_coverage_percent"])),
}


def _label(one: dict[str, Any]) -> str:
    return one["label"] if "label" in one else one["player"]  # of version 0.2


def _difference(one: dict[str, Any], reference: str, name: str) -> str:
    return "" if _label(one) == reference else _estimate(one[f"{name}_difference_percent"])


def _plain(estimate: str) -> str:
    """Without signs, which only differences need."""
    return estimate.replace("+", "")


def _estimate(found: dict[str, float | None]) -> str:
    if found["value"] is None:
        return "–"
    if found["low"] is None:
        return f"{found['value']:+.1f}"
    return f"{found['value']:+.1f} [{found['low']:+.1f}, {found['high']:+.1f}]"


def main(folder: str, mark: str = "leaderboard") -> int:
    """Fill the files; the exit code."""
    sweep = Path(folder)
    try:
        short = _of_flights(sweep, mark) if mark in OF_FLIGHTS else _short(sweep, mark)
        contents = {OF_FLIGHTS.get(mark, ROOT / "baselines" / "README.md"): short}
        if mark == "leaderboard":
            long = _long((sweep / "table.md").read_text(encoding="utf-8"))
            contents = {ROOT / "README.md": short, ROOT / "baselines" / "README.md": long}
        texts = {}
        for path, content in contents.items():
            try:
                texts[path] = filled(path.read_text(encoding="utf-8"), content, mark)
            except ValueError as error:
                raise ValueError(f"{path} {error}") from error
        for path, text in texts.items():
            path.write_text(text, encoding="utf-8", newline="")
        if mark == "leaderboard":
            shutil.copyfile(sweep / "coverage-energy.png", PICTURES["leaderboard"])
        elif mark == "fronts":
            shutil.copyfile(sweep / "front.png", PICTURES["front"])
    except (OSError, ValueError, InputError) as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    return 0


def _long(table: str) -> str:
    """The table up to the words on its columns, which `docs/leaderboard.md` explains."""
    return table.partition(f"\n{COLUMNS_EXPLAINED}")[0]


def _of_flights(sweep: Path, mark: str) -> str:
    data = json.loads((sweep / "table.json").read_text(encoding="utf-8"))
    if mark == "fronts":
        return fronts_table(rows_in(sweep, Row), data["command"])
    rows = [one for one in rows_in(sweep, Row) if one.scenario == "village"]
    if not rows:
        raise ValueError(f"{sweep}: has no flight of the village")
    return spread_table(rows, data["command"])


def _short(sweep: Path, mark: str) -> str:
    path = sweep / "table.json"
    try:
        return short_table(json.loads(path.read_text(encoding="utf-8")), mark)
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise ValueError(f"{path}: was damaged ({error}); compare again") from error


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3) or sys.argv[2:] not in ([], *([mark] for mark in MARKS)):
        sys.exit(f"usage: {sys.argv[0]} FOLDER_OF_A_COMPARISON [{'|'.join(MARKS)}]")
    sys.exit(main(*sys.argv[1:]))

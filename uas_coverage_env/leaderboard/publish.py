"""The files of a comparison: flights in the store, scores as CSV, JSON and Markdown, a picture."""

import csv
import dataclasses
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from uas_coverage_env.files.output_dir import write_files
from uas_coverage_env.files.plain_files import read_bytes
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard.bounds import Bounds
from uas_coverage_env.leaderboard.front import Fronts, front_cells, front_figure
from uas_coverage_env.leaderboard.hardware import machine, versions
from uas_coverage_env.leaderboard.picture import drawn, leaderboard_figure
from uas_coverage_env.leaderboard.row import FAILED, Row
from uas_coverage_env.leaderboard.scores import Scores, scores_of
from uas_coverage_env.leaderboard.table import (
    cells,
    markdown,
    notes,
    scenarios_cells,
)
from uas_coverage_env.runner.store import STORE, columns_of, rows_in

FLIGHTS, TABLE, SCORES = "flights.parquet", "table.md", "table.json"
PICTURE = "coverage-energy.png"
FRONT, FRONT_PICTURE = "front.md", "front.png"


@dataclass(frozen=True)
class Comparison:
    """A sweep, or as much of it as was flown, summed up.

    Attributes:
        rows: Its flights.
        planned: How many flights the whole sweep has.
        reference: Label of the planner that the others are compared with.
        command: The command line that made it.
        jobs: How it was flown, for people.
        scores: Of each planner, best first.
        fronts: Of each mission, where options were varied: time against energy.
    """

    rows: Sequence[Row]
    planned: int
    reference: str
    command: str
    jobs: str
    scores: Sequence[Scores]
    fronts: Fronts = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        rows: Sequence[Row],
        planned: int,
        reference: str,
        command: str,
        jobs: str,
        bounds: Bounds = MappingProxyType({}),
        fronts: Fronts = MappingProxyType({}),
    ) -> "Comparison":
        """Sum up rows, of which there is at least one."""
        scores = scores_of(rows, reference, bounds)
        return cls(rows, planned, reference, command, jobs, scores, fronts)

    def circumstances(self) -> list[str]:
        """Command, extent, machine and versions, a line each."""
        scenarios = len({row.scenario for row in self.rows})
        seeds = len({row.seed for row in self.rows})
        some = "" if len(self.rows) == self.planned else f" of {self.planned} (not finished)"
        lines = [
            f"{self.command}",
            f"{_counted(len(self.rows), 'flight')}{some}: "
            f"{_counted(len(self.scores), 'planner')}, {_counted(scenarios, 'scenario')}, "
            f"{_counted(seeds, 'seed')}",
            f"{machine()}; {self.jobs}",
            versions(),
        ]
        sources = len({row.source_sha256 for row in self.rows})
        if sources > 1:
            lines.append(
                f"The flights were flown by {sources} states of the source code, all of them "
                "called by the same version; --overwrite flies them anew."
            )
        return lines

    def write(self, directory: Path) -> list[str]:
        """Write all files; returns their names.

        Raises:
            InputError: One cannot be written.
        """
        files = {
            "table.csv": _csv(self.scores).encode(),
            SCORES: _json(self).encode(),
            TABLE: _markdown(self).encode(),
            PICTURE: drawn(lambda: leaderboard_figure(self.scores, self.rows, self.reference)),
        }
        if fronts := self.fronts:
            parts = [f"`{self.command}`\n"]
            for name, choices in fronts.items():
                parts += [f"{name}:\n", markdown(front_cells(choices))]
            files[FRONT] = "\n".join(parts).encode()
            files[FRONT_PICTURE] = drawn(lambda: front_figure(fronts))
        there = {name: content for name, content in files.items() if content is not None}
        write_files(directory, there)
        return list(there)


def read_comparison(directory: Path) -> tuple[list[Row], str]:
    """The flights of a comparison and the label of its reference, from the files that it wrote.

    Raises:
        InputError: A file is missing, or is none that this version writes.
    """
    table = directory / SCORES
    rows = rows_in(directory, Row)
    try:
        reference = json.loads(read_bytes(table))["reference"]
    except (OSError, ValueError, RecursionError, KeyError, TypeError) as error:
        raise InputError(f"{table}: cannot be read, or names no reference ({error})") from error
    if not rows:
        raise InputError(f"{directory / STORE}: holds no flight")
    if not isinstance(reference, str) or reference not in {row.label for row in rows}:
        raise InputError(f"{table}: the reference {reference!r} has no flight in {STORE}")
    return rows, reference


def parquet(rows: Sequence[Row]) -> bytes:
    """Flights as a parquet file, a column for each field of `Row`.

    Raises:
        InputError: polars (extra `parquet`) is not installed.
    """
    try:
        import polars
    except ImportError as error:
        raise InputError(
            f"--parquet: polars cannot be loaded ({error}); "
            "python -m pip install 'uas-coverage-env[parquet]'"
        ) from error
    kinds = {str: polars.String, int: polars.Int64, bool: polars.Boolean, float: polars.Float64}
    schema = {name: kinds[kind] for name, (kind, *_) in columns_of(Row).items()}
    values = [dataclasses.astuple(row) for row in rows]
    file = io.BytesIO()
    polars.DataFrame(values, schema, orient="row").write_parquet(file)
    return file.getvalue()


def _csv(scores: Sequence[Scores]) -> str:
    text = io.StringIO()
    flat = [one.flat() for one in scores]
    writer = csv.DictWriter(text, list(flat[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    return text.getvalue()


def _json(comparison: Comparison) -> str:
    data: dict[str, Any] = {
        "command": comparison.command,
        "machine": machine(),
        "versions": versions(),
        "reference": comparison.reference,
        "flights": len(comparison.rows),
        "planned": comparison.planned,
        "scores": [one.plain() for one in comparison.scores],
    }
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _markdown(comparison: Comparison) -> str:
    rows, reference = comparison.rows, comparison.reference
    labels = [one.label for one in comparison.scores]
    command, *circumstances = comparison.circumstances()
    parts = [f"`{command}`\n", *(f"{line}\n" for line in circumstances)]
    parts += [markdown(cells(comparison.scores, table)) for table in ("outcome", "effort")]
    if len(labels) > 1 and reference in labels:
        parts.append(markdown(cells(comparison.scores, "reference", reference)))
    parts += [f"{line}\n" for line in notes(rows, reference)]
    if lines := failures(rows):
        parts.append("".join(f"- {line}\n" for line in lines))
    parts.append("Energy and steps on each scenario, means of the accomplished flights:\n")
    parts.append(markdown(scenarios_cells(rows, labels)))
    return "\n".join(parts)


def failures(rows: Sequence[Row]) -> list[str]:
    """What is wrong with flights, a line for each reason of each planner: empty where nothing is.

    They could not be flown, the independent checker disagrees, or figures could not be computed.
    """
    found: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        wrong = {
            "failed": row.reason if row.status == FAILED else None,
            "disagrees with the independent checker on": row.verdict if row.disagrees else None,
            "lacks figures of": row.failed_figures,
        }
        for what, why in wrong.items():
            if why is not None:
                found.setdefault((row.label, what, why), []).append(row)
    return [
        f"{label} {what} {len(those)} {'flight' if len(those) == 1 else 'flights'} "
        f"(first: {those[0].scenario}, seed {those[0].seed}): {why}"
        for (label, what, why), those in found.items()
    ]


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"

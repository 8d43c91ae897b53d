"""The files of a comparison: flights in the store, scores as CSV, JSON and Markdown, a picture."""

import csv
import dataclasses
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from uas_coverage_env.files.output_dir import write_files
from uas_coverage_env.files.plain_files import read_bytes
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard.bounds import Bounds
from uas_coverage_env.leaderboard.hardware import machine, versions
from uas_coverage_env.leaderboard.picture import picture
from uas_coverage_env.leaderboard.row import FAILED, Row
from uas_coverage_env.leaderboard.scores import Scores, scores_of
from uas_coverage_env.leaderboard.table import (
    effort_cells,
    markdown,
    notes,
    outcome_cells,
    reference_cells,
    scenarios_cells,
)
from uas_coverage_env.runner.store import STORE, columns_of, rows_in

FLIGHTS, TABLE, SCORES = "flights.parquet", "table.md", "table.json"
PICTURE = "coverage-energy.png"


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
    """

    rows: Sequence[Row]
    planned: int
    reference: str
    command: str
    jobs: str
    scores: Sequence[Scores]

    @classmethod
    def of(
        cls,
        rows: Sequence[Row],
        planned: int,
        reference: str,
        command: str,
        jobs: str,
        bounds: Bounds = MappingProxyType({}),
    ) -> "Comparison":
        """Sum up rows, of which there is at least one."""
        return cls(rows, planned, reference, command, jobs, scores_of(rows, reference, bounds))

    def circumstances(self) -> list[str]:
        """Command, extent, machine and versions, a line each."""
        scenarios = len({row.scenario for row in self.rows})
        seeds = len({row.seed for row in self.rows})
        some = "" if len(self.rows) == self.planned else f" of {self.planned} (not finished)"
        lines = [
            f"{self.command}",
            f"{len(self.rows)} flights{some}: {len(self.scores)} planners, {scenarios} scenarios, "
            f"{seeds} {'seed' if seeds == 1 else 'seeds'}",
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


def write(comparison: Comparison, directory: Path) -> list[str]:
    """Write all files; returns their names.

    Raises:
        InputError: One cannot be written.
    """
    files = {
        "table.csv": _csv(comparison.scores).encode(),
        SCORES: _json(comparison).encode(),
        TABLE: _markdown(comparison).encode(),
        PICTURE: picture(comparison.scores, comparison.rows, comparison.reference),
    }
    there = {name: content for name, content in files.items() if content is not None}
    write_files(directory, there)
    return list(there)


def published(directory: Path) -> tuple[list[Row], str]:
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
        "scores": [dataclasses.asdict(one) for one in comparison.scores],
    }
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _markdown(comparison: Comparison) -> str:
    rows, reference = comparison.rows, comparison.reference
    labels = [one.label for one in comparison.scores]
    command, *circumstances = comparison.circumstances()
    parts = [f"`{command}`\n", *(f"{line}\n" for line in circumstances)]
    parts.append(markdown(outcome_cells(comparison.scores)))
    parts.append(markdown(effort_cells(comparison.scores)))
    if len(labels) > 1 and reference in labels:
        parts.append(markdown(reference_cells(comparison.scores, reference)))
    parts += [f"{line}\n" for line in notes(rows, reference)]
    failed = [row for row in rows if row.status == FAILED]
    if failed:
        parts.append("".join(f"- {line}\n" for line in failures(failed)))
    parts.append("Energy and steps on each scenario, means of the accomplished flights:\n")
    parts.append(markdown(scenarios_cells(rows, labels)))
    return "\n".join(parts)


def failures(failed: Sequence[Row]) -> list[str]:
    """Why flights failed, a line for each reason of each planner."""
    found: dict[tuple[str, str], list[Row]] = {}
    for row in failed:
        found.setdefault((row.label, row.reason or ""), []).append(row)
    return [
        f"{label} failed {len(rows)} {'flight' if len(rows) == 1 else 'flights'} "
        f"(first: {rows[0].scenario}, seed {rows[0].seed}): {reason}"
        for (label, reason), rows in found.items()
    ]

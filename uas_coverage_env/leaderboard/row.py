"""What is kept of a compared flight: one flat record, the same in the store and in the files."""

import dataclasses
import hashlib
import json
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Self

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.figures import computed, figures, rows_part
from uas_coverage_env.leaderboard.sweep import Entry

FLOWN, FAILED = "flown", "failed"

AGREES, NOT_JUDGED = "agrees", "not judged"
"""What `verdict` begins with where the independent checker does not disagree."""

TIMES = (*(name for name, each in figures().items() if not each.repeats), "finished_at")
"""Differ from run to run; everything else of a repeatable flight repeats."""


@dataclass(frozen=True)
class _Flown:
    """One flight: what was flown, and its figures (docs/flight_directory.md), each by its name.

    Attributes:
        key: Hash of all that decides how the flight goes.
        scenario: Name of the scenario.
        scenario_sha256: Hash of the scenario.
        level: Of which level the mission is; empty: of none.
        label: Of the planner with its options.
        planner: Name of the planner.
        options: Its options, as JSON.
        seed: The seed of the planner.
        dynamics: `lpv` or `nonlinear`.
        safety_filter: Whether the filter was on for all UAS.
        status: `flown`, or `failed` where there is no flight.
        reason: Why it failed.
        verdict: What the independent checker says: `agrees`, `not judged:` and why, or in what it
            disagrees; None where it was not asked.
        failed_figures: Which figures could not be computed, and why; None: all could.
        trajectory_sha256: Hash of every state of every UAS.
        versions: Package -> version, as JSON.
        source_sha256: Hash of the source code that flew it.
        finished_at: When, UTC.
    """

    key: str
    scenario: str
    scenario_sha256: str
    level: str
    label: str
    planner: str
    options: str
    seed: int
    dynamics: str
    safety_filter: bool
    status: str
    reason: str | None
    verdict: str | None
    failed_figures: str | None
    trajectory_sha256: str | None
    versions: str
    source_sha256: str
    finished_at: str

    if TYPE_CHECKING:

        def __getattr__(self, figure: str) -> Any:
            """A figure."""

    def __post_init__(self) -> None:
        """Refuse a status that there is none of."""
        if self.status not in (FLOWN, FAILED):
            raise ValueError(f"status of a flight is {self.status[:40]!r}")

    @classmethod
    def of(
        cls, entry: Entry, flight: Flight, source_sha256: str, verdict: str | None = None
    ) -> Self:
        """The row of a flight that was flown, and what the independent checker says of it."""
        values, failed = computed(flight)
        return cls(
            **_identity(entry),
            status=FLOWN,
            reason=None,
            verdict=verdict,
            failed_figures="; ".join(failed.values()) or None,
            trajectory_sha256=hashlib.sha256(flight.x.tobytes()).hexdigest(),
            versions=json.dumps(dict(flight.versions), sort_keys=True),
            source_sha256=source_sha256,
            finished_at=_now(),
            **rows_part(values),
        )

    @classmethod
    def failed(cls, entry: Entry, reason: str, source_sha256: str) -> Self:
        """The row of a flight that could not be flown to its end."""
        figures = rows_part(None)
        figures["n_uas"] = len(entry.scenario.uas)
        return cls(
            **_identity(entry),
            status=FAILED,
            reason=" ".join(reason.split()),
            verdict=None,
            failed_figures=None,
            trajectory_sha256=None,
            versions="{}",
            source_sha256=source_sha256,
            finished_at=_now(),
            **figures,
        )

    @property
    def ranked(self) -> bool:
        """Whether its energy counts: it was flown, and nothing was violated."""
        return self.status == FLOWN and not self.violations

    @property
    def disagrees(self) -> bool:
        """Whether the independent checker disagrees with it."""
        return self.verdict is not None and not self.verdict.startswith((AGREES, NOT_JUDGED))


_TAKEN = {field.name for field in dataclasses.fields(_Flown)} | set(vars(_Flown))
for _name in figures():
    if _name in _TAKEN:
        raise InputError(f"figure {_name!r}: rows have something else of this name; rename it")

if TYPE_CHECKING:
    Row = _Flown
else:
    Row = dataclasses.make_dataclass(
        "Row",
        [
            (name, each.row_kind, dataclasses.field(default=each.absent))
            for name, each in figures().items()
            if each.in_rows
        ],
        bases=(_Flown,),
        namespace={"__doc__": _Flown.__doc__, "__module__": __name__},
        frozen=True,
    )


def _identity(entry: Entry) -> dict[str, Any]:
    return {
        "key": entry.key,
        "scenario": entry.scenario.name,
        "scenario_sha256": entry.scenario_sha256,
        "level": entry.level,
        "label": entry.spec.label,
        "planner": entry.spec.planner,
        "options": json.dumps(dict(entry.spec.options), sort_keys=True),
        "seed": entry.seed,
        "dynamics": entry.dynamics,
        "safety_filter": bool(entry.safety_filter),
    }


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")

"""What is kept of a compared flight: one flat record, the same in the store and in the files."""

import hashlib
import json
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Self

from uas_coverage_env.flight import (
    Flight,
    accomplished,
    episode_return,
    filtered_share,
    home,
    summary,
)
from uas_coverage_env.flight.record import LOST
from uas_coverage_env.leaderboard.sweep import Entry

FLOWN, FAILED = "flown", "failed"

# differ from run to run; everything else of a repeatable flight repeats
TIMES = ("decision_p50_s", "decision_p95_s", "wall_time_s", "finished_at")


@dataclass(frozen=True)
class Row:
    """One flight.

    Attributes:
        key: Hash of all that decides how the flight goes.
        scenario: Name of the scenario.
        scenario_sha256: Hash of the scenario.
        level: Of which the mission is (`tasks.LEVELS`); empty where of none.
        label: Of the planner with its options.
        planner: Name of the planner.
        options: Its options, as JSON.
        seed: The seed of the planner.
        dynamics: `lpv` or `nonlinear`.
        safety_filter: Whether the filter was on for all UAS.
        status: `flown`, or `failed` where there is no flight.
        reason: Why it failed.
        accomplished: All waypoints covered, all UAS home, no contact, no limit exceeded.
        coverage: Fraction of the waypoints; 0 where the flight failed.
        all_home: Whether all UAS have landed.
        n_uas: UAS of the mission.
        home: UAS that have landed.
        lost: UAS that were lost.
        violations: Contacts, and limits exceeded by UAS.
        breaches: Samples closer than the safe distances.
        steps: Steps until the last UAS was home, lost, or the flight ended.
        energy_Wh: Energy of the swarm.
        min_separation_m: Smallest distance between two flying UAS.
        min_obstacle_clearance_m: Smallest clearance from any obstacle.
        decision_p50_s: Median time of a decision.
        decision_p95_s: 95th percentile.
        fallbacks: Decisions flown on a fallback.
        filtered_share: Share of the commands that the safety filter replaced, 0..1.
        trajectory_sha256: Hash of every state of every UAS.
        wall_time_s: Time that the flight took to compute.
        versions: Package -> version, as JSON.
        source_sha256: Hash of the source code that flew it.
        finished_at: When, UTC.
        episode_return: Sum of the rewards of all UAS, as the environments pay by default, not
            discounted; None where the flight failed.
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
    accomplished: bool
    coverage: float
    all_home: bool
    n_uas: int
    home: int
    lost: int
    violations: int
    breaches: int
    steps: int | None
    energy_Wh: float | None
    min_separation_m: float | None
    min_obstacle_clearance_m: float | None
    decision_p50_s: float | None
    decision_p95_s: float | None
    fallbacks: int
    filtered_share: float
    trajectory_sha256: str | None
    wall_time_s: float | None
    versions: str
    source_sha256: str
    finished_at: str
    episode_return: float | None

    def __post_init__(self) -> None:
        """Refuse a status that there is none of."""
        if self.status not in (FLOWN, FAILED):
            raise ValueError(f"status of a flight is {self.status[:40]!r}")

    @classmethod
    def of(cls, entry: Entry, flight: Flight, source_sha256: str) -> Self:
        """The row of a flight that was flown."""
        result = summary(flight)
        return cls(
            **_identity(entry),
            status=FLOWN,
            reason=None,
            accomplished=accomplished(flight),
            coverage=result["coverage"],
            all_home=result["all_home"],
            n_uas=len(flight.names),
            home=int(home(flight).sum()),
            lost=int((flight.mode[-1] == LOST).sum()),
            violations=len(result["violations"]),
            breaches=result["breaches"],
            steps=result["steps"],
            energy_Wh=result["energy_Wh"],
            min_separation_m=result["min_separation_m"],
            min_obstacle_clearance_m=result["min_obstacle_clearance_m"],
            decision_p50_s=result["decision_time_s"]["p50"],
            decision_p95_s=result["decision_time_s"]["p95"],
            fallbacks=result["fallbacks"],
            filtered_share=filtered_share(flight),
            trajectory_sha256=hashlib.sha256(flight.x.tobytes()).hexdigest(),
            wall_time_s=result["wall_time_s"],
            versions=json.dumps(result["versions"], sort_keys=True),
            source_sha256=source_sha256,
            finished_at=_now(),
            episode_return=episode_return(flight),
        )

    @classmethod
    def failed(cls, entry: Entry, reason: str, source_sha256: str) -> Self:
        """The row of a flight that could not be flown to its end."""
        return cls(
            **_identity(entry),
            status=FAILED,
            reason=" ".join(reason.split()),
            accomplished=False,
            coverage=0.0,
            all_home=False,
            n_uas=len(entry.scenario.uas),
            home=0,
            lost=0,
            violations=0,
            breaches=0,
            steps=None,
            energy_Wh=None,
            min_separation_m=None,
            min_obstacle_clearance_m=None,
            decision_p50_s=None,
            decision_p95_s=None,
            fallbacks=0,
            filtered_share=0.0,
            trajectory_sha256=None,
            wall_time_s=None,
            versions="{}",
            source_sha256=source_sha256,
            finished_at=_now(),
            episode_return=None,
        )

    @property
    def ranked(self) -> bool:
        """Whether its energy counts: it was flown, and nothing was violated."""
        return self.status == FLOWN and not self.violations


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

"""The list of flights to fly: scenarios x planners x seeds, each known by what it is."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from typing import Any

from uas_coverage_env.entities.codes import DynamicsName
from uas_coverage_env.env.versions import V0, Version
from uas_coverage_env.leaderboard.hashing import content_hash, source_hash
from uas_coverage_env.leaderboard.planner_specs import PlannerSpec
from uas_coverage_env.leaderboard.scenario_sets import scenario_hash
from uas_coverage_env.scenario import Scenario

PACKAGE = "uas-coverage-env"


@dataclass(frozen=True)
class Entry:
    """One flight to fly.

    Attributes:
        scenario: On what it is flown.
        scenario_sha256: Its hash.
        spec: The planner with its options.
        seed: Of the planner, and of what disturbances draw.
        dynamics: `lpv` or `nonlinear`.
        safety_filter: Whether the world keeps commands clear of harm; None: as the planner asks.
        return_mode: Whether the world brings UAS home in time; None: as the planner asks.
        environment: Version of the environments whose reward is recorded; a level's name says it.
        reward_weights: Of the terms whose weights are not the default ones.
        level: Of which the mission is; empty where of none.
    """

    scenario: Scenario
    scenario_sha256: str
    spec: PlannerSpec
    seed: int
    dynamics: DynamicsName = "lpv"
    safety_filter: bool | None = None
    return_mode: bool | None = None
    environment: Version = V0
    reward_weights: Mapping[str, float] = field(default_factory=dict)
    level: str = ""

    @cached_property
    def key(self) -> str:
        """Hash of all that decides how the flight goes."""
        return content_hash(
            {
                "version": version(PACKAGE),
                "scenario": self.scenario_sha256,
                "label": self.spec.label,  # two labels of one planner are two rows
                **self.spec.identity(),
                "seed": self.seed,
                "dynamics": self.dynamics,
                "safety_filter": self.safety_filter,
                "return_mode": self.return_mode,
                "reward_weights": dict(self.reward_weights),
                "level": self.level,
            }
        )


@dataclass(frozen=True)
class Sweep:
    """All that a comparison flies.

    Attributes:
        scenarios: By name.
        planners: By label.
        seeds: Of the planners.
        dynamics: `lpv` or `nonlinear`.
        safety_filter: Whether the filter is on for all UAS.
    """

    scenarios: Mapping[str, Scenario]
    planners: Mapping[str, PlannerSpec]
    seeds: range
    dynamics: DynamicsName = "lpv"
    safety_filter: bool = False

    @property
    def size(self) -> int:
        """Number of flights."""
        return len(self.seeds) * len(self.scenarios) * len(self.planners)

    def entries(self) -> Iterator[Entry]:
        """Every flight; seed by seed, so that a sweep under way compares like with like."""
        on = self.safety_filter or None
        for seed in self.seeds:
            for name, scenario in self.scenarios.items():
                sha256 = self._scenario_hashes[name]
                for spec in self.planners.values():
                    yield Entry(scenario, sha256, spec, seed, self.dynamics, on)

    def description(self) -> dict[str, Any]:
        """The sweep as plain data: two with the same description have the same entries."""
        return {
            "version": version(PACKAGE),
            "dynamics": self.dynamics,
            "safety_filter": self.safety_filter,
            "seeds": f"{self.seeds.start}:{self.seeds.stop}",
            "scenarios": dict(self._scenario_hashes),
            "planners": {label: spec.identity() for label, spec in self.planners.items()},
        }

    @cached_property
    def _scenario_hashes(self) -> dict[str, str]:
        return {name: scenario_hash(scenario) for name, scenario in self.scenarios.items()}


def source_of(entries: Iterable[Entry]) -> str:
    """Hash of the source code that flies: the world's and the planners'.

    It is kept with each flight but is not part of its key: a comment that changes should not
    undo a sweep. The table says where flights of several sources stand in it.
    """
    return source_hash({"uas_coverage_env", *(entry.spec.package for entry in entries)})

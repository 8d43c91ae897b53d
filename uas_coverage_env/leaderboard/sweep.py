"""The list of flights to fly: scenarios x planners x seeds, each known by what it is."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from typing import Any

from uas_coverage_env.leaderboard.hashing import content_hash, source_hash
from uas_coverage_env.leaderboard.planner_specs import PlannerSpec
from uas_coverage_env.leaderboard.scenario_sets import scenario_hash
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation.world import DynamicsName

PACKAGE = "uas-coverage-env"


@dataclass(frozen=True)
class Entry:
    """One flight to fly.

    Attributes:
        key: Hash of all that decides how the flight goes.
        scenario_sha256: Hash of the scenario.
        scenario: On what it is flown.
        spec: The planner with its options.
        seed: The seed of the planner.
        dynamics: `lpv` or `nonlinear`.
        safety_filter: Whether the filter is on, whatever the planner asks for.
    """

    key: str
    scenario_sha256: str
    scenario: Scenario
    spec: PlannerSpec
    seed: int
    dynamics: DynamicsName
    safety_filter: bool


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
        common = self._common()
        for seed in self.seeds:
            for name, scenario in self.scenarios.items():
                for label, spec in self.planners.items():
                    # the label too: two labels of one planner are two rows
                    content = {
                        **{"label": label, **spec.identity(), **common},
                        **{"scenario": self._scenario_hashes[name], "seed": seed},
                    }
                    yield Entry(
                        content_hash(content),
                        self._scenario_hashes[name],
                        scenario,
                        spec,
                        seed,
                        self.dynamics,
                        self.safety_filter,
                    )

    def description(self) -> dict[str, Any]:
        """The sweep as plain data: two with the same description have the same entries."""
        return {
            **self._common(),
            "seeds": f"{self.seeds.start}:{self.seeds.stop}",
            "scenarios": dict(self._scenario_hashes),
            "planners": {label: spec.identity() for label, spec in self.planners.items()},
        }

    def _common(self) -> dict[str, Any]:
        return {
            "version": version(PACKAGE),
            "dynamics": self.dynamics,
            "safety_filter": self.safety_filter,
        }

    @cached_property
    def _scenario_hashes(self) -> dict[str, str]:
        return {name: scenario_hash(scenario) for name, scenario in self.scenarios.items()}


def source_of(planners: Iterable[PlannerSpec]) -> str:
    """Hash of the source code that flies: the world's and the planners'.

    It is kept with each flight but is not part of its key: a comment that changes should not
    undo a sweep. The table says where flights of several sources stand in it.
    """
    return source_hash(["uas_coverage_env", *(spec.package for spec in planners)])


def difference(kept: Mapping[str, Any], asked: Mapping[str, Any]) -> str:
    """The first thing in which two descriptions differ, in words; empty where nothing does."""
    for key in [*kept, *(key for key in asked if key not in kept)]:
        if key not in asked:
            return f"it has {key}, which is not asked for"
        if key not in kept:
            return f"it has no {key}"
        mine, theirs = kept[key], asked[key]
        if isinstance(mine, Mapping) and isinstance(theirs, Mapping):
            inner = difference(mine, theirs)
            if inner:
                return f"{key}: {inner}"
        elif mine != theirs:
            return f"{key} is {_short(mine)} there, {_short(theirs)} asked for"
    return ""


def _short(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 16 else f"{text[:12]}..."

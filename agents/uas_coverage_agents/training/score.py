"""How well a policy flies: whole missions in the world, as anybody would fly them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.stats import bootstrap

from uas_coverage_agents.policy import Policy
from uas_coverage_agents.policy.description import Interval, ValidationScore
from uas_coverage_agents.policy.directory import weights_sha256
from uas_coverage_agents.policy.planner import runner_of
from uas_coverage_env.files.errors import PlannerError
from uas_coverage_env.flight import Assistants, Planner
from uas_coverage_env.leaderboard import PlannerSpec, Row
from uas_coverage_env.leaderboard.flying import fly as fly_entry
from uas_coverage_env.leaderboard.row import FAILED
from uas_coverage_env.leaderboard.scenario_sets import scenario_hash
from uas_coverage_env.leaderboard.sweep import Entry, source_of
from uas_coverage_env.runner.jobs import Job
from uas_coverage_env.runner.store import Store
from uas_coverage_env.runner.workers import Workers
from uas_coverage_env.scenario import Scenario

_FIGURES = {
    "coverage": "coverage",
    "all_home": "all_home",
    "violations": "violations",
    "energy_Wh": "energy_Wh",
    "flight_steps": "steps",
    "filtered_share": "filtered_share",
    "episode_return": "episode_return",
}
MEASURES = tuple(_FIGURES)
"""Share covered, whether all are home, violations, energy of the swarm, steps until all are home,
share of the commands that the safety filter replaced, return by the default reward of the
environments (not that of the training); means over missions."""

_RESAMPLES = 2000


@dataclass(frozen=True)
class PolicySpec(PlannerSpec):
    """A policy in training, which has no directory yet.

    Attributes:
        policy: What it is now.
    """

    policy: Any = field(default=None, compare=False)

    @classmethod
    def of(cls, policy: Policy, *, safety_filter: bool, return_mode: bool) -> Self:
        """A policy with the assistants that it flies with."""
        interface, steps = policy.description.interface, policy.description.training.steps
        options = {"safety_filter": safety_filter, "return_mode": return_mode}
        sha256 = weights_sha256(policy.tensors)
        package = __name__.partition(".")[0]
        return cls(f"policy after {steps} steps", interface, options, sha256, package, policy)

    def load(self) -> Planner:
        """The runner of the policy."""
        return runner_of(self.policy, Assistants(**self.options))


@dataclass(frozen=True)
class Validation:
    """Missions that are flown for a training.

    Attributes:
        workers: Who flies.
        store: Keeps the flights, so that none is repeated; None: they are not kept.
    """

    workers: Workers = field(default_factory=Workers)
    store: Store[Row] | None = None

    def fly(
        self,
        spec: PlannerSpec,
        scenarios: Sequence[Scenario],
        *,
        safety_filter: bool | None = None,
        return_mode: bool | None = None,
    ) -> NDArray[np.float64]:
        """Fly every scenario once.

        Returns:
            (missions, measures) in the order of MEASURES.

        Raises:
            PlannerError: One cannot be flown.
        """
        entries = [
            Entry(one, scenario_hash(one), spec, 0, "lpv", safety_filter, return_mode)
            for one in scenarios
        ]
        found = {row.key: row for row in self.store.rows()} if self.store else {}
        source = source_of(entries)
        todo = [
            Job(entry.key, fly_entry, (entry, source))
            for entry in entries
            if entry.key not in found
        ]
        for job, flown in self.workers.run(todo):
            found[job.key] = flown.row
            if self.store is not None:
                self.store.add(flown.row)
        return np.array([_measured(found[entry.key]) for entry in entries], float)


def fly(
    policy: Policy,
    scenarios: Sequence[Scenario],
    *,
    safety_filter: bool = True,
    return_mode: bool = True,
    validation: Validation | None = None,
) -> NDArray[np.float64]:
    """Fly every scenario once with a policy.

    Returns:
        (missions, measures) in the order of MEASURES.
    """
    on: dict[str, Any] = {"safety_filter": safety_filter, "return_mode": return_mode}
    return (validation or Validation()).fly(PolicySpec.of(policy, **on), scenarios, **on)


def _measured(row: Row) -> list[float]:
    """One flight, in the order of MEASURES."""
    if row.status == FAILED:
        raise PlannerError(row.reason)
    return [getattr(row, name) or 0.0 for name in _FIGURES.values()]


def score_of(results: NDArray[np.float64], scenarios: str) -> ValidationScore:
    """The means of `fly` with their 95 % bootstrap intervals.

    Args:
        results: (missions, measures).
        scenarios: Which they were.
    """
    return ValidationScore(
        scenarios=scenarios,
        missions=len(results),
        measures={name: interval(column) for name, column in zip(MEASURES, results.T, strict=True)},
    )


def interval(values: NDArray[np.float64]) -> Interval:
    """A mean with its 95 % bootstrap interval; drawn from a fixed seed."""
    mean = float(values.mean())
    if len(values) < 2 or np.ptp(values) == 0.0:
        return Interval(mean=mean, low=mean, high=mean)
    found = bootstrap(
        (values,),
        np.mean,
        n_resamples=_RESAMPLES,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    return Interval(mean=mean, low=float(found.low), high=float(found.high))

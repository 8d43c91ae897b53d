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
from uas_coverage_agents.training.curve import CurvePoint
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
    def of(cls, policy: Policy, seed: int | None = None) -> Self:
        """A policy of a training with this seed; its rules are those of the flight."""
        interface, steps = policy.description.interface, policy.description.training.steps
        sha256 = weights_sha256(policy.tensors)
        package = __name__.partition(".")[0]
        which = "" if seed is None else f" of seed {seed}"
        return cls(f"policy{which} after {steps} steps", interface, {}, sha256, package, policy)

    def load(self) -> Planner:
        """The runner of the policy; who trains a class trusts it."""
        return runner_of(self.policy, Assistants(), trust=True)


@dataclass(frozen=True)
class Validation:
    """Who works for a training.

    Attributes:
        workers: Who flies and learns.
        store: Keeps the flights, so that none is repeated; None: they are not kept.
    """

    workers: Workers = field(default_factory=Workers)
    store: Store[Row] | None = None

    def flown(self, entries: Sequence[Entry]) -> NDArray[np.float64]:
        """Fly what was not flown before.

        Returns:
            (flights, measures) in the order of MEASURES.

        Raises:
            PlannerError: One cannot be flown.
        """
        found = {row.key: row for row in self.store.rows()} if self.store else {}
        source = source_of(entries)
        todo = [
            Job(entry.key, fly_entry, (entry, source))
            for entry in entries
            if entry.key not in found
        ]
        for job, flown in self.workers.run(todo):
            found[job.key] = flown.row
            self.keep([flown.row])
        return np.array([measured(found[entry.key]) for entry in entries], float)

    def keep(self, rows: Sequence[Row]) -> None:
        """Keep flights that were not kept before."""
        if self.store is not None:
            for row in rows:
                if row.key not in self.store.keys():  # noqa: SIM118  # of a store, not a mapping
                    self.store.add(row)

    def fly(
        self,
        spec: PlannerSpec,
        scenarios: Sequence[Scenario],
        *,
        safety_filter: bool | None = None,
        return_mode: bool | None = None,
    ) -> NDArray[np.float64]:
        """Fly every scenario once; see `flown`."""
        return self.flown(
            [
                Entry(one, scenario_hash(one), spec, 0, "lpv", safety_filter, return_mode)
                for one in scenarios
            ]
        )


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
    return (validation or Validation()).fly(PolicySpec.of(policy), scenarios, **on)


def measured(row: Row) -> list[float]:
    """One flight, in the order of MEASURES.

    Raises:
        PlannerError: It could not be flown.
    """
    if row.status == FAILED:
        raise PlannerError(row.reason)
    return [getattr(row, name) or 0.0 for name in _FIGURES.values()]


def point_of(
    results: NDArray[np.float64], steps: int, process_s: float, wall_s: float
) -> CurvePoint:
    """A point of a learning curve.

    Args:
        results: (missions, measures).
        steps: Flown steps learned from.
        process_s: Processor time of learning [s].
        wall_s: [s].
    """
    means = dict(zip(MEASURES, results.mean(axis=0).tolist(), strict=True))
    fields = {name: mean for name, mean in means.items() if name in CurvePoint.model_fields}
    return CurvePoint(steps=steps, process_s=process_s, wall_s=wall_s, **fields)


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

"""How well a policy flies: whole missions in the world, as anybody would fly them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import bootstrap

from uas_coverage_agents.policy import Interval, Policy, Score
from uas_coverage_agents.policy.planner import runner_of
from uas_coverage_env.flight import Assistants, Flight, rollout
from uas_coverage_env.flight.interruption import unless_stopped
from uas_coverage_env.flight.metrics import (
    coverage,
    energy_Wh,
    episode_return,
    filtered_share,
    home,
)
from uas_coverage_env.scenario import Scenario

MEASURES = (
    *("coverage", "all_home", "violations", "energy_Wh", "flight_steps", "filtered_share"),
    "episode_return",
)
"""Share covered, whether all are home, violations, energy of the swarm, steps until all are home,
share of the commands that the safety filter replaced, return by the default reward of the
environments (not that of the training); means over missions."""

_RESAMPLES = 2000


def fly(
    policy: Policy,
    scenarios: Sequence[Scenario],
    *,
    safety_filter: bool = True,
    return_mode: bool = True,
) -> NDArray[np.float64]:
    """Fly every scenario once.

    Returns:
        (missions, measures) in the order of MEASURES.
    """
    assistants = Assistants(return_mode=return_mode, safety_filter=safety_filter)
    runner = runner_of(policy, assistants)
    return np.array(
        [
            measured(
                unless_stopped(
                    rollout(scenario, runner, safety_filter=safety_filter, return_mode=return_mode)
                )
            )
            for scenario in scenarios
        ]
    )


def measured(flight: Flight) -> tuple[float, ...]:
    """One flight, in the order of MEASURES."""
    return (
        coverage(flight),
        float(home(flight).all()),
        float(len(flight.violations)),
        float(energy_Wh(flight).sum()),
        float(flight.steps),
        filtered_share(flight),
        episode_return(flight) or 0.0,
    )


def score(results: NDArray[np.float64], scenarios: str) -> Score:
    """The means of `fly` with their 95 % bootstrap intervals.

    Args:
        results: (missions, measures).
        scenarios: Which they were.
    """
    return Score(
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

"""The lower bounds of the missions of a sweep: needs the scenarios, but nothing that is kept."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence

from uas_coverage_env.bound import bound_of
from uas_coverage_env.leaderboard.row import Row
from uas_coverage_env.runner.jobs import Job
from uas_coverage_env.runner.workers import Workers
from uas_coverage_env.scenario import Scenario

Bounds = Mapping[tuple[str, int], float]
"""Scenario and steps -> least energy of a flight that accomplishes it in so many steps [Wh]."""


def bounds_of(
    rows: Sequence[Row],
    scenarios: Mapping[str, Scenario],
    workers: Workers,
    told: Callable[[int, int], object] | None = None,
) -> dict[tuple[str, int], float]:
    """The bounds that apply to the flights: accomplished ones, flown in the LPV model.

    Args:
        rows: Flights.
        scenarios: By name; flights on others have no bound.
        workers: Who computes them.
        told: Called with the scenarios done and all of them, before the first and after each.
    """
    asked: dict[str, set[int]] = defaultdict(set)
    for row in rows:
        counts = row.accomplished and row.dynamics == "lpv" and row.scenario in scenarios
        if counts and row.steps is not None:
            asked[row.scenario].add(row.steps)
    jobs = [Job(name, _bounds, (name, scenarios[name], sorted(asked[name]))) for name in asked]
    found: dict[tuple[str, int], float] = {}
    if told is not None:
        told(0, len(asked))
    for done, (_, of_one) in enumerate(workers.run(jobs), 1):
        found.update(of_one)
        if told is not None:
            told(done, len(asked))
    return found


def _bounds(name: str, scenario: Scenario, steps: Sequence[int]) -> dict[tuple[str, int], float]:
    bound = bound_of(scenario)  # it is frozen, so hashable
    return {} if bound is None else {(name, n): bound.energy_Wh(n) for n in steps}

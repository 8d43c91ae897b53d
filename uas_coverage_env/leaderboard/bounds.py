"""The lower bounds of the missions of a sweep: needs the scenarios, but nothing that is kept."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import cast

from joblib import Parallel, delayed

from uas_coverage_env.bound import bound_of
from uas_coverage_env.leaderboard.row import Row
from uas_coverage_env.scenario import Scenario

Bounds = Mapping[tuple[str, int], float]
"""Scenario and steps -> least energy of a flight that accomplishes it in so many steps [Wh]."""


def bounds_of(
    rows: Sequence[Row],
    scenarios: Mapping[str, Scenario],
    *,
    jobs: int = 1,
    told: Callable[[int, int], object] | None = None,
) -> dict[tuple[str, int], float]:
    """The bounds that apply to the flights: accomplished ones, flown in the LPV model.

    Args:
        rows: Flights.
        scenarios: By name; flights on others have no bound.
        jobs: Scenarios side by side; -1: as many as there are cores.
        told: Called with the scenarios done and all of them, before the first and after each.
    """
    asked: dict[str, set[int]] = defaultdict(set)
    for row in rows:
        counts = row.accomplished and row.dynamics == "lpv" and row.scenario in scenarios
        if counts and row.steps is not None:
            asked[row.scenario].add(row.steps)
    work = (delayed(_bounds)(name, scenarios[name], sorted(asked[name])) for name in asked)
    found: dict[tuple[str, int], float] = {}
    if told is not None:
        told(0, len(asked))
    side_by_side = jobs if len(asked) > 1 else 1
    parallel = Parallel(
        side_by_side,
        return_as="generator_unordered",
        batch_size=1,  # its default is a word
    )
    results = cast("Iterator[dict[tuple[str, int], float]]", parallel(work))
    for done, of_one in enumerate(results, 1):
        found.update(of_one)
        if told is not None:
            told(done, len(asked))
    return found


def _bounds(name: str, scenario: Scenario, steps: Sequence[int]) -> dict[tuple[str, int], float]:
    bound = bound_of(scenario)  # it is frozen, so hashable
    return {} if bound is None else {(name, n): bound.energy_Wh(n) for n in steps}

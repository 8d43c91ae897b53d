"""The lower bounds of the missions of a sweep: needs the scenarios, but nothing that is kept."""

from collections.abc import Mapping, Sequence

from uas_coverage_env.bound import bound_of
from uas_coverage_env.leaderboard.row import Row
from uas_coverage_env.scenario import Scenario

Bounds = Mapping[tuple[str, int], float]
"""Scenario and steps -> least energy of a flight that accomplishes it in so many steps [Wh]."""


def bounds_of(
    rows: Sequence[Row], scenarios: Mapping[str, Scenario]
) -> dict[tuple[str, int], float]:
    """The bounds that apply to the flights: accomplished ones, flown in the LPV model.

    Args:
        rows: Flights.
        scenarios: By name; flights on others have no bound.
    """
    found: dict[tuple[str, int], float] = {}
    for row in rows:
        if not row.accomplished or row.steps is None or row.dynamics != "lpv":
            continue
        key = row.scenario, row.steps
        bound = bound_of(scenarios[row.scenario]) if row.scenario in scenarios else None
        if bound is not None and key not in found:
            found[key] = bound.energy_Wh(row.steps)
    return found

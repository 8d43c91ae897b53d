"""What a batch goes on from: whether arrays from outside can be those of its missions."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.state import STATE
from uas_coverage_env.env.batch.memory import LANES
from uas_coverage_env.env.batch.scenes import scenes_in
from uas_coverage_env.env.batch.source import DrawnMission, LaneMissions
from uas_coverage_env.env.batch.state_dict import check_values
from uas_coverage_env.env.episode.memory import LEARNERS
from uas_coverage_env.features.feature import fitted_to, memory_of
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle.record import COUNTS


def checked(
    pool: LaneMissions, state: Mapping[str, NDArray[Any]]
) -> tuple[list[DrawnMission], dict[int, Scenario]]:
    """Look for values that no mission of a batch can have.

    Args:
        pool: Of the batch.
        state: Its arrays by name, of the right shapes and dtypes.

    Returns:
        The missions that were drawn, for `LaneMissions.install`; and the scenes that have changed,
        for `install_scenes`.

    Raises:
        ValueError: There are such values.
    """
    scenarios = list(pool.scenarios)
    begun = state["mission"] >= 0
    drawn = pool.redrawn(state, begun)
    for mission in drawn:
        scenarios[mission.lane] = mission.scenario
    longest = max(pool.settings.limited(scenario).max_steps for scenario in scenarios)
    flown = state["scenario"].clip(0, len(scenarios) - 1)
    changed = {}
    if pool.changes:
        missions = {lane: scenarios[flown[lane]] for lane in np.flatnonzero(begun).tolist()}
        changed = scenes_in(state, {k: pool.settings.limited(v) for k, v in missions.items()})
    n_waypoints = np.array([len(scenario.waypoints) for scenario in scenarios])[flown]
    for lane, known in changed.items():
        n_waypoints[lane] = len(known.waypoints)
    check_values(
        state,
        {
            **LANES.limits({"S": len(scenarios)}, lanes=False),
            **STATE.limits({"samples": longest + 1}, lanes=True),
            **LEARNERS.limits({"W": n_waypoints}, lanes=True),
            **{f"true_vehicles.{name}": most for name, most in COUNTS.items()},
        },
    )
    for lane in np.flatnonzero(begun & (state["memory"].shape[1] > 0)).tolist():
        flies = scenarios[flown[lane]]
        slots = fitted_to(pool.features, pool.settings.features_in(flies))
        kept = memory_of(slots, len(flies.uas), state["memory"][lane])
        check_values({f"memory[{lane}].{name}": records for name, records in kept.items()}, {})
    check_values(state, pool.limits(begun))
    return drawn, changed

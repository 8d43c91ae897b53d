"""Many scenarios end to end in a few arrays, for kernels that fly another one in every lane."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from uas_coverage_env.compiled.memory import Pool
from uas_coverage_env.compiled.views import lane_view, pool_view
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.entities.state import FLYING, STATE, WorldState
from uas_coverage_env.features.feature import MissionFeature
from uas_coverage_env.features.of_scenario import disturbances_of
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation.step import begin_mission
from uas_coverage_env.simulation.world import initial_state
from uas_coverage_env.world.arena import ARENA, build_arena
from uas_coverage_env.world.events import is_eventful


class WorldPool(NamedTuple):
    """What the world knows of S scenarios."""

    arenas: Pool
    """Of `ARENA`."""
    starts: Pool
    """Of `STATE`: at t = 0, what lies within reach of the starts covered."""


def pool_worlds(
    scenarios: Sequence[Scenario],
    *,
    measured_m: float = math.inf,
    slots: Sequence[Sequence[MissionFeature | None]] | None = None,
    judges_wrenches: bool = False,
) -> WorldPool:
    """Arenas and starts of scenarios with any numbers of UAS, waypoints and obstacles.

    Args:
        scenarios: At least one.
        measured_m: See `build_arena`.
        slots: The features of each, see `in_slots`; None: for callers that fly in still air.
        judges_wrenches: See `build_arena`.

    Raises:
        ValueError: There is no scenario, or `slots` is None and one has disturbances,
            events, or waypoints that are asked for again.
    """
    if not scenarios:
        raise ValueError("there is no scenario to fly; give at least one")
    arenas = []
    starts = []
    if slots is None:
        disturbed = [scenario.name for scenario in scenarios if disturbances_of(scenario)]
        if disturbed:
            raise ValueError(f"scenario {disturbed[0]} has disturbances; here the air is still")
        changing = [s.name for s in scenarios if is_eventful(s) or s.asks_again]
        if changing:
            raise ValueError(
                f"scenario {changing[0]} has events, [sensing] or again_after_s; here is none of it"
            )
        slots = [()] * len(scenarios)
    for scenario, features in zip(scenarios, slots, strict=True):
        arena = build_arena(
            scenario,
            measured_m=measured_m,
            features=features,
            judges_wrenches=judges_wrenches,
        )
        start = initial_state(scenario, arena, features)
        begin_mission(arena, start, np.zeros(len(scenario.uas), dtype=OUTCOME_DTYPE))
        arenas.append(arena)
        starts.append(start)
    return WorldPool(ARENA.pool(arenas), STATE.pool(starts))


arena_of = pool_view(ARENA)
"""In a kernel, (`WorldPool.arenas`, s) -> the arena of scenario s."""

start_of = pool_view(STATE)
"""In a kernel, (`WorldPool.starts`, s) -> the state at t = 0 of scenario s; not to be written."""

state_of = lane_view(STATE, sized_by=ARENA)
"""In a kernel, (states, lane, `WorldPool.arenas`, s) -> the state of a lane that flies scenario s,
of the size of the scenario."""


def lanes_of(n_lanes: int, starts: Pool) -> WorldState:
    """States for lanes that fly any scenario of a pool, each array with an axis of lanes before.

    Scenario s uses the first rows of its lane: `state.x[lane, :n_uas]`, `state.step[lane]`.

    Args:
        n_lanes: How many.
        starts: `WorldPool.starts`.
    """
    states = STATE.zeros(STATE.largest(starts), lanes=n_lanes)
    states.uas["status"][:] = FLYING
    return states

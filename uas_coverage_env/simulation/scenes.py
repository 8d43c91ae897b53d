"""Scenes that change: what events, and waypoints that are asked for again, make of a mission.

A change is a number: below the number of events the index of one, from there on the index of a
waypoint that is asked for again.
"""

import numpy as np

from uas_coverage_env.entities.state import FLYING, WorldState
from uas_coverage_env.scenario import NoFlyZone, Scenario
from uas_coverage_env.world.arena import Arena


def changes_scene(scenario: Scenario) -> bool:
    """Whether the scene of a mission may change."""
    return scenario.asks_again or any(event.changes_scene for event in scenario.events)


def changes_due(known: Scenario, state: WorldState) -> list[int]:
    """The changes at this sample, in the order in which they happen.

    Args:
        known: The scenario as it is now.
        state: The state, in arrays of its size.
    """
    step = state.step[0]
    events = np.flatnonzero(state.events["step"] == step).tolist()
    again = np.flatnonzero((state.due_step == step) & (state.due_step > 0))
    return [
        *(e for e in events if known.events[e].changes_scene),
        *(len(known.events) + again).tolist(),
    ]


def scene_after(known: Scenario, change: int, state: WorldState) -> Scenario:
    """The scenario from a change on.

    Args:
        known: The scenario before.
        change: See above.
        state: The state: when its events happen, and to which UAS.
    """
    if change >= len(known.events):
        return known.asked_again(change - len(known.events))
    time_s = int(state.events[change].step) * known.dt_s
    return known.after(known.events[change], time_s, int(state.events[change].uas))


def carried_over(known: Scenario, arena: Arena, state: WorldState) -> WorldState:
    """The state in a scene that has changed at this sample.

    Args:
        known: The scenario from now on.
        arena: The same as arrays.
        state: The state before; UAS that were called home since nothing was left are let go on.

    Returns:
        The same arrays, but for `uncovered` and `due_step`.
    """
    uncovered = np.ones(len(known.waypoints), dtype=np.bool_)
    uncovered[: len(state.uncovered)] = state.uncovered
    positions_m = arena.waypoints["position_m"]
    for obstacle, hull in zip(known.obstacles, known.hulls, strict=True):
        if isinstance(obstacle, NoFlyZone):
            uncovered &= hull.signed_distance(positions_m) >= 0.0
    if len(uncovered) > len(state.uncovered):
        # one that was called home because nothing was left may have something to do now
        state.uas["returning"][:] = False
        if not (state.uas["status"] == FLYING).any():
            # likewise one whose last sortie has covered nothing
            state.packs["covered"] = True
    due_step = np.zeros(len(arena.again_steps), dtype=np.int64)
    due_step[: len(state.due_step)] = state.due_step
    return state._replace(uncovered=uncovered, due_step=due_step)

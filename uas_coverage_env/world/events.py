"""When events happen during a mission, and to which UAS; what they do is a feature each.

The times are drawn when a mission begins and are part of its state. An event at sample k acts
between the step to it and what is judged there; what lasts, lasts for the steps from k on. Events
that change the scene are left to what holds the arena, see `simulation.World`.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import rare_kernel
from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.compiled.random import counted, uniform
from uas_coverage_env.entities.state import EVERY, NEVER
from uas_coverage_env.features.event import OfUas
from uas_coverage_env.features.feature import MissionFeature
from uas_coverage_env.scenario import Scenario

BY_LOT = -1
"""In place of the index of a UAS: one that is drawn."""

_KEY = np.uint64(0x6576656E74730001)

EVENT_DTYPE = record_dtype(
    [
        # what it does: number of a feature of the mission, -1 where nothing in a step
        ("feature", "i8"),
        # index, BY_LOT or EVERY
        ("uas", "i8"),
        # its sample; or how often it happens in a step, and then the sample is drawn
        ("at_step", "i8"),
        ("per_step", "f8"),
        # how many steps it lasts
        ("for_steps", "i8"),
        ("values", "f8", (4,)),
    ]
)


def event_records(
    scenario: Scenario, features: Sequence[MissionFeature | None]
) -> NDArray[np.void]:
    """(E,) of EVENT_DTYPE, the events of a scenario in their order.

    Args:
        scenario: The scenario.
        features: Of the mission, in the order of `Arena.features`.
    """
    records = np.zeros(len(scenario.events), dtype=EVENT_DTYPE)
    index = {uas.name: i for i, uas in enumerate(scenario.uas)}
    names = [None if feature is None else feature.name for feature in features]
    for record, event in zip(records, scenario.events, strict=True):
        acts = event.feature is not None and event.feature.name in names
        record["feature"] = names.index(event.feature.name) if acts else -1
        name = event.uas if isinstance(event, OfUas) else None
        record["uas"] = EVERY if event.on_all else BY_LOT if name is None else index[name]
        if event.at_s is not None:
            record["at_step"] = steps_until(event.at_s, scenario.dt_s)
        else:
            record["per_step"] = (event.rate_per_h or 0.0) * scenario.dt_s / 3600.0
        seconds = event.lasts_s
        lasts = math.isfinite(seconds)
        record["for_steps"] = steps_until(seconds, scenario.dt_s) if lasts else NEVER
        values = event.values
        record["values"][: len(values)] = values
    return records


def steps_until(seconds: float, dt_s: float) -> int:
    """Steps until a time has come, one at least; times are decimal, their quotients are not."""
    return max(1, math.ceil(round(seconds / dt_s, 9)))


@rare_kernel
def begin_events(arena, state, seed, mission):
    """Draw when a mission's events happen, a function of seed and mission alone.

    Args:
        arena: The arena.
        state: The state at t = 0; `events` is written.
        seed: uint64.
        mission: Number of the mission since seeding, from 0 on.
    """
    for e in range(arena.events.shape[0]):
        event = arena.events[e]
        drawn = state.events[e]
        random = drawn.random[:]
        random[0] = counted(counted(seed, mission) ^ _KEY, e)
        lot = uniform(random)
        steps = event.at_step
        if event.per_step > 0.0:
            waiting = -math.log(1.0 - uniform(random)) / event.per_step
            steps = 1 + int(min(waiting, 1e15))
        drawn.step = steps
        uas = event.uas
        if uas == BY_LOT:
            uas = int(lot * arena.uas.shape[0])
        drawn.uas = uas


def is_eventful(scenario: Scenario) -> bool:
    """Whether anything is sensed otherwise than it is, or happens that could make it so."""
    return scenario.sensing is not None or bool(scenario.events)


def goes_home(scenario: Scenario) -> bool:
    """Whether an event may send a UAS home, which takes guidance."""
    return any(event.goes_home for event in scenario.events)

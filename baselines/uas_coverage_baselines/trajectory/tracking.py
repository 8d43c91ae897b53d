"""The rest of a flight from where the UAS is, where that is not where it was planned to be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.course import course_of, trouble_alone
from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.flight_model import (
    NORMS,
    V_DOWN,
    FlightModel,
    flight_model,
    reduced_state,
)
from uas_coverage_baselines.trajectory.mission_plan import Planned
from uas_coverage_baselines.trajectory.retiming import retimed
from uas_coverage_baselines.trajectory.space import Body
from uas_coverage_env.world import SwarmState

FloatArray = NDArray[np.float64]

KEPT_BACK = 0.02  # share of the limits that is left to what the model does not know
_SETTLING = np.linspace(1.0, 0.0, 8)[:-1]  # share of an excess that is allowed in the first steps
_LATER = (0, 1, 2, 4)  # steps


def loosened(model: FlightModel, start: FloatArray) -> FloatArray:
    """(K,) factors on the limits of the first steps, for a start that is beyond them."""
    norms = np.linalg.norm(start[NORMS], axis=1) / model.norms
    vertical = np.array([-start[V_DOWN], start[V_DOWN]]) / model.vertical
    excess = max(float(norms.max()), float(vertical.max()), 1.0) - 1.0
    return 1.0 + 1.05 * excess * _SETTLING


def tracked(
    fleet: Fleet,
    uas: int,
    planned: Planned,
    swarm: SwarmState,
    others_m: Mapping[int, FloatArray],
    movers: Sequence[Body],
) -> Planned | None:
    """The same visits from here, in time or a little later; None where that is not possible.

    Args:
        fleet: The mission.
        uas: Index of the UAS.
        planned: What it was to do.
        swarm: Where it is.
        others_m: (N+1, 3) paths of the others from now on.
        movers: What moves.
    """
    route, rest = planned.rest(swarm.step, swarm.uncovered)
    steps = rest.steps
    if steps < 2:
        return None
    start = reduced_state(swarm.x[uas])
    program = fleet.program(uas, others_m, movers, None)
    model = flight_model(fleet.arena.vehicles[uas], KEPT_BACK)
    program = replace(program, model=model, loose=loosened(model, start))
    for later in _LATER:
        new = retimed(program, start, route, rest, rest.visits + later, steps + later)
        if new.is_clear and trouble_alone(fleet, uas, swarm.x[uas], new, loose=True) is None:
            course = course_of(fleet, uas, swarm.step, swarm.x[uas], new)
            return Planned(route, new, course)
    return None

"""The rest of a flight from where the UAS is, where that is not where it was planned to be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.course import course_of, trouble_alone
from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.flight_model import (
    flight_model,
    reduced_state,
)
from uas_coverage_baselines.trajectory.mission_plan import Planned
from uas_coverage_baselines.trajectory.program import Allowance, Flight, FlightProgram
from uas_coverage_baselines.trajectory.retiming import repair, retimed, shifted, worth
from uas_coverage_baselines.trajectory.space import Body
from uas_coverage_baselines.trajectory.work import done
from uas_coverage_env.world import SwarmState

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_KEPT_BACK = 0.01  # share of the limits that is left to what the model does not know
_WIDER_M = 0.3  # kept of obstacles beyond the distance of plans, where that is possible
_LATER_STEPS = 5  # tried, the first without a delay
_REPAIRS = 3
_ALLOWANCE = Allowance(inside_m=0.25, landing_distance=0.8, landing_speed=0.5)  # plans keep more


Tracking = Callable[
    [Fleet, int, Planned, SwarmState, Mapping[int, FloatArray], Sequence[Body]], Planned | None
]


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
    if rest.steps < 2:  # too late for another
        return _checked(fleet, uas, swarm, route, rest) if rest.steps else None
    program = fleet.program(uas, others_m, movers, None)
    model = flight_model(fleet.arena.vehicles[uas], _KEPT_BACK)
    space = program.space._replace(keep_m=program.space.keep_m + _WIDER_M)
    program = replace(program, model=model, space=space, reserve=0.0, allowance=_ALLOWANCE)
    return _revisited(fleet, uas, swarm, route, (rest, rest.visits, rest.steps), program)


def with_room(
    fleet: Fleet,
    uas: int,
    planned: Planned,
    swarm: SwarmState,
    others_m: Mapping[int, FloatArray],
    movers: Sequence[Body],
) -> Planned | None:
    """The same visits by a flight that leaves the room of the fleet; arguments as for `tracked`."""
    route, rest = planned.rest(swarm.step, swarm.uncovered)
    if rest.steps < 2:
        return tracked(fleet, uas, planned, swarm, others_m, movers)
    program = fleet.program(uas, others_m, movers, None)
    slower = 1.0 + program.reserve
    visits = np.ceil(slower * rest.visits).astype(np.int64)
    steps = max(int(np.ceil(slower * rest.steps)), int(visits.max(initial=1)))
    return _revisited(fleet, uas, swarm, route, (rest, visits, steps), program)


def _revisited(
    fleet: Fleet,
    uas: int,
    swarm: SwarmState,
    route: IntArray,
    like: tuple[Flight, IntArray, int],
    program: FlightProgram,
) -> Planned | None:
    """From here, like a flight with other steps of its visits and of its end, or some later."""
    start = reduced_state(swarm.x[uas])
    new = retimed(program, start, route, *like)
    for _ in range(_LATER_STEPS):
        if not program.visits_all(route, new):
            new = done(repair(program, start, route, new, _REPAIRS))
        if not np.isfinite(new.violation):
            break
        # nearer to obstacles than planned it is not for long: coming back has its price
        if program.visits_all(route, new):
            checked = _checked(fleet, uas, swarm, route, new)
            if checked is not None:
                return checked
        order, gain, _ = worth(new)  # a step more where it is worth most
        visits = shifted(new.visits, order, int(np.argmax(gain)), 1)
        new = retimed(program, start, route, new, visits, new.steps + 1)
    return None


def _checked(
    fleet: Fleet, uas: int, swarm: SwarmState, route: IntArray, flight: Flight
) -> Planned | None:
    """The flight, if it may be flown from where the UAS is."""
    if trouble_alone(fleet, uas, swarm.x[uas], flight) is not None:
        return None
    return Planned(route, flight, course_of(fleet, uas, swarm.step, swarm.x[uas], flight))

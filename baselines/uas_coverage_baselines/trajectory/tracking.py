"""The rest of a flight from where the UAS is, where that is not where it was planned to be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.course import course_of, trouble_alone
from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.flight_model import reduced_state
from uas_coverage_baselines.trajectory.mission_plan import Planned
from uas_coverage_baselines.trajectory.movers import Movers
from uas_coverage_baselines.trajectory.program import FlightProgram, PlannedFlight
from uas_coverage_baselines.trajectory.retiming import repair, retimed, shifted, worth
from uas_coverage_baselines.trajectory.space import Body
from uas_coverage_baselines.trajectory.work import done
from uas_coverage_env.world import SwarmState

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_ALL = 10**6  # steps of a path
_MOST_LATER = 4  # steps
_REPAIRS = 3


ProgramOf = Callable[[int, Mapping[int, FloatArray], Sequence[Body]], FlightProgram]
"""The program of a UAS, clear of the paths (N+1, 3) of others and of what moves."""


def tracked(
    fleet: Fleet,
    uas: int,
    planned: Mapping[int, Planned],
    swarm: SwarmState,
    movers: Movers,
    program_of: ProgramOf,
) -> Planned | None:
    """The same visits from here, in time or a little later; None where that is not possible.

    Args:
        fleet: The mission.
        uas: Index of the UAS.
        planned: What it and the others were to do.
        swarm: Where it is.
        movers: What moves.
        program_of: Where a program leaves room in the limits, the flight takes so much longer.
    """
    route, rest = planned[uas].rest(swarm.step, swarm.uncovered)
    if rest.steps < 2:  # too late for another
        return _checked(fleet, uas, swarm, route, rest) if rest.steps else None
    paths_m = {k: p.course.rest(swarm.step).path_m(_ALL) for k, p in planned.items() if k != uas}
    program = program_of(uas, paths_m, fleet.bodies(movers, uas))
    slower, start = 1.0 + program.reserve, reduced_state(swarm.x[uas])
    visits = np.ceil(slower * rest.visits).astype(np.int64)
    new = retimed(program, start, route, rest, visits, int(np.ceil(slower * rest.steps)))
    for later in range(_MOST_LATER + 1):
        if later:  # a step more where it is worth most
            order, gain, _ = worth(new)
            visits = shifted(new.visits, order, int(np.argmax(gain)), 1)
            new = retimed(program, start, route, new, visits, new.steps + 1)
        if not program.visits_all(route, new):
            new = done(repair(program, start, route, new, _REPAIRS))
        if not np.isfinite(new.violation):
            return None
        # nearer to obstacles than planned it is not for long: coming back has its price
        if program.visits_all(route, new):
            checked = _checked(fleet, uas, swarm, route, new)
            if checked is not None:
                return checked
    return None


def _checked(
    fleet: Fleet, uas: int, swarm: SwarmState, route: IntArray, flight: PlannedFlight
) -> Planned | None:
    """The flight, if it may be flown from where the UAS is."""
    if trouble_alone(fleet, uas, swarm.x[uas], flight) is not None:
        return None
    return Planned(route, flight, course_of(fleet, uas, swarm.step, swarm.x[uas], flight))

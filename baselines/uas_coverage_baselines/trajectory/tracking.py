"""The rest of a flight from where the UAS is, where that is not where it was planned to be."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.course import course_of, trouble_alone
from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.flight_model import reduced_state
from uas_coverage_baselines.trajectory.mission_plan import Planned
from uas_coverage_baselines.trajectory.moving_obstacles import MovingObstacles
from uas_coverage_baselines.trajectory.plan_in_force import PlanInForce
from uas_coverage_baselines.trajectory.program import FlightProgram, PlannedFlight
from uas_coverage_baselines.trajectory.retiming import repair, retimed, shifted, worth
from uas_coverage_baselines.trajectory.space import Body
from uas_coverage_baselines.trajectory.steering import Failures
from uas_coverage_baselines.trajectory.work import done
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world import SwarmState

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_ALL = 10**6  # steps of a path
_MOST_LATER = 4  # steps
_REPAIRS = 3


class Tracking:
    """Keeps what is planned in line with where the UAS are, and counts where that fails.

    Args:
        fleet: The mission.

    Attributes:
        is_disturbed: Whether a UAS was elsewhere than planned without the safety filter's doing:
            plans then leave part of the limits to tracking.
    """

    def __init__(self, fleet: Fleet) -> None:
        self._fleet, self._failures = fleet, Failures()
        self.is_disturbed = False

    @property
    def fails(self) -> bool:
        """Whether no flight goes as planned."""
        return self._failures.are_many

    def flies_without_plan(self, uas: int, swarm: SwarmState) -> None:
        """Count a step of a UAS that flies otherwise than planned."""
        self._failures.add(float(self.is_disturbed and swarm.responds[uas]))

    def follow(
        self,
        in_force: PlanInForce,
        swarm: SwarmState,
        moving: MovingObstacles,
        as_planned: Collection[int],
    ) -> None:
        """Plan from where the UAS are, where that is not where they were planned to be.

        Args:
            in_force: What is flown; changed.
            swarm: Where the UAS are.
            moving: What moves.
            as_planned: UAS that were sent along their plans in the step before.
        """
        self._failures.next_step()
        filtered = swarm.filtered if len(swarm.filtered) else np.zeros(len(swarm.x), np.bool_)
        for u, planned in list(in_force.planned.items()):
            rest = planned.course.rest(swarm.step)
            if rest.begins_at(swarm.x[u]):
                continue
            if u not in as_planned:  # nothing pushed it: it flew something else
                del in_force.planned[u]
                continue
            off = rest.x[0, S.VX : S.VZ + 1] - swarm.x[u, S.VX : S.VZ + 1]
            obeys = swarm.responds[u] and not filtered[u]  # else it flies something else
            self._failures.see(float(obeys * np.linalg.norm(off)))
            if not self.is_disturbed and not filtered[u]:
                self.is_disturbed = True
                self._fleet.leave_room()
                for k in list(in_force.planned):
                    self._refit(k, in_force, self._fleet.program, swarm, moving)
                return
            later = self._refit(u, in_force, self._fleet.tracking_program, swarm, moving)
            self._failures.add(float(obeys * later))

    def _refit(
        self,
        uas: int,
        in_force: PlanInForce,
        program_of: ProgramOf,
        swarm: SwarmState,
        moving: MovingObstacles,
    ) -> int:
        """Plan the same visits from where a UAS is; steps by which its flight ends later."""
        new = tracked(self._fleet, uas, in_force.planned, swarm, moving, program_of)
        return in_force.fly_instead(uas, new)


ProgramOf = Callable[[int, Mapping[int, FloatArray], Sequence[Body]], FlightProgram]
"""The program of a UAS, clear of the paths (N+1, 3) of others and of what moves."""


def tracked(
    fleet: Fleet,
    uas: int,
    planned: Mapping[int, Planned],
    swarm: SwarmState,
    moving: MovingObstacles,
    program_of: ProgramOf,
) -> Planned | None:
    """The same visits from here, in time or a little later; None where that is not possible.

    Args:
        fleet: The mission.
        uas: Index of the UAS.
        planned: What it and the others were to do.
        swarm: Where it is.
        moving: What moves.
        program_of: Where a program leaves room in the limits, the flight takes so much longer.
    """
    route, rest = planned[uas].rest(swarm.step, swarm.uncovered)
    if rest.steps < 2:  # too late for another
        return _checked(fleet, uas, swarm, route, rest) if rest.steps else None
    paths_m = {k: p.course.rest(swarm.step).path_m(_ALL) for k, p in planned.items() if k != uas}
    program = program_of(uas, paths_m, fleet.bodies(moving, uas))
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

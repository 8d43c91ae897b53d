"""What is flown now, such that there is something safe to fly at every later decision.

Every UAS has a backup trajectory: the rest of its course where that stays clear of everything that
moves, as that goes now; else the course followed for some steps and then braked to a hover. All
backup trajectories of the fleet were verified together. After one step what is left of them is a
set of such trajectories again, so whatever a new plan brings replaces them only where it is
verified with the others (docs/safety.md has the argument). Where a backup trajectory no longer
holds, because something moves otherwise than it did, or the UAS is elsewhere, the world's guidance
and safety filter are asked, here, before the command is given.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.course import (
    Course,
    are_apart,
    braked,
    hover_inputs,
)
from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.movers import Movers
from uas_coverage_baselines.trajectory.space import spare_of_rules_m
from uas_coverage_env.autopilot.assist import assist, assistants
from uas_coverage_env.autopilot.control import command_wrench
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.entities.commands import GO_TO, HOME, WRENCH
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.mission import Range, WorldView
from uas_coverage_env.vehicle.layout import DELTA_THRUST
from uas_coverage_env.world import SwarmState

FloatArray = NDArray[np.float64]

_FOLLOWED = 30  # steps at most that a course is followed before braking


class Safeguard:
    """The backup trajectories of a fleet.

    Args:
        fleet: The mission.
        world: What is seen of it.
        way_home: Of its UAS.
        moving_margin_m: Kept from what moves, in addition to its safe distance.
    """

    def __init__(
        self, fleet: Fleet, world: WorldView, way_home: Range, moving_margin_m: float
    ) -> None:
        self._fleet, self._world = fleet, world
        self._margin_m = moving_margin_m
        self._way_home = way_home
        self.backups: dict[int, Course] = {}

    def chosen(
        self,
        swarm: SwarmState,
        wanted: Mapping[int, Course],
        movers: Movers,
        staying: Collection[int] = (),
    ) -> dict[int, tuple[Course, bool]]:
        """What each UAS flies from now on: its course, or what is left of its backup trajectory.

        Args:
            swarm: Where the UAS are.
            wanted: Courses of UAS that have one, from this sample on and verified.
            movers: What moves, as it is seen.
            staying: UAS that land where they are, and are gone after this step.

        Returns:
            For each UAS for which there is something verified: that, and whether it follows its
            course. UAS for which there is nothing are left out.
        """
        step, x = swarm.step, swarm.x
        held = {}
        for u in np.flatnonzero(swarm.status == FLYING).tolist():
            if u in staying:
                held[u] = _landing_here(self._fleet, u, step, x[u])
                continue
            backup = self.backups[u].rest(step) if u in self.backups else None
            if backup is not None and self._holds(u, backup, x[u], movers):
                held[u] = backup
            elif u not in wanted and (stop := self._stop(u, step, x[u], movers)) is not None:
                held[u] = stop
        renewed = {u: self._continuation(u, course, movers) for u, course in wanted.items()}
        fresh = {u: course for u, course in renewed.items() if course is not None}
        together = held | fresh
        if not self._all_apart(together):
            together, fresh = self._one_by_one(held, fresh)
        self.backups = together
        return {u: (course, u in fresh) for u, course in together.items()}

    def _one_by_one(
        self, held: Mapping[int, Course], fresh: Mapping[int, Course]
    ) -> tuple[dict[int, Course], dict[int, Course]]:
        """New ones that are clear of all that is held or was taken before."""
        together, taken = dict(held), {}
        for _ in range(2):
            for u, course in fresh.items():
                others = {k: other for k, other in together.items() if k != u}
                if u not in taken and all(
                    are_apart(self._fleet, u, k, course, other) for k, other in others.items()
                ):
                    together[u] = taken[u] = course
        return together, taken

    def _all_apart(self, courses: Mapping[int, Course]) -> bool:
        names = list(courses)
        return all(
            are_apart(self._fleet, i, j, courses[i], courses[j])
            for k, i in enumerate(names)
            for j in names[k + 1 :]
        )

    def _stop(self, uas: int, step: int, x: FloatArray, movers: Movers) -> Course | None:
        """To brake at once, where that is clear of all that stands and of what moves."""
        here = Course(step, np.ascontiguousarray(x[None]), np.zeros((0, 5)), False)
        stop = braked(self._fleet, uas, here, 0)
        path_m = np.ascontiguousarray(stop.x[:, :3])
        is_clear = float(spare_of_rules_m(self._fleet.programs[uas].space, path_m, False)) >= 0.0
        return stop if is_clear and self._is_clear(uas, stop, movers) else None

    def _holds(self, uas: int, backup: Course, x: FloatArray, movers: Movers) -> bool:
        """Whether what is left of a backup trajectory begins here and is clear of what is seen."""
        if not backup.begins_at(x):
            return False
        return self._is_clear(uas, backup, movers)

    def _is_clear(self, uas: int, course: Course, movers: Movers) -> bool:
        steps = max(len(course.u), 1)
        path_m = course.path_m(steps)
        if course.lands and len(path_m) < 2:
            return True
        radius_m = self._fleet.brief.uas[uas].radius_m
        return movers.spare_m(path_m, radius_m, self._margin_m) >= 0.0

    def _continuation(self, uas: int, course: Course, movers: Movers) -> Course | None:
        """A backup trajectory that begins with the course, None where there is none."""
        if not len(course.u):
            return None
        if self._is_clear(uas, course, movers):
            return course
        space = self._fleet.programs[uas].space
        for followed in range(min(_FOLLOWED, len(course.u)), 0, -1):
            trial = braked(self._fleet, uas, course, followed)
            path_m = np.ascontiguousarray(trial.x[:, :3])
            if (
                self._is_clear(uas, trial, movers)
                and float(spare_of_rules_m(space, path_m, False)) >= 0.0
                and self._way_home.spare_dod(uas, trial.x[-1]) >= 0.0
            ):
                return trial
        return None

    def evade(
        self, uas: Collection[int], flown: Mapping[int, FloatArray], homeward: Collection[int]
    ) -> dict[int, FloatArray]:
        """(5,) inputs for a step of each UAS for which there is nothing verified.

        The world's guidance flies home, or the brakes are put on; its safety filter then looks for
        the nearest command that is clear of everything, or harms least.

        Args:
            uas: Indices of these UAS.
            flown: (5,) inputs of the others.
            homeward: Those of `uas` that fly home; the others brake.
        """
        arena, state = self._world.arena, self._world.state
        outcome = np.zeros(len(state.uas), OUTCOME_DTYPE)
        outcome["applied_command"] = arena.rules[0]["brake"]
        for u, inputs in flown.items():
            outcome["applied_command"]["kind"][u] = WRENCH
            outcome["applied_command"]["values"][u] = inputs[:DELTA_THRUST]
        for u in homeward:
            outcome["applied_command"]["kind"][u] = GO_TO
            outcome["applied_command"]["values"][u, 0] = HOME
        wrenches = np.zeros((len(outcome), 5))
        codes = assistants(return_mode=False, safety_filter=True)
        at_sample = state._replace(step=np.zeros(1, np.int64))  # the arena knows the present only
        _assisted(codes, arena, at_sample, outcome, wrenches)
        return {u: wrenches[u] for u in uas}


@allocating_kernel
def _assisted(codes, arena, state, outcome, wrenches):
    """Guidance and safety filter of the world, and the inputs of their commands."""
    for k in range(len(codes)):
        assist(codes[k], arena, state, False, outcome)
    for i in range(len(outcome)):
        if state.uas[i].status == FLYING:
            reference = state.uas[i].reference_mps.copy()
            command = outcome[i].applied_command
            command_wrench(arena.vehicles[i], state.x[i], reference, command, wrenches[i])


def _landing_here(fleet: Fleet, uas: int, step: int, x: FloatArray) -> Course:
    """One step of hovering, after which the UAS is gone."""
    return Course(step, np.stack([x, x]), hover_inputs(fleet, uas, x)[None], True)

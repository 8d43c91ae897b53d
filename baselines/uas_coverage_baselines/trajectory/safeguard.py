"""What is flown now, such that there is something safe to fly at every later decision.

The supervisor (`planning.backup`) keeps a backup trajectory of every UAS, verified together. Where
one no longer holds, because something moves otherwise than it did, or the UAS is elsewhere, the
world's guidance and safety filter are asked, here, before the command is given.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.course import Course, are_apart, hover_inputs
from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.moving_obstacles import MovingObstacles
from uas_coverage_baselines.trajectory.space import spare_of_rules_m
from uas_coverage_env.autopilot.assist import assist, assistants
from uas_coverage_env.autopilot.control import command_wrench
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.entities.commands import GO_TO, HOME, WRENCH
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.mission import Range, WorldView
from uas_coverage_env.planning.backup.supervisor import Supervisor
from uas_coverage_env.vehicle.layout import DELTA_THRUST
from uas_coverage_env.world import SwarmState

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Seen:
    """What the supervisor asks of a moment: hulls and fence exactly, bodies at their velocities.

    Attributes:
        fleet: The mission.
        moving: What moves, as it is seen.
        margin_m: Kept from what moves, in addition to its safe distance.
        way_home: Of the UAS.
    """

    fleet: Fleet
    moving: MovingObstacles
    margin_m: float
    way_home: Range

    def is_clear(self, uas: int, course: Course) -> bool:
        """Whether a course is clear of what moves; what stands was verified before."""
        path_m = course.path_m(max(len(course.u), 1))
        radius_m = self.fleet.brief.uas[uas].radius_m
        return self.moving.spare_m(path_m, radius_m, self.margin_m) >= 0.0

    def may_stop(self, uas: int, course: Course, followed: int) -> bool:
        """Whether a course that ends in a hover is clear of what moves and what stands."""
        path_m = np.ascontiguousarray(course.x[:, :3])
        space = self.fleet.programs[uas].space
        return self.is_clear(uas, course) and float(spare_of_rules_m(space, path_m, False)) >= 0.0

    def comes_home(self, uas: int, x: FloatArray) -> bool:
        """Whether it has charge for the way home, with its margin."""
        return self.way_home.spare_dod(uas, x) >= 0.0

    def apart(self, i: int, j: int, one: Course, other: Course) -> bool:
        """Whether two courses keep the distance of the rules."""
        return are_apart(self.fleet, i, j, one, other)


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
        self._margin_m, self._way_home = moving_margin_m, way_home
        self._supervisor = Supervisor(fleet.arena.vehicles, fleet.brief.dt_s, fleet.braking_s)

    @property
    def backups(self) -> dict[int, Course]:
        """The backup trajectories, by UAS; a UAS may be given one that was verified elsewhere."""
        return self._supervisor.backups

    def chosen(
        self,
        swarm: SwarmState,
        wanted: Mapping[int, Course],
        moving: MovingObstacles,
        staying: Collection[int] = (),
    ) -> dict[int, tuple[Course, bool]]:
        """What each UAS flies from now on: its course, or what is left of its backup trajectory.

        Args:
            swarm: Where the UAS are.
            wanted: Courses of UAS that have one, from this sample on and verified.
            moving: What moves, as it is seen.
            staying: UAS that land where they are, and are gone after this step.

        Returns:
            For each UAS for which there is something verified: that, and whether it follows its
            course. UAS for which there is nothing are left out.
        """
        step, x = swarm.step, swarm.x
        flying = {u: x[u] for u in np.flatnonzero(swarm.status == FLYING).tolist()}
        landing = {u: _landing_here(self._fleet, u, step, x[u]) for u in staying}
        checks = Seen(self._fleet, moving, self._margin_m, self._way_home)
        follow = self._supervisor.renew(checks, step, flying, wanted, landing)
        return {u: (course, u in follow) for u, course in self.backups.items()}

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

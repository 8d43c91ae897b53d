"""A plan's backup trajectory: follow the plan for a while, then brake to a hover, all of it clear.

The paper's horizon ends wherever it ends; nothing says that a UAS can still stop there. A plan is
flown only with a backup trajectory: some step from which braking with the vehicle's inner loop
stays clear of everything, so that there is always something safe to do when no new plan comes.

Recursive feasibility. A backup trajectory ends in a hover, which can be held, clear of what stands,
of the fence's margin, of the other UAS and of moving obstacles at their last velocity: it is the
terminal set. After one step of it the UAS are where it says (it is computed with the model that the
world flies), and what is left of it is a backup trajectory again. So once there is one there is one
at every later decision, whether a solver says anything or not: what is left of the last, until a
new plan brings its own (`planning.backup`). Two things outside it can end the chain: a moving
obstacle that changes its velocity by more than its margin covers, and a plant that is not the
model; `still_holds` asks for both at every decision.

The battery. The end of a backup trajectory leaves charge to fly home from its hover, so that
DoD_max holds along all of it (the depth of discharge only grows). The plan's own end leaves an
allowance more (`BatteryReserve`), which is what braking takes. Hovering on at the end does use up
what is left; where a UAS would come home too late from where it is, whatever it does, its charge no
longer decides what is flown: a rule that then refused the way home would keep it in the air.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.appraisal import trouble
from uas_coverage_baselines.milp_mpc.model.blocks.battery_reserve import short_s
from uas_coverage_baselines.milp_mpc.model.norm_bounds import exceeds_limits
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import MovingHull, Plan, PlanningProblem
from uas_coverage_baselines.milp_mpc.model.verify import trouble_between
from uas_coverage_env.planning.backup.course import Course
from uas_coverage_env.planning.backup.supervisor import Supervisor
from uas_coverage_env.vehicle import compile_vehicle
from uas_coverage_env.vehicle.scale import braking_s

FloatArray = NDArray[np.float64]


def backup_trajectory(
    problem: PlanningProblem, plan: Plan, dt_s: float, blocks: Sequence[Block] = OCP
) -> Plan | None:
    """The plan followed as long as possible and then a braking flight; None where all fail.

    It is clear of everything, and each UAS whose charge suffices to come home now has enough in
    its hover, too. One UAS after the other follows its plan as long as it is clear of those before
    it; where that leaves one without, all follow theirs equally long (`Supervisor.teams`).
    """
    records = [compile_vehicle(vehicle, dt_s)[()] for vehicle in problem.vehicles]
    supervisor = Supervisor(records, dt_s, braking_s(problem.vehicles, dt_s))
    longer = replace(problem, moving=prolonged(problem, plan.u.shape[1] + supervisor.braking_steps))
    checks = _ByBlocks(problem, longer, blocks, supervisor.braking_steps)
    courses = {uas: course_of(plan, name) for uas, name in enumerate(problem.names)}
    for followed, team in supervisor.teams(checks, courses):
        if not all(checks.keeps_limits(uas, team[uas], n) for uas, n in followed.items()):
            continue
        result = _joined(problem, plan, followed, team)
        if trouble(longer, result, blocks) is None:
            return result
    return None


def course_of(plan: Plan, name: str) -> Course:
    """What one UAS flies by a plan, from now on."""
    row = plan.of(name)
    return Course(0, plan.x[row], plan.u[row], False)


class _ByBlocks:
    """What the supervisor asks of a decision: its geometry and its blocks, for one UAS alone.

    Args:
        problem: the decision.
        longer: the same, what moves predicted to the end of braking.
        blocks: of the OCP.
        braking_steps: after which a braked plan hovers.
    """

    def __init__(
        self,
        problem: PlanningProblem,
        longer: PlanningProblem,
        blocks: Sequence[Block],
        braking_steps: int,
    ) -> None:
        self._problem, self._blocks, self._braking_steps = problem, blocks, braking_steps
        swarm = range(problem.n_uas)
        self._alone = [longer.only(uas) for uas in swarm]
        self._in_time = [short_s(problem, uas, problem.x0[uas]) <= 0.0 for uas in swarm]

    def may_stop(self, uas: int, course: Course, followed: int) -> bool:
        """Whether nothing is wrong with it, and braking keeps the limits."""
        end = followed + self._braking_steps
        x, u = course.x[: end + 1], course.u[:end]
        covers = np.zeros((1, end, self._problem.n_scenario_waypoints), bool)
        alone = Plan(self._alone[uas].names, x[None], u[None], covers, 0.0, -np.inf)
        return (
            self.keeps_limits(uas, course, followed)
            and trouble(self._alone[uas], alone, self._blocks) is None
        )

    def keeps_limits(self, uas: int, course: Course, followed: int) -> bool:
        """Whether braking keeps the limits, to which the end of a plan may leave it no way."""
        vehicle, bounds = self._problem.vehicles[uas], self._problem.norm_bounds[uas]
        return not exceeds_limits(vehicle, bounds, course.x[followed + 1 :])

    def comes_home(self, uas: int, x: FloatArray) -> bool:
        """Whether its charge suffices; one that is late whatever it does is not held up."""
        late = short_s(self._problem, uas, x, allowance=False) > 0.0
        return not (late and self._in_time[uas])

    def apart(self, i: int, j: int, one: Course, other: Course) -> bool:
        """Whether two keep their separation."""
        return trouble_between(self._problem, i, j, one.x[:, :3], other.x[:, :3]) is None


def _joined(
    problem: PlanningProblem, plan: Plan, followed: Mapping[int, int], team: Mapping[int, Course]
) -> Plan:
    """One plan of all backups; a waypoint counts as covered while its UAS follows its plan."""
    steps = len(team[0].u)
    covers = np.zeros((problem.n_uas, steps, plan.covers.shape[2]), bool)
    for uas, name in enumerate(problem.names):
        covers[uas, : followed[uas]] = plan.covers[plan.of(name), : followed[uas]]
    x, u = np.array([c.x for c in team.values()]), np.array([c.u for c in team.values()])
    return Plan(problem.names, x, u, covers, plan.objective, -np.inf)


def still_holds(problem: PlanningProblem, backup: Plan, blocks: Sequence[Block] = OCP) -> bool:
    """Whether what is left of a backup trajectory is clear of what is seen, from where each is."""
    longer = replace(problem, moving=prolonged(problem, backup.u.shape[1]))
    return trouble(longer, backup, blocks) is None


def prolonged(problem: PlanningProblem, steps: int) -> tuple[MovingHull, ...]:
    """The moving obstacles predicted further, at the same velocity."""
    result = []
    for moving in problem.moving:
        stride = moving.position_m[-1] - moving.position_m[-2]
        beyond = np.arange(1, steps + 2 - len(moving.position_m))[:, None]
        path = np.vstack([moving.position_m, moving.position_m[-1] + beyond * stride])
        result.append(replace(moving, position_m=path))
    return tuple(result)

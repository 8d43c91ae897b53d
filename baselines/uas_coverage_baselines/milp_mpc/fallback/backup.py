"""A plan's backup trajectory: follow the plan for a while, then brake to a hover, all of it clear.

The paper's horizon ends wherever it ends; nothing says that a UAS can still stop there. A plan is
flown only with a backup trajectory: some step from which braking with the vehicle's inner loop
stays clear of everything, so that there is always something safe to do when no new plan comes.

Recursive feasibility. A backup trajectory ends in a hover, which can be held, clear of what stands,
of the fence's margin, of the other UAS and of moving obstacles at their last velocity: it is the
terminal set. After one step of it the UAS are where it says (it is computed with the model that the
world flies), and what is left of it is a backup trajectory again. So once there is one there is one
at every later decision, whether a solver says anything or not: what is left of the last, until a
new plan brings its own. Two things outside it can end the chain: a moving obstacle that changes its
velocity by more than its margin covers, and a plant that is not the model; `still_holds` asks for
both at every decision.

The battery. The end of a backup trajectory leaves charge to fly home from its hover, so that
DoD_max holds along all of it (the depth of discharge only grows). The plan's own end leaves an
allowance more (`BatteryReserve`), which is what braking takes. Hovering on at the end does use up
what is left; where a UAS would come home too late from where it is, whatever it does, its charge no
longer decides what is flown: a rule that then refused the way home would keep it in the air.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.braking import brake
from uas_coverage_baselines.milp_mpc.model.appraisal import trouble
from uas_coverage_baselines.milp_mpc.model.blocks.battery_reserve import short_s
from uas_coverage_baselines.milp_mpc.model.norm_bounds import exceeds_limits
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import MovingHull, Plan, PlanningProblem
from uas_coverage_baselines.milp_mpc.model.verify import trouble_between
from uas_coverage_env.vehicle import (
    compile_vehicle,
)

FloatArray = NDArray[np.float64]
BRAKING_S = 14.0
"""Braking from any speed has ended after this time."""


def backup_trajectory(
    problem: PlanningProblem, plan: Plan, dt_s: float, blocks: Sequence[Block] = OCP
) -> Plan | None:
    """The plan followed as long as possible and then a braking flight; None where all fail.

    It is clear of everything, and each UAS whose charge suffices to come home now has enough in
    its hover, too. One UAS after the other follows its plan as long as it is clear of those before
    it; where that leaves one without, all follow theirs equally long.
    """
    steps = plan.u.shape[1] + int(np.ceil(BRAKING_S / dt_s))
    candidates = _Candidates(problem, plan, dt_s, steps, blocks)
    longest = candidates.one_after_the_other()
    for followed in [longest, *([n] * problem.n_uas for n in range(plan.u.shape[1], 0, -1))]:
        if followed is not None and (result := candidates.together(followed)) is not None:
            return result
    return None


class _Candidates:
    """What each UAS flies that follows a plan for some steps and brakes then."""

    def __init__(
        self,
        problem: PlanningProblem,
        plan: Plan,
        dt_s: float,
        steps: int,
        blocks: Sequence[Block],
    ) -> None:
        self._problem, self._plan, self._steps = problem, plan, steps
        self._blocks = blocks
        self._braking_steps = steps - plan.u.shape[1]
        self._longer = replace(problem, moving=prolonged(problem, steps))
        self._records = [compile_vehicle(vehicle, dt_s)[()] for vehicle in problem.vehicles]
        swarm = range(problem.n_uas)
        self._alone = [self._longer.only(uas) for uas in swarm]
        self._in_time = [short_s(problem, uas, problem.x0[uas]) <= 0.0 for uas in swarm]

    def one_after_the_other(self) -> list[int] | None:
        """How long each follows its plan: as long as it is clear of those before it."""
        paths: list[FloatArray] = []
        followed: list[int] = []
        for uas in range(self._problem.n_uas):
            for n in range(self._plan.u.shape[1], 0, -1):
                x, u = self._flown(uas, n, self._steps)
                if self._fails_alone(uas, x, u, n) or any(
                    trouble_between(self._problem, uas, other, x[:, :3], path) is not None
                    for other, path in enumerate(paths)
                ):
                    continue
                paths.append(x[:, :3])
                followed.append(n)
                break
            else:
                return None
        return followed

    def together(self, followed: list[int]) -> Plan | None:
        """The flights of all, where nothing is wrong with them."""
        plan, steps = self._plan, max(followed) + self._braking_steps
        flown = [self._flown(uas, n, steps) for uas, n in enumerate(followed)]
        if not all(self._comes_home(uas, x[-1]) for uas, (x, _) in enumerate(flown)):
            return None
        covers = np.zeros((len(flown), steps, plan.covers.shape[2]), bool)
        for uas, (name, n) in enumerate(zip(self._problem.names, followed, strict=True)):
            covers[uas, :n] = plan.covers[plan.of(name), :n]
        x, u = (np.array([flight[k] for flight in flown]) for k in range(2))
        result = Plan(self._problem.names, x, u, covers, plan.objective, -np.inf)
        return result if trouble(self._longer, result, self._blocks) is None else None

    def _flown(self, uas: int, followed: int, steps: int) -> tuple[FloatArray, FloatArray]:
        """States (steps+1, 14) and inputs (steps, 5) of one UAS."""
        row = self._plan.of(self._problem.names[uas])
        x, u = self._plan.x[row, : followed + 1], self._plan.u[row, :followed]
        states, inputs = brake(self._records[uas], x[-1], steps - followed)
        return np.vstack([x, states]), np.vstack([u, inputs])

    def _fails_alone(self, uas: int, x: FloatArray, u: FloatArray, followed: int) -> bool:
        end = followed + self._braking_steps
        alone = Plan(
            *(self._alone[uas].names, x[None, : end + 1], u[None, :end]),
            *(np.zeros((1, end, self._problem.n_scenario_waypoints), bool), 0.0, -np.inf),
        )
        # a plan's end may leave braking no way to keep the limits
        problem, braking = self._problem, x[followed + 1 : end + 1]
        comes_home = self._comes_home(uas, x[end])
        return (
            not comes_home
            or exceeds_limits(problem.vehicles[uas], problem.norm_bounds[uas], braking)
            or trouble(self._alone[uas], alone, self._blocks) is not None
        )

    def _comes_home(self, uas: int, x: FloatArray) -> bool:
        late = short_s(self._problem, uas, x, allowance=False) > 0.0
        return not (late and self._in_time[uas])


def still_holds(problem: PlanningProblem, backup: Plan, blocks: Sequence[Block] = OCP) -> bool:
    """Whether what is left of a backup trajectory is clear of what is seen, from where each is."""
    if any(name not in backup.names for name in problem.names):
        return False
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

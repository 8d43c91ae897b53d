"""A plan's way out: follow it for a while, then brake to a hover, all of it clear.

The paper's horizon ends wherever it ends; nothing says that a UAS can still stop there. A plan is
flown only with a way out: some step from which braking with the vehicle's inner loop stays clear
of everything, so that there is always something safe to do when no new plan comes.

Recursive feasibility. A way out ends in a hover, which can be held, clear of what stands, of the
fence's margin, of the other UAS and of moving obstacles at their last velocity. After one step of
it the UAS are where it says (it is computed with the model that the world flies), and what is left
of it is a way out again. So once there is one there is one at every later decision, whether a
solver says anything or not: what is left of the last, until a new plan brings its own. Two things
outside it can end the chain: a moving obstacle that changes its velocity by more than its margin
covers, and a plant that is not the model; `still_holds` asks for both at every decision.

The battery. A way out's end leaves charge to fly home from its hover, so that DoD_max holds along
all of it (the depth of discharge only grows). The plan's own end leaves an allowance more
(`BatteryReserve`), which is what braking takes. Hovering on at the end does use up what is left;
where a UAS would come home too late from where it is, whatever it does, its charge no longer
decides what is flown: a rule that then refused the way home would keep it in the air.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.blocks.battery_reserve import short_s
from uas_coverage_baselines.milp_mpc.problem import MovingHull, Plan, PlanningProblem
from uas_coverage_baselines.milp_mpc.verify import first_trouble
from uas_coverage_env.vehicle import (
    compile_vehicle,
    lpv_step,
    reseed_reference,
    velocity_climb_wrench,
)

FloatArray = NDArray[np.float64]
BRAKING_S = 14.0
"""Braking from any speed has ended after this time."""


def way_out(problem: PlanningProblem, plan: Plan, dt_s: float) -> Plan | None:
    """The plan followed as long as possible and then a braking flight; None where all fail.

    It is clear of everything, and from its hover everybody's charge suffices to come home: of
    those it suffices for now.
    """
    in_time = [uas for uas, x in enumerate(problem.x0) if short_s(problem, uas, x) <= 0.0]
    braking_steps = int(np.ceil(BRAKING_S / dt_s))
    longer = replace(problem, moving=prolonged(problem, plan.u.shape[1] + braking_steps))
    records = [compile_vehicle(vehicle, dt_s)[()] for vehicle in problem.vehicles]
    for followed in range(plan.u.shape[1], 0, -1):
        tails = [
            brake(records[row], plan.x[plan.of(name), followed], braking_steps)
            for row, name in enumerate(problem.names)
        ]
        rows = [plan.of(name) for name in problem.names]
        x = np.concatenate([plan.x[rows, : followed + 1], np.array([t[0] for t in tails])], axis=1)
        u = np.concatenate([plan.u[rows, :followed], np.array([t[1] for t in tails])], axis=1)
        covers = np.zeros((len(rows), u.shape[1], plan.covers.shape[2]), bool)
        covers[:, :followed] = plan.covers[rows, :followed]
        result = Plan(problem.names, x, u, covers, plan.objective, -np.inf)
        ends = result.x[:, -1]
        if any(short_s(problem, uas, ends[uas], allowance=False) > 0.0 for uas in in_time):
            continue
        if first_trouble(longer, result) is None:
            return result
    return None


def still_holds(problem: PlanningProblem, out: Plan) -> bool:
    """Whether what is left of a way out is clear of what is seen now, beginning where it is."""
    if any(name not in out.names for name in problem.names):
        return False
    longer = replace(problem, moving=prolonged(problem, out.u.shape[1]))
    return first_trouble(longer, out) is None


def prolonged(problem: PlanningProblem, steps: int) -> tuple[MovingHull, ...]:
    """The moving obstacles predicted further, at the same velocity."""
    result = []
    for moving in problem.moving:
        stride = moving.position_m[-1] - moving.position_m[-2]
        beyond = np.arange(1, steps + 2 - len(moving.position_m))[:, None]
        path = np.vstack([moving.position_m, moving.position_m[-1] + beyond * stride])
        result.append(replace(moving, position_m=path))
    return tuple(result)


@njit(cache=True, error_model="numpy")
def brake(vehicle, start, steps):
    """States after each step (steps, 14) and inputs (steps, 5) of braking from a state."""
    states, inputs = np.empty((steps, start.shape[0])), np.zeros((steps, 5))
    x, reference = start.copy(), np.empty(2)
    reseed_reference(x, reference)
    for step in range(steps):
        velocity_climb_wrench(vehicle, x, reference, 0.0, 0.0, 0.0, inputs[step])
        lpv_step(vehicle, x, inputs[step], x)
        states[step] = x
    return states, inputs

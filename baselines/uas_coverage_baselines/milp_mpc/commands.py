"""What is commanded: a plan's first inputs, its velocities, or to hover."""

from __future__ import annotations

from collections.abc import Callable

from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_env.vehicle import LIFT, TAU_X, TAU_Y, TAU_Z, VX, VY, Z
from uas_coverage_env.world import Command, Mode, SwarmState, Velocity, Wrench

_LEAD_S = 2.0
"""The inner loop follows a velocity with about this delay; it is told so much ahead [s]."""


def first_inputs(plan: Plan, swarm: SwarmState, mode: Callable[[str], Mode]) -> dict[str, Command]:
    """The inputs of the plan's first step, for every active UAS.

    Args:
        plan: for all of them.
        swarm: what is seen.
        mode: of a UAS.
    """
    steps = {name: plan.u[plan.of(name), 0] for name in swarm.active}
    return {
        name: Wrench(*(float(u[row]) for row in (LIFT, TAU_X, TAU_Y, TAU_Z)), mode=mode(name))
        for name, u in steps.items()
    }


def velocities(
    plan: Plan, swarm: SwarmState, dt_s: float, mode: Callable[[str], Mode]
) -> dict[str, Command]:
    """The velocities and heights that the plan leads to, for every active UAS.

    Its inputs are those of still air. Where something pushes back, the inner loop knows it.

    Args:
        plan: for all of them.
        swarm: what is seen.
        dt_s: sampling time.
        mode: of a UAS.
    """
    ahead = min(max(round(_LEAD_S / dt_s), 1), plan.x.shape[1] - 1)
    result: dict[str, Command] = {}
    for name in swarm.active:
        x = plan.x[plan.of(name)]
        north_mps, east_mps = float(x[ahead, VX]), float(x[ahead, VY])
        result[name] = Velocity(north_mps, east_mps, -float(x[1, Z]), mode=mode(name))
    return result


def hovering(swarm: SwarmState, mode: Callable[[str], Mode]) -> dict[str, Command]:
    """Brake and hold the height with the vehicle's inner loop, for every active UAS."""
    z_m = {name: float(swarm.x[swarm.names.index(name), 2]) for name in swarm.active}
    return {name: Velocity(0.0, 0.0, -z, mode=mode(name)) for name, z in z_m.items()}

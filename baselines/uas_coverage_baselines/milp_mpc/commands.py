"""What is commanded: a plan's first inputs, or to hover; in wind, see `in_wind`."""

from __future__ import annotations

from collections.abc import Callable

from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_env.entities.commands import Mode
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world import Command, SwarmState, Velocity, Wrench


def first_inputs(plan: Plan, swarm: SwarmState, mode: Callable[[str], Mode]) -> dict[str, Command]:
    """The inputs of the plan's first step, for every active UAS.

    Args:
        plan: for all of them.
        swarm: what is seen.
        mode: of a UAS.
    """
    steps = {name: plan.u[plan.of(name), 0] for name in swarm.active}
    return {
        name: Wrench(
            *(float(u[row]) for row in (S.LIFT, S.TAU_X, S.TAU_Y, S.TAU_Z)), mode=mode(name)
        )
        for name, u in steps.items()
    }


def hovering(swarm: SwarmState, mode: Callable[[str], Mode]) -> dict[str, Command]:
    """Brake and hold the height with the vehicle's inner loop, for every active UAS."""
    z_m = {name: float(swarm.x[swarm.names.index(name), S.Z]) for name in swarm.active}
    return {name: Velocity(0.0, 0.0, -z, mode=mode(name)) for name, z in z_m.items()}

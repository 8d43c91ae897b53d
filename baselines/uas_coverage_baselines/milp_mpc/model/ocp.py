"""The optimal control problem (OF), (OCP_1) to (OCP_8): its table of contents.

`OCP` is the one tuple of blocks. Whatever is flown is derived from it: the reduced formulations
replace some of its blocks (`reductions.formulations`), flights that no solver made are priced and
checked by its blocks (`appraisal`). A block that is added to it is in all of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.blocks import (
    BatteryReserve,
    Capabilities,
    Collision,
    CornerCutting,
    Coverage,
    Dynamics,
    InsideGeofence,
    MinHeight,
    MovingObstacles,
    Obstacles,
    Slack,
    TargetDistance,
)
from uas_coverage_baselines.milp_mpc.model.blocks.coverage import coverable
from uas_coverage_baselines.milp_mpc.model.blocks.time_to_go import TimeToGo
from uas_coverage_baselines.milp_mpc.model.milp import ELIMINATED, Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Trajectories, Variables
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.vehicle.layout import LIFT, N_INPUTS, N_STATES, Z
from uas_coverage_env.world import SwarmState


@runtime_checkable
class Block(Protocol):
    """One constraint family of the OCP (Sec. III-C), with its part of the objective."""

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add the family's columns, rows and costs."""
        ...


@runtime_checkable
class Priced(Protocol):
    """A block that knows its part of the objective along given flights in closed form.

    It is optional: the cost of a block without it is found from its rows (`appraisal`).
    """

    def cost_along(
        self, problem: PlanningProblem, uas: int, flights: Trajectories
    ) -> NDArray[np.float64]:
        """(S,) what the block adds to the objective along flights of one UAS."""
        ...


@runtime_checkable
class Informed(Protocol):
    """A block that brings data of its own to each decision; it is optional (`model.own_data`)."""

    def data(self, brief: MissionBrief, swarm: SwarmState) -> Mapping[str, Any]:
        """What the block reads in `problem.data_of(self)`: numbers and arrays by name.

        Args:
            brief: the mission.
            swarm: what is seen now, the time included.
        """
        ...


PAPER_OCP: tuple[Block, ...] = (
    Dynamics(),  # OCP_1
    Capabilities(),  # OCP_3
    Slack(),  # OCP_4, part I of the objective
    InsideGeofence(),  # OCP_5
    TargetDistance(),  # OCP_7, part II
    Collision(),  # OCP_3
    Obstacles(),  # OCP_6
    MovingObstacles(),  # OCP_6
    CornerCutting(),  # OCP_6
    Coverage(),  # OCP_8, part III
)
"""The paper's own families (Sec. III-C); what is added to `OCP` does not join them."""

OCP: tuple[Block, ...] = (
    Dynamics(),
    Capabilities(),
    Slack(),
    InsideGeofence(),
    MinHeight(),
    TargetDistance(),
    Collision(),
    Obstacles(),
    MovingObstacles(),
    CornerCutting(),
    Coverage(),
    TimeToGo(),
    BatteryReserve(),
)
"""The paper's families, and three of ours that add rows where there is something to them: a least
height, an order, charge for the way home."""


class MakesVariables(Protocol):
    """How a formulation makes the columns that its blocks share."""

    def __call__(self, milp: Milp, problem: PlanningProblem) -> Variables:
        """Add the columns."""
        ...


def shared_variables(
    milp: Milp,
    problem: PlanningProblem,
    *,
    states: NDArray[np.bool_] | None = None,
    inputs: NDArray[np.bool_] | None = None,
    coverage_state: bool = True,
) -> Variables:
    """The columns every block may use; x(0) and Phi(0) are fixed to what was measured.

    Args:
        milp: the program.
        problem: the decision.
        states: (U, 14) which states get columns; all where None.
        inputs: (U, 5) which inputs get columns; all where None.
        coverage_state: whether Phi gets columns; without, it is `ELIMINATED` but for Phi(N).
    """
    U, N, W = problem.n_uas, problem.horizon, problem.n_waypoints
    lower = np.full((U, N + 1, N_STATES), -np.inf)
    upper = -lower
    lower[:, 0] = upper[:, 0] = problem.x0
    open_now = np.zeros((N + 1, W))
    open_now[0] = 1.0
    made_x = None if states is None else states[:, None, :]
    made_u = None if inputs is None else inputs[:, None, :]
    if problem.planar:
        made_x = np.isin(range(N_STATES), problem.states) & (made_x is None or made_x)
        made_u = (np.arange(N_INPUTS) != LIFT) & (made_u is None or made_u)
    x = milp.variables("x", (U, N + 1, N_STATES), lower=lower, upper=upper, where=made_x)
    u = milp.variables("u", (U, N, N_INPUTS), where=made_u)
    if problem.planar:
        x[..., Z] = ELIMINATED  # vertical speed and lift are zero, the height is not
    covers = milp.variables(
        "covers", (U, N, W), lower=0.0, upper=1.0, integer=True, where=coverable(problem)
    )
    if coverage_state:
        uncovered = milp.variables("uncovered", (N + 1, W), lower=open_now, upper=1.0)
    else:
        uncovered = np.full((N + 1, W), ELIMINATED)
        uncovered[-1] = milp.variables("open_at_end", (W,), lower=0.0, upper=1.0)
    return Variables(x, u, covers, uncovered)


def formulate(
    problem: PlanningProblem,
    blocks: Sequence[Block] = OCP,
    variables: MakesVariables = shared_variables,
) -> tuple[Milp, Variables]:
    """Write the OCP of one decision as a mixed-integer linear program."""
    milp = Milp()
    v = variables(milp, problem)
    for block in blocks:
        block.add_to(milp, v, problem)
    return milp, v

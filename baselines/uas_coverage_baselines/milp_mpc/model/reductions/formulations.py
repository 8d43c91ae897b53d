"""Named formulations of the same OCP, from the paper's to the smallest and tightest, as data.

Each is derived from one tuple of blocks by replacing some of them. A block that a formulation does
not replace is in it as it is: a block that is added to the OCP is in every program.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from uas_coverage_baselines.milp_mpc.model.blocks import (
    Capabilities,
    Collision,
    CornerCutting,
    Coverage,
    Dynamics,
    MovingObstacles,
    Obstacles,
    Slack,
)
from uas_coverage_baselines.milp_mpc.model.milp import (
    ABSENT,
    ELIMINATED,
    BuiltMilp,
    EliminatedColumnError,
    Milp,
    MissingColumnsError,
)
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block, MakesVariables, shared_variables
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables
from uas_coverage_baselines.milp_mpc.model.reductions.aggregated import AggregatedBoxes
from uas_coverage_baselines.milp_mpc.model.reductions.bounds import rows_as_bounds
from uas_coverage_baselines.milp_mpc.model.reductions.cliques import VisitCliques
from uas_coverage_baselines.milp_mpc.model.reductions.elimination import (
    BatteryFromThrust,
    MotionCapabilities,
    MotionDynamics,
    MotionSlack,
    motion_variables,
)
from uas_coverage_baselines.milp_mpc.model.reductions.first_visit import (
    FirstVisit,
    VisitBoxes,
    without_coverage_state,
)
from uas_coverage_baselines.milp_mpc.model.reductions.lifted import LiftedBoxes
from uas_coverage_baselines.milp_mpc.model.reductions.one_face import OneFacePerInterval
from uas_coverage_baselines.milp_mpc.model.reductions.paper import PaperCornerCutting, PaperCoverage
from uas_coverage_baselines.milp_mpc.model.reductions.visit_order import VisitOrder
from uas_coverage_env.vehicle.layout import LIFT, VZ


def _as_it_is(milp: BuiltMilp) -> BuiltMilp:
    return milp


Replacements = Mapping[tuple[type, ...], tuple[Block, ...]]
"""What stands for what: blocks of these classes, all of them, become those blocks."""


def replacing(blocks: Sequence[Block], replacements: Replacements) -> tuple[Block, ...] | None:
    """The blocks with some of them replaced, each group at the place of its last block.

    Args:
        blocks: one of each class at most, where the class is to be replaced.
        replacements: classes are compared exactly: a subclass is a block of its own.

    Returns:
        The blocks; None where a block that is to be replaced is not among them.
    """
    classes = [type(block) for block in blocks]
    if any(one not in classes for group in replacements for one in group):
        return None
    replaced = {one for group in replacements for one in group}
    last = {max(classes.index(one) for one in group): new for group, new in replacements.items()}
    result: list[Block] = []
    for row, block in enumerate(blocks):
        result += last.get(row, () if classes[row] in replaced else (block,))
    return tuple(result)


@dataclass(frozen=True)
class Formulation:
    """One way to write the OCP; all have the same optimum.

    Attributes:
        adds: what it changes against the one before it.
        replaces: the blocks of the OCP that it writes in another way.
        tightened_by: families of rows after those of the OCP.
        prune: whether reachable sets drop rows and binaries and give the smallest valid M.
        variables: makes the shared columns.
        finish: what is done to the program once it is built.
    """

    adds: str
    replaces: Replacements = field(default_factory=dict)
    tightened_by: tuple[Block, ...] = ()
    prune: bool = True
    variables: MakesVariables = shared_variables
    finish: Callable[[BuiltMilp], BuiltMilp] = _as_it_is

    def of(self, blocks: Sequence[Block]) -> tuple[Block, ...]:
        """The blocks in this form.

        Raises:
            ValueError: a block that this form replaces is not among them.
        """
        replaced = replacing(blocks, self.replaces)
        if replaced is None:
            raise ValueError("the formulation replaces a block that is not there")
        return (*replaced, *self.tightened_by)

    def write(
        self, problem: PlanningProblem, blocks: Sequence[Block] = OCP
    ) -> tuple[Milp, Variables]:
        """The OCP of one decision in this form."""
        if problem.prune != self.prune:
            problem = replace(problem, prune=self.prune)
        milp = Milp()
        v = self.variables(milp, problem)
        reduced = [*self.tightened_by, *(new for group in self.replaces.values() for new in group)]
        for block in self.of(blocks):
            ours = any(block is one for one in reduced)
            block.add_to(milp, v if ours else _without_zeros(v, problem), problem)
        return milp, v

    def build(
        self, problem: PlanningProblem, blocks: Sequence[Block] = OCP
    ) -> tuple[BuiltMilp, Variables]:
        """The program to solve, and its shared columns."""
        milp, v = self.write(problem, blocks)
        return self.finish(milp.build()), v


def _without_zeros(v: Variables, problem: PlanningProblem) -> Variables:
    """The columns for a block of the OCP: a state that is zero without it is none it may use."""
    x, u = (np.where(columns == ABSENT, ELIMINATED, columns) for columns in (v.x, v.u))
    if problem.planar:
        # these are zero whatever the block does
        x[..., VZ] = u[..., LIFT] = ABSENT
    return replace(v, x=x, u=u)


_FIRST_VISIT: Replacements = {(Coverage,): (FirstVisit(),)}
_ONE_FACE: Replacements = {
    (Collision, Obstacles, MovingObstacles, CornerCutting): (OneFacePerInterval(),)
}
_MOTION: Replacements = {
    (Dynamics,): (MotionDynamics(),),
    (Capabilities,): (MotionCapabilities(),),
    (Slack,): (MotionSlack(), BatteryFromThrust()),
    **_ONE_FACE,
    **_FIRST_VISIT,
}
_AS_IN_THE_PAPER: Replacements = {
    (CornerCutting,): (PaperCornerCutting(),),
    (Coverage,): (PaperCoverage(),),
}

FORMULATIONS: Mapping[str, Formulation] = MappingProxyType(
    {
        "paper": Formulation(
            "the rows as the paper has them, M from the fence alone",
            _AS_IN_THE_PAPER,
            prune=False,
        ),
        "reach": Formulation(
            "reachable sets: rows and binaries dropped, smallest M", _AS_IN_THE_PAPER
        ),
        "corner": Formulation("b(n), b(n+1) <= c(n) with c whole alone, Phi continuous"),
        "visit": Formulation(
            "Phi eliminated: a reward for the first visit",
            _FIRST_VISIT,
            (VisitBoxes(),),
            variables=without_coverage_state,
        ),
        "face": Formulation(
            "one binary per shape, interval and face: b eliminated",
            {**_ONE_FACE, **_FIRST_VISIT},
            (VisitBoxes(),),
            variables=without_coverage_state,
        ),
        "state": Formulation(
            "yaw and battery eliminated, one-column rows as bounds",
            _MOTION,
            (VisitBoxes(),),
            variables=motion_variables,
            finish=rows_as_bounds,
        ),
        "aggregate": Formulation(
            "one box row per UAS, step and direction over all waypoints",
            _MOTION,
            (AggregatedBoxes(),),
            variables=motion_variables,
            finish=rows_as_bounds,
        ),
        "clique": Formulation(
            "at most one visit per window and clique of waypoints",
            _MOTION,
            (AggregatedBoxes(), VisitCliques(), VisitOrder()),
            variables=motion_variables,
            finish=rows_as_bounds,
        ),
        "lift": Formulation(
            "box rows lifted over the samples around",
            _MOTION,
            (LiftedBoxes(), VisitCliques(), VisitOrder()),
            variables=motion_variables,
            finish=rows_as_bounds,
        ),
    }
)
"""Cumulative: each has all of the one before it and what `adds` says."""

_WITH_ALL_STATES = ("face", "corner")


def write_smallest(
    problem: PlanningProblem, blocks: Sequence[Block], first: str
) -> tuple[Formulation, Milp, Variables]:
    """The OCP in the smallest form that has all columns that the blocks use.

    Reduced forms do without yaw at rest, the battery's states or Phi. Where a block uses these, or
    columns of a block that a form replaces, the next larger form is taken; `corner`, the blocks
    as they are, has them all.

    Args:
        problem: the decision.
        blocks: of the OCP.
        first: the form that is taken where it is possible.
    """
    for name in (first, *_WITH_ALL_STATES[:-1]):
        formulation = FORMULATIONS[name]
        if replacing(blocks, formulation.replaces) is None:
            continue
        try:
            return formulation, *formulation.write(problem, blocks)
        except (EliminatedColumnError, MissingColumnsError):
            continue
    whole = FORMULATIONS[_WITH_ALL_STATES[-1]]
    return whole, *whole.write(problem, blocks)

"""Named formulations of the same OCP, from the paper's to the smallest and tightest, as data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from uas_coverage_baselines.milp_mpc.blocks import (
    BatteryReserve,
    Capabilities,
    Collision,
    CornerCutting,
    Dynamics,
    Geofence,
    MovingObstacles,
    Obstacles,
    Slack,
    TargetDistance,
    TimeToGo,
)
from uas_coverage_baselines.milp_mpc.milp import BuiltMilp, Milp
from uas_coverage_baselines.milp_mpc.ocp import (
    OCP,
    Block,
    MakesVariables,
    formulate,
    shared_variables,
)
from uas_coverage_baselines.milp_mpc.problem import PlanningProblem, Variables
from uas_coverage_baselines.milp_mpc.reductions.aggregated import AggregatedBoxes
from uas_coverage_baselines.milp_mpc.reductions.bounds import rows_as_bounds
from uas_coverage_baselines.milp_mpc.reductions.cliques import VisitCliques
from uas_coverage_baselines.milp_mpc.reductions.elimination import (
    BatteryFromThrust,
    MotionCapabilities,
    MotionDynamics,
    MotionSlack,
    motion_variables,
)
from uas_coverage_baselines.milp_mpc.reductions.first_visit import (
    FirstVisit,
    VisitBoxes,
    without_coverage_state,
)
from uas_coverage_baselines.milp_mpc.reductions.lifted import LiftedBoxes
from uas_coverage_baselines.milp_mpc.reductions.one_face import OneFacePerInterval
from uas_coverage_baselines.milp_mpc.reductions.paper import PaperCornerCutting, PaperCoverage
from uas_coverage_baselines.milp_mpc.reductions.visit_order import VisitOrder


def _as_it_is(milp: BuiltMilp) -> BuiltMilp:
    return milp


@dataclass(frozen=True)
class Formulation:
    """One way to write the OCP; all have the same optimum.

    Attributes:
        adds: what it changes against the one before it.
        blocks: its families of rows.
        prune: whether reachable sets drop rows and binaries and give the smallest valid M.
        variables: makes the shared columns.
        finish: what is done to the program once it is built.
    """

    adds: str
    blocks: tuple[Block, ...]
    prune: bool = True
    variables: MakesVariables = shared_variables
    finish: Callable[[BuiltMilp], BuiltMilp] = _as_it_is

    def write(self, problem: PlanningProblem) -> tuple[Milp, Variables]:
        """The OCP of one decision in this form."""
        if problem.prune != self.prune:
            problem = replace(problem, prune=self.prune)
        return formulate(problem, self.blocks, self.variables)

    def build(self, problem: PlanningProblem) -> tuple[BuiltMilp, Variables]:
        """The program to solve, and its shared columns."""
        milp, v = self.write(problem)
        return self.finish(milp.build()), v


# what the OCP has beyond the paper is in all of them: compared is how rows are written
_BEYOND: tuple[Block, ...] = (TimeToGo(), BatteryReserve())
_PAPER: tuple[Block, ...] = (
    Dynamics(),
    Capabilities(),
    Slack(),
    Collision(),
    Geofence(),
    Obstacles(),
    MovingObstacles(),
    PaperCornerCutting(),
    PaperCoverage(),
    TargetDistance(),
    *_BEYOND,
)
_FLIGHT: tuple[Block, ...] = (
    Dynamics(),
    Capabilities(),
    Slack(),
    Geofence(),
    TargetDistance(),
    *_BEYOND,
)
_APART: tuple[Block, ...] = (Collision(), Obstacles(), MovingObstacles(), CornerCutting())
_MOTION: tuple[Block, ...] = (
    MotionDynamics(),
    MotionCapabilities(),
    MotionSlack(),
    BatteryFromThrust(),
    Geofence(),
    TargetDistance(),
    OneFacePerInterval(),
    FirstVisit(),
    *_BEYOND,
)

FORMULATIONS: Mapping[str, Formulation] = MappingProxyType(
    {
        "paper": Formulation(
            "the rows as the paper has them, M from the fence alone", _PAPER, prune=False
        ),
        "reach": Formulation("reachable sets: rows and binaries dropped, smallest M", _PAPER),
        "corner": Formulation("b(n), b(n+1) <= c(n) with c whole alone, Phi continuous", OCP),
        "visit": Formulation(
            "Phi eliminated: a reward for the first visit",
            (*_FLIGHT, *_APART, FirstVisit(), VisitBoxes()),
            variables=without_coverage_state,
        ),
        "face": Formulation(
            "one binary per shape, interval and face: b eliminated",
            (*_FLIGHT, OneFacePerInterval(), FirstVisit(), VisitBoxes()),
            variables=without_coverage_state,
        ),
        "state": Formulation(
            "yaw and battery eliminated, one-column rows as bounds",
            (*_MOTION, VisitBoxes()),
            variables=motion_variables,
            finish=rows_as_bounds,
        ),
        "aggregate": Formulation(
            "one box row per UAS, step and direction over all waypoints",
            (*_MOTION, AggregatedBoxes()),
            variables=motion_variables,
            finish=rows_as_bounds,
        ),
        "clique": Formulation(
            "at most one visit per window and clique of waypoints",
            (*_MOTION, AggregatedBoxes(), VisitCliques(), VisitOrder()),
            variables=motion_variables,
            finish=rows_as_bounds,
        ),
        "lift": Formulation(
            "box rows lifted over the samples around",
            (*_MOTION, LiftedBoxes(), VisitCliques(), VisitOrder()),
            variables=motion_variables,
            finish=rows_as_bounds,
        ),
    }
)
"""Cumulative: each has all of the one before it and what `adds` says."""

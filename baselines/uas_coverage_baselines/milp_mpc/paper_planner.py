"""`milp-mpc-paper`: the joint OCP of all UAS as the paper has it, solved to a stated gap.

Algorithm 1 and nothing else: measure, solve, fly the first step, again. No construction, no
decomposition, no backup trajectory; what the rows of Sec. III-C do not ask is not asked. Whatever
departs from these rows is an option that is off.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from uas_coverage_baselines.milp_mpc.commands import first_inputs, hovering
from uas_coverage_baselines.milp_mpc.fallback.reasons import Reason
from uas_coverage_baselines.milp_mpc.mode_problems import ModeProblems
from uas_coverage_baselines.milp_mpc.model.blocks import BatteryReserve, MinHeight
from uas_coverage_baselines.milp_mpc.model.named_blocks import block_named, checked
from uas_coverage_baselines.milp_mpc.model.ocp import PAPER_OCP, Block
from uas_coverage_baselines.milp_mpc.model.own_data import with_data
from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem
from uas_coverage_baselines.milp_mpc.model.reductions import FORMULATIONS
from uas_coverage_baselines.milp_mpc.options import (
    ModeOptions,
    TimeLimitS,
    UnlessNone,
    with_default,
)
from uas_coverage_baselines.milp_mpc.search.restricted import RestrictedMilp
from uas_coverage_baselines.milp_mpc.silent_uas import SilentUas
from uas_coverage_baselines.milp_mpc.solvers import SolverLimits, solver_named
from uas_coverage_baselines.milp_mpc.solvers.interface import SolverError, SolveStatus
from uas_coverage_env.entities.commands import Mode
from uas_coverage_env.flight import Decision
from uas_coverage_env.mission import MissionBrief, Ways, first_sight
from uas_coverage_env.mission.refusal import refuse_what_asks
from uas_coverage_env.planning.around.handover import away_of
from uas_coverage_env.world import Command, SwarmState

_ROUNDING_M = 1e-5  # a solution keeps its rows to 2e-6, and a breach is one by any amount


class PaperOptions(ModeOptions):
    """Options of `milp-mpc-paper`: Table I, and where the paper is silent what is closest to it."""

    GONE: ClassVar[Mapping[str, str]] = {**ModeOptions.GONE, "order": "it is taylor_order"}

    formulation: str = Field(
        default="clique",
        description="how the rows are written, all with the same optimum: "
        + ", ".join(FORMULATIONS),
    )
    gap: float = Field(
        default=0.01, ge=0.0, le=1.0, description="solved until the relative gap is at most this"
    )
    absolute_gap: float = Field(
        default=0.01,
        ge=0.0,
        le=100.0,
        description="or the absolute gap this, in steps that a waypoint of weight 1 stays open",
    )
    time_limit_s: TimeLimitS = Field(
        default=None, gt=0.0, description="wall clock per decision [s]; none: until the gap"
    )
    threads: int = Field(default=1, ge=1, le=64, description="of the solver")
    horizon: int = Field(default=18, ge=2, le=60, description="N, steps of the prediction")
    in_wind: Literal["guidance", "wrenches"] = with_default(ModeOptions, "in_wind", "wrenches")
    taylor_order: int = Field(default=4, ge=2, le=8, description="N_dis of the Taylor series")
    physical_sides: int = Field(
        default=8, ge=4, le=64, multiple_of=4, description="H_P of the physical constraints"
    )
    limits: Literal["inner", "outer"] = Field(
        default="inner",
        description="c_in of speed, tilt and tilt rate: cos(pi / H_P), or 1, up to "
        "1 / cos(pi / H_P) beyond the limits, which the world calls violations",
    )
    margin_m: float | None = with_default(ModeOptions, "margin_m", _ROUNDING_M)
    moving_margin_m: float | None = with_default(ModeOptions, "moving_margin_m", _ROUNDING_M)
    corner_cutting: Literal["fixed", "all"] = Field(
        default="fixed",
        description="what has these rows: fixed obstacles, or also moving ones and pairs of UAS",
    )
    battery_reserve: bool = Field(
        default=False, description="whether a plan's end keeps charge for the way home"
    )
    priority_per_s: float = with_default(ModeOptions, "priority_per_s", 0.0)
    return_rule: Annotated[Literal["waypoints", "vehicle"] | None, UnlessNone] = with_default(
        ModeOptions, "return_rule", None
    )
    # the polygon inside the limit of speed takes 8 % (H_P = 8), turns and ways past traffic a tenth
    return_detour: float = with_default(ModeOptions, "return_detour", 1.2)
    targets: Annotated[Literal["straight", "routed"] | None, UnlessNone] = Field(
        default=None,
        description="how targets are aimed at: straight, as the paper's are, or along the world's "
        "routes; none: straight, but where there are doors, or an obstacle up to the ceiling that "
        "is longer than the horizon reaches",
    )
    return_scale: Literal["horizon", "distance"] = with_default(
        ModeOptions, "return_scale", "distance"
    )
    target_scale: Literal["fixed", "candidates"] = with_default(
        ModeOptions, "target_scale", "candidates"
    )

    @property
    def form(self) -> dict[str, Any]:
        """How the OCP is approximated."""
        return super().form | {
            "physical_sides": self.physical_sides,
            "limit_sides": self.physical_sides,
            "outer_limits": self.limits == "outer",
            "order": self.taylor_order,
            "corners_of_all": self.corner_cutting == "all",
            "prune": FORMULATIONS[self.formulation].prune,
        }

    @field_validator("formulation")
    @classmethod
    def _known(cls, name: str) -> str:
        if name not in FORMULATIONS:
            raise ValueError(f"no formulation is called {name!r}; take {', '.join(FORMULATIONS)}")
        return name

    @model_validator(mode="after")
    def _possible(self) -> PaperOptions:
        if self.solver == "scip" and self.threads > 1:
            raise ValueError("solver scip searches on one thread: give threads=1")
        return self


@dataclass(frozen=True)
class SolvedProgram:
    """What the last decision solved.

    Attributes:
        step: the sample.
        rows: of the program.
        columns: of the program.
        whole: columns that take whole numbers and are not fixed.
        objective: J without what the plan cannot influence; inf without a solution.
        bound: proven lower bound of it; -inf where none.
        write_s: how long it took to write [s].
        solve_s: and to solve.
        processor_s: of both, all threads.
        status: what came of it.
        iterations: of the simplex; 0 where the solver does not tell them.
    """

    step: int
    rows: int
    columns: int
    whole: int
    objective: float
    bound: float
    write_s: float
    solve_s: float
    processor_s: float
    status: SolveStatus
    iterations: int = 0


def needs_routes(brief: MissionBrief, options: PaperOptions) -> bool:
    """Whether a UAS that aims straight at its target may stay before a wall.

    It sees a way round an obstacle only within its horizon: it does not where an obstacle that it
    cannot fly over is longer than that, nor where walls and doors make rooms.
    """
    if len(brief.doors_m):
        return True
    farthest_mps = min(vehicle.limits.v_xy_max_mps for vehicle in brief.vehicles)
    reach_m = options.horizon * brief.dt_s * farthest_mps
    ceiling_m = brief.fence.vertices_m[:, 2].min()
    size_m = max(uas.radius_m for uas in brief.uas)
    for obstacle, hull in zip(brief.obstacles, brief.kept_hulls, strict=True):
        low, high = hull.vertices_m.min(axis=0), hull.vertices_m.max(axis=0)
        over_m = low[2] - size_m - obstacle.safe_distance_m
        if over_m <= ceiling_m and np.hypot(*(high - low)[:2]) > reach_m:
            return True
    return False


class MilpMpcPaper:
    """The paper's own program: the joint OCP of all UAS, solved to a gap before each step.

    Gasche et al., Sec. III, row for row; not in real time. Where no solution comes (the time is
    up, or there is none) the rest of the last plan is flown, and where there is none the UAS hover.

    Args:
        options: see `uas-coverage planner list`.
        blocks: of the OCP; those that the option `blocks` names come after them.
    """

    Options = PaperOptions

    def __init__(
        self, options: PaperOptions | None = None, blocks: Sequence[Block] = PAPER_OCP
    ) -> None:
        self.options = options or PaperOptions()
        # the scenario's rule, of which the paper knows nothing; without one it adds no rows
        ours = (MinHeight(), BatteryReserve()) if self.options.battery_reserve else (MinHeight(),)
        named = (block_named(name) for name in self.options.blocks)
        self.blocks = (*(checked(block) for block in blocks), *ours, *named)
        self._solve = solver_named(self.options.solver)
        self.last_decision: Decision | None = None
        self.last_program: SolvedProgram | None = None
        self.plan: Plan | None = None  # what is left of the last plan, beginning now

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile what the first decision compiles, without solving it."""
        refuse_what_asks(brief)
        self._problems(brief).problem(first_sight(brief), None)

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Start a mission; nothing is random in the planner, so the seed changes nothing."""
        refuse_what_asks(brief)
        self._brief = brief
        self._by_modes, self._silent_uas = self._problems(brief), SilentUas(brief, 0.0)
        self.plan = self.last_decision = self.last_program = None

    def _problems(self, brief: MissionBrief) -> ModeProblems:
        targets = self.options.targets
        routed = targets == "routed" or (targets is None and needs_routes(brief, self.options))
        # what is beyond the horizon costs as much a metre as what is at its end: with less, setting
        # off may cost more than it gains, and a UAS stays
        return ModeProblems(brief, self.options, Ways(brief) if routed else None, farthest=1.0)

    def mode(self, name: str) -> Mode:
        """The operation mode."""
        return self._by_modes.mode(name)

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are given up, and why in a few words."""
        return self._by_modes.given_up

    def problem(self, swarm: SwarmState) -> PlanningProblem:
        """Algorithms 2 and 3, then the OCP's data."""
        problem = self._by_modes.problem(swarm, self.plan)
        problem = self._silent_uas.beside(problem, swarm, away_of(swarm))
        return with_data(problem, self.blocks, self._brief, swarm)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """One step of Algorithm 1: solve the OCP and fly its first input."""
        if not swarm.active:
            return {}
        found = self.solved(self.problem(swarm), swarm.step)
        reason = found if isinstance(found, Reason) else None
        plan = self.plan if isinstance(found, Reason) else found
        if plan is None or not set(swarm.active) <= set(plan.names):
            self.plan = None
            paths = {name: swarm.x[[swarm.names.index(name)], 0:3] for name in swarm.active}
            self.last_decision = Decision(paths, fallback=True, reason=reason)
            return hovering(swarm, self.mode)
        self.plan = plan.advanced()
        paths = {name: path for name, path in plan.positions().items() if name in swarm.active}
        gap = plan.relative_gap() if reason is None else None
        self.last_decision = Decision(paths, reason is not None, gap, reason)
        return first_inputs(plan, swarm, self.mode)

    def solved(self, problem: PlanningProblem, step: int) -> Plan | Reason:
        """The OCP's solution; or why there is none. Leaves `last_program`.

        Args:
            problem: the decision.
            step: the sample it is made at.
        """
        began, busy = time.perf_counter(), time.process_time()
        program = RestrictedMilp(problem, self.blocks, first=self.options.formulation)
        written, built = time.perf_counter(), program.built
        limits = SolverLimits(
            time_s=self.options.time_limit_s,
            relative_gap=self.options.gap,
            absolute_gap=self.options.absolute_gap,
            threads=self.options.threads,
        )
        try:
            solution = self._solve(built, limits)
        except SolverError:
            return Reason.NO_PLAN
        self.last_program = SolvedProgram(
            step=step,
            rows=len(built.row_lower),
            columns=len(built.cost),
            whole=int((built.integer & (built.lower < built.upper)).sum()),
            objective=solution.objective,
            bound=solution.bound,
            write_s=written - began,
            solve_s=solution.wall_time_s,
            processor_s=time.process_time() - busy,
            status=solution.status,
            iterations=solution.iterations,
        )
        if solution.values is None:
            infeasible = solution.status is SolveStatus.INFEASIBLE
            return Reason.NO_PLAN if infeasible or limits.time_s is None else Reason.NO_TIME
        plan = program.plan(solution)
        return replace(plan, bound=solution.bound, renewed=problem.names)

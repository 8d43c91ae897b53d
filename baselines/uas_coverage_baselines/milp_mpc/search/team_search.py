"""The programs of one decision, the best verified plan so far, and the work that is left."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.fallback.reasons import Reason
from uas_coverage_baselines.milp_mpc.model.appraisal import Appraisal, visits
from uas_coverage_baselines.milp_mpc.model.norm_bounds import exceeds_limits
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import NEVER, Plan, PlanningProblem
from uas_coverage_baselines.milp_mpc.model.verify import trouble_between
from uas_coverage_baselines.milp_mpc.search.restricted import (
    ALONG,
    TIGHTEST,
    Neighbourhood,
    RestrictedMilp,
)
from uas_coverage_baselines.milp_mpc.search.round_robin import RoundRobin
from uas_coverage_baselines.milp_mpc.search.trajectories import (
    PlannedTrajectory,
    as_trajectory,
    teams,
)
from uas_coverage_baselines.milp_mpc.solvers import SolverLimits, solver_named
from uas_coverage_baselines.milp_mpc.solvers.interface import (
    Solution,
    SolverError,
    Start,
)

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Effort:
    """How much work a decision may take, counted in what every machine repeats.

    Attributes:
        work: of the programs (`work_of`); with 1 it takes a quiet core about a second.
        threads: how many restricted programs are solved side by side; changes no result.
        teams: how many constructed teams are refined.
        at_once: how many UAS are planned for, at most; the others go on with what they have.
        solver: one of `SOLVERS`.
        joint: the form of the joint program; None where it is not to be solved.
        time_limit_s: wall clock at which the decision ends all the same; None for none. Where it
            strikes, flights differ from machine to machine.
    """

    work: float = 1.0
    threads: int = 2
    teams: int = 6
    at_once: int = 64
    solver: str = "highs"
    joint: str | None = TIGHTEST
    time_limit_s: float | None = None


_LATE = 0.15  # share of the time limit kept for verification and whatever is late
_WORTH_STARTING_S = 0.05  # less time than this gives no plan
_TEAMS_VERIFIED = 6
_NODES = 60
_JOINT_NODES = 1  # the root: its bound and what comes of the start
_JOINT_SHARE = 0.6  # of the work: the most that is kept for the joint program
_AT_LEAST, _AT_MOST = 1.1, 2.0  # of the work: with which it is solved, with which all ends
_WAVE = 4  # programs after which the work is counted, whatever the number of threads
# 1 is 0.85 s of a quiet core (docs/paper_program.md); the rest of a second is for all but programs
_PER_ENTRY, _PER_ITERATION_AND_ROW = 6e-7, 3.5e-8
_JOINT_DEARER = 3.0  # than its iterations say: cuts at the root, rows beyond the cache
_PROGRAMS_EACH = 2  # at least, of a UAS that is planned for


def work_of(program: RestrictedMilp, iterations: int) -> float:
    """What solving a program takes: presolve by its entries, each iteration by its rows."""
    built = program.built
    simplex = _PER_ITERATION_AND_ROW * iterations * len(built.row_lower)
    return _PER_ENTRY * len(built.column) + simplex


class TeamSearch:
    """The programs of one decision, the best verified plan so far and the time left."""

    def __init__(
        self,
        problem: PlanningProblem,
        effort: Effort,
        began: float,
        blocks: Sequence[Block] = OCP,
    ) -> None:
        self.problem, self.effort, self._began = problem, effort, began
        self._blocks, self._solve = blocks, solver_named(effort.solver)
        self._alone = [problem.only(uas) for uas in range(problem.n_uas)]
        self._appraisals = [Appraisal(alone, blocks) for alone in self._alone]
        self._together = Appraisal(problem, blocks)
        self._own: dict[int, RestrictedMilp] = {}
        self._plans: list[list[Plan]] = [[] for _ in range(problem.n_uas)]
        self._best: Plan | None = None
        self._bound = -np.inf
        self.work = 0.0  # of the programs so far
        self.programs = 0
        self._joint = 0.0  # work of the joint program, about; 0 where it is not solved
        self.cut_short = False  # whether the time limit has left out or ended a program

    def prepare(self, planned: Sequence[int]) -> None:
        """Write the own programs of the UAS that are planned for."""
        self._own = {uas: RestrictedMilp(self._alone[uas], self._blocks) for uas in planned}
        whole = self.effort.joint is not None and len(planned) == self.problem.n_uas
        if whole and not (self.problem.tours and self.problem.n_uas > 1):
            # its root takes an iteration a row, and it has about the rows of all own programs
            rows = sum(len(program.built.row_lower) for program in self._own.values())
            self._joint = _JOINT_DEARER * _PER_ITERATION_AND_ROW * rows**2

    def safe(self, uas: int, plans: Sequence[Plan]) -> list[Plan]:
        """Those of a UAS's plans that are clear of everything but the other UAS.

        Plans beyond the vehicle's limits, as braking in the middle of a manoeuvre may be, are
        among them only where all are.
        """
        clear = [plan for plan in plans if self._appraisals[uas].trouble(plan) is None]
        vehicle, bounds = self.problem.vehicles[uas], self.problem.norm_bounds[uas]
        within = [p for p in clear if not exceeds_limits(vehicle, bounds, p.x[0, 1:])]
        return within or clear

    def planned(self, round_robin: RoundRobin, urgent: Collection[int]) -> list[int]:
        """The UAS that are planned for: all of them where the work suffices.

        A program takes what one took in the last decision.
        """
        enough_for = int(self.effort.work / (_PROGRAMS_EACH * round_robin.work_of_one))
        most = min(self.problem.n_uas, self.effort.at_once, max(enough_for, 1))
        return round_robin.select(self.problem.names, urgent, most)

    def has_plan(self, uas: int) -> bool:
        """Whether a program has given the UAS a plan."""
        return bool(self._plans[uas])

    @property
    def outcome(self) -> Plan | Reason:
        """The best verified plan, with the bound proven; or why no UAS has a new one."""
        if self._best is not None and self._best.renewed:
            bound = min(self._bound, self._best.objective)
            return replace(self._best, bound=bound, cut_short=self.cut_short)
        if self._best is not None:
            return Reason.WAITING_IS_CHEAPER
        if any(self._plans):
            return Reason.NO_TEAM
        return Reason.NO_TIME if self.cut_short else Reason.NO_PLAN

    def refine(
        self,
        tasks: Sequence[tuple[int, PlannedTrajectory]],
        neighbourhood: Neighbourhood,
        side_by_side: ThreadPoolExecutor,
    ) -> None:
        """Solve each UAS's own OCP restricted to what lies near flights, in their order.

        Once the work is done but for the joint program, only for UAS without a plan.
        """
        most = _AT_MOST * self.effort.work
        share = self._joint if self._joint <= _JOINT_SHARE * self.effort.work else 0.0
        enough = self.effort.work - share
        for first in range(0, len(tasks), _WAVE):
            due = [
                (uas, flight)
                for uas, flight in tasks[first : first + _WAVE]
                if self.work < (enough if self._plans[uas] else most)
            ]
            solved = side_by_side.map(lambda t: self._refined(t[0], t[1], neighbourhood), due)
            for (uas, _), solution in zip(due, solved, strict=True):
                self._collect(uas, solution)

    def _refined(
        self, uas: int, flight: PlannedTrajectory, neighbourhood: Neighbourhood
    ) -> Solution | None:
        """A UAS's own OCP restricted to what lies near a flight; changes nothing here."""
        program = self._own[uas]
        path, visit = flight.positions_m[None], flight.visit[None]
        bounds = program.bounds_near(path, visit, neighbourhood)
        limits = SolverLimits(
            nodes=self._nodes(_NODES), relative_gap=0.01, absolute_gap=0.05, heuristics=False
        )
        return self._solved(program, limits, program.start(path, visit), bounds)

    def _collect(self, uas: int, solution: Solution | None) -> None:
        """Count a solve's work and keep its plan."""
        if solution is None:
            return
        program = self._own[uas]
        self.work += work_of(program, solution.iterations)
        self.programs += 1
        if solution.values is not None:
            self.collect(uas, [program.plan(solution)])

    def collect(self, uas: int, plans: Sequence[Plan]) -> None:
        """Keep those of the plans found for a UAS that may be flown."""
        clear = (plan for plan in plans if self._appraisals[uas].trouble(plan) is None)
        self._plans[uas].extend(clear)

    def combine(self, spare: Sequence[Sequence[Plan]]) -> None:
        """The best team of the plans found that holds as a whole.

        A UAS without one flies its fallback plan. Where none of the best teams holds, all fly
        theirs and change to plans of their own, one after the other, while the whole still holds.
        """
        if not any(self._plans):
            return
        choices = [[*plans, *others] for plans, others in zip(self._plans, spare, strict=True)]
        if not all(choices):
            return
        pools = [
            [as_trajectory(self.problem, uas, plan) for plan in plans]
            for uas, plans in enumerate(choices)
        ]
        of_trajectory = {
            id(flight): plan
            for pool, plans in zip(pools, choices, strict=True)
            for flight, plan in zip(pool, plans, strict=True)
        }
        for team in teams(self.problem, pools, keep=_TEAMS_VERIFIED):
            self._offer(self._joined([of_trajectory[id(flight)] for flight in team]))
            if self._best is not None:
                return
        if all(spare):
            self._one_after_the_other([plans[0] for plans in spare])

    def _one_after_the_other(self, team: list[Plan]) -> None:
        """From a team of fallback plans towards one of new ones, while it holds as a whole."""
        for uas, plans in enumerate(self._plans):
            for plan in sorted(plans, key=lambda one: one.objective):
                if self._fits(team, uas, plan):
                    team = [*team[:uas], plan, *team[uas + 1 :]]
                    break
        self._offer(self._joined(team))

    def _fits(self, team: Sequence[Plan], uas: int, plan: Plan) -> bool:
        """Whether a UAS's plan, clear of what stands and moves, is clear of the others' too."""
        return all(
            trouble_between(self.problem, uas, other, plan.x[0, :, :3], theirs.x[0, :, :3]) is None
            for other, theirs in enumerate(team)
            if other != uas
        )

    def _joined(self, plans: list[Plan]) -> Plan:
        """One plan of all, which says which UAS have a new one."""
        renewed = tuple(
            name
            for name, plan, own in zip(self.problem.names, plans, self._plans, strict=True)
            if any(plan is one for one in own)
        )
        joined = _joined(self.problem, plans)
        # what blocks cost that look at several UAS at once, or at what is covered by any
        coupling = self._together.price_of(joined).cost - sum(
            appraisal.price_of(plan).cost
            for appraisal, plan in zip(self._appraisals, plans, strict=True)
        )
        return replace(joined, objective=joined.objective + coupling, renewed=renewed)

    def cover(self) -> None:
        """One UAS by itself whose best plan covers nothing: near it, open to all waypoints."""
        best, problem = self._best, self.problem
        if best is None or problem.n_uas > 1 or problem.n_waypoints == 0 or best.covers.any():
            return
        if self.work < self.effort.work:
            self._collect(0, self._refined(0, as_trajectory(problem, 0, best), ALONG))
            for plan in self._plans[0]:
                self._offer(self._joined([plan]))

    def improve(self) -> None:
        """The whole OCP from the best plan so far, with the work that is left.

        In the tightest form, since its bound is what is asked for, and the only one that a plan
        gets; its root alone: what comes after takes seconds, and no limit of work ends it.
        """
        if not self._joint or self.work + self._joint > _AT_LEAST * self.effort.work:
            return
        if self.problem.n_uas == 1 and self.problem.tours:
            program = self._own[0]
        else:
            program = RestrictedMilp(self.problem, self._blocks, first=self.effort.joint)
        start = None
        if self._best is not None:
            start = program.start(self._best.x[:, :, 0:3], visits(self.problem, self._best))
        limits = SolverLimits(nodes=self._nodes(_JOINT_NODES), relative_gap=0.01, heuristics=False)
        solution = self._solved(program, limits, start)
        if solution is not None:
            self.work += _JOINT_DEARER * work_of(program, solution.iterations)
            self._bound = solution.bound
            if solution.values is not None:
                self._offer(replace(program.plan(solution), renewed=self.problem.names))

    def _solved(
        self,
        program: RestrictedMilp,
        limits: SolverLimits,
        start: Start | None,
        bounds: tuple[FloatArray, FloatArray] | None = None,
    ) -> Solution | None:
        """What the solver says; None where it fails, which ends no flight, or the time is up."""
        lower, upper = (None, None) if bounds is None else bounds
        left_s = self._time_left_s()
        if left_s < _WORTH_STARTING_S:
            self.cut_short = True
            return None
        if left_s < np.inf:
            limits = replace(limits, time_s=left_s)
        try:
            solution = self._solve(program.built, limits, start=start, lower=lower, upper=upper)
        except SolverError:
            return None
        self.cut_short |= self._time_left_s() <= 0.0
        return solution

    def _offer(self, plan: Plan) -> None:
        """Keep a plan that is better than the best and whose geometry holds."""
        if self._best is not None and plan.objective >= self._best.objective - 1e-6:
            return
        if self._together.trouble(plan) is None:
            self._best = plan

    def _nodes(self, usually: int) -> int:
        """Nodes of a program, in proportion to the effort."""
        return max(round(usually * self.effort.work), 1)

    def _time_left_s(self) -> float:
        """Until the decision's time is up, less what is kept for afterwards; inf: no limit."""
        if self.effort.time_limit_s is None:
            return np.inf
        limit_s = (1.0 - _LATE) * self.effort.time_limit_s
        return limit_s - (time.perf_counter() - self._began)


def _joined(problem: PlanningProblem, plans: Sequence[Plan]) -> Plan:
    """One plan of all; a waypoint that several cover counts for the first to get there."""
    covers = np.concatenate([plan.covers for plan in plans])
    first = np.where(covers.any(axis=1), covers.argmax(axis=1), NEVER)
    owner = first.argmin(axis=0)
    objective = sum(plan.objective for plan in plans)
    weight = np.zeros(problem.n_scenario_waypoints)
    weight[problem.waypoint_index] = problem.waypoint_weight
    for uas in range(len(plans)):
        surplus = (first[uas] < NEVER) & (owner != uas)
        objective += float((weight * np.maximum(problem.horizon - first[uas], 0))[surplus].sum())
        covers[uas][:, surplus] = False
    return Plan(
        problem.names,
        np.concatenate([plan.x for plan in plans]),
        np.concatenate([plan.u for plan in plans]),
        covers,
        objective,
        -np.inf,
    )

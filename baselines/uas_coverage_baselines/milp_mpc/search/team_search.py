"""The programs of one decision, the best verified plan so far, and the time that is left."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
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
    SolveStatus,
    Start,
)

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Effort:
    """How much work a decision may take.

    Attributes:
        time_limit_s: wall clock of the whole decision.
        threads: how many restricted programs are solved side by side.
        deterministic: limits by nodes instead of the clock, so that the same state gives the
            same plan on any machine.
        teams: how many constructed teams are refined.
        at_once: how many UAS are planned for, at most; the others go on with what they have.
        solver: one of `SOLVERS`.
        joint: the form of the joint program; None where it is not to be solved.
    """

    time_limit_s: float = 1.0
    threads: int = 2
    deterministic: bool = False
    teams: int = 6
    at_once: int = 64
    solver: str = "highs"
    joint: str | None = TIGHTEST


_RESERVE = 0.15  # share of the time limit kept for verification and whatever is late
_RESTRICTED_SHARE = 0.3  # of the time limit, for one restricted program at most
_STARTS, _POLISHES = 2, 3  # programs along a UAS's tour: around flights, then around the best
_WORTH_POLISHING = 0.05
_WORTH_STARTING_S = 0.05  # less time than this gives no first plan
_WORTHWHILE_S = 0.12  # nor this a better one
_PER_UAS_S = 0.15  # of one thread: with less for each, some UAS wait for the next decision
_PER_WRITING = 6.0  # a busy machine takes longer: what writing a program took says so
_TEAMS_VERIFIED = 6
_RESTRICTED_NODES = 60
_ALONE_NODES = 30
_JOINT_NODES = 1  # the root: its bound and what comes of the start, in about a second
_JOINT_WHOLE = 2000  # binaries: the root of a larger program takes many seconds
_JOINT_SHARE = 0.3  # of the time limit, for the joint program once each UAS has a plan


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
        self._late = False  # whether a program had no solution when its time was up
        self._own: dict[int, RestrictedMilp] = {}
        self._formulating_s = 0.0
        self._plans: list[list[Plan]] = [[] for _ in range(problem.n_uas)]
        self._best: Plan | None = None
        self._bound = -np.inf

    def prepare(self, planned: Sequence[int]) -> float:
        """Write the own programs of the UAS that are planned for; how long it took [s]."""
        before = time.perf_counter()
        self._own = {uas: RestrictedMilp(self._alone[uas], self._blocks) for uas in planned}
        self._formulating_s = time.perf_counter() - before
        return self._formulating_s

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
        """The UAS that are planned for: all of them where the time suffices."""
        most = min(self.problem.n_uas, self.effort.at_once)
        if not self.effort.deterministic:
            each_s = max(_PER_UAS_S, _PER_WRITING * round_robin.writing_s)
            most = min(most, int(self.effort.threads * self.time_left_s() / each_s))
        return round_robin.select(self.problem.names, urgent, max(most, 1))

    def has_plan(self, uas: int) -> bool:
        """Whether a program has given the UAS a plan."""
        return bool(self._plans[uas])

    @property
    def outcome(self) -> Plan | Reason:
        """The best verified plan, with the bound proven; or why no UAS has a new one."""
        if self._best is not None and self._best.renewed:
            return replace(self._best, bound=min(self._bound, self._best.objective))
        if self._best is not None:
            return Reason.WAITING_IS_CHEAPER
        if any(self._plans):
            return Reason.NO_TEAM
        return Reason.NO_TIME if self._late else Reason.NO_PLAN

    def refined(
        self,
        uas: int,
        flight: PlannedTrajectory,
        neighbourhood: Neighbourhood,
        at_most_s: float = np.inf,
    ) -> Plan | None:
        """Solve a UAS's own OCP restricted to what lies near a flight."""
        if self.joint_is_due(uas):
            return None
        if not self._has_time(_WORTH_STARTING_S):
            self._late = True
            return None
        program = self._own[uas]
        path, visit = flight.positions_m[None], flight.visit[None]
        bounds = program.bounds_near(path, visit, neighbourhood)
        start = program.start(path, visit)
        share_s = self.effort.time_limit_s * (1.0 if neighbourhood is ALONG else _RESTRICTED_SHARE)
        limits = SolverLimits(
            time_s=min(share_s, self.time_left_s(), at_most_s),
            nodes=None,
            relative_gap=0.01,
            absolute_gap=0.05,
            heuristics=False,
        )
        if self.effort.deterministic:
            limits = replace(limits, time_s=None, nodes=_RESTRICTED_NODES)
        solution = self._solved(program, limits, start, bounds)
        if solution is None or solution.values is None:
            unsolved = solution is not None and solution.status is SolveStatus.NO_SOLUTION
            self._late |= unsolved and limits.time_s is not None
            return None
        return program.plan(solution)

    def joint_is_due(self, uas: int) -> bool:
        """Whether what is left of the time is the joint program's, and the UAS has a plan."""
        everyone = len(self._own) == self.problem.n_uas > 1 and not self.problem.tours
        if not everyone or self.effort.deterministic or self.effort.joint is None:
            return False
        if not self.has_plan(uas):
            return False
        return self.time_left_s() < _JOINT_SHARE * self.effort.time_limit_s

    def polished(
        self, uas: int, tasks: Sequence[tuple[int, PlannedTrajectory]], at_most_s: float
    ) -> list[Plan]:
        """Plans of one UAS along its tour: around its flights, then around the best again.

        Restricted to the sides at which a flight passes obstacles a program takes a fraction of a
        second; around its solution other sides come near, until nothing is gained.
        """
        until = time.perf_counter() + at_most_s
        # what is left of a plan that sets off late sets off later each time it is planned anew: of
        # two flights the one that gets farther is first, since time may be up before the other's
        own = sorted(
            [flight for other, flight in tasks if other == uas][:_STARTS],
            key=lambda flight: flight.cost + flight.too_close_m,
        )
        plans: list[Plan] = []
        for _ in range(_STARTS + _POLISHES):
            left_s = until - time.perf_counter()
            enough_s = _WORTHWHILE_S if plans else _WORTH_STARTING_S
            if not self.effort.deterministic and left_s < enough_s:
                self._late |= not plans
                break
            flight = own.pop(0) if own else as_trajectory(self._alone[uas], 0, plans[0])
            plan = self.refined(uas, flight, ALONG, left_s)
            gained = plan is not None and (
                not plans or plan.objective < plans[0].objective - _WORTH_POLISHING
            )
            if plan is not None:
                plans = sorted([plan, *plans], key=lambda one: one.objective)
            if not own and not gained:
                break
        return plans

    def collect(self, uas: int, plans: Sequence[Plan | None]) -> None:
        """Keep the plans found for a UAS."""
        for plan in plans:
            if plan is not None and self._appraisals[uas].trouble(plan) is None:
                self._plans[uas].append(plan)

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

    def improve(self) -> None:
        """The whole OCP from the best plan so far, with the time that is left.

        In the tightest form, since its bound is what is asked for, and the only one that a plan
        gets. A deterministic decision solves the root, of a program that is not too large; with
        tours, that of one UAS only.
        """
        deterministic, alone = self.effort.deterministic, self.problem.n_uas == 1
        if self.effort.joint is None or len(self._own) < self.problem.n_uas:
            return
        if deterministic and self.problem.tours and not alone:
            return
        # the whole program takes about as long to write as all own programs together
        if not self._has_time(_WORTHWHILE_S + (0.0 if alone else 1.5 * self._formulating_s)):
            return
        if alone and self.problem.tours:
            program = self._own[0]
        else:
            program = RestrictedMilp(self.problem, self._blocks, first=self.effort.joint)
        if deterministic and program.built.integer.sum() > _JOINT_WHOLE:
            return
        start = None
        if self._best is not None:
            start = program.start(self._best.x[:, :, 0:3], visits(self.problem, self._best))
        limits = SolverLimits(time_s=max(self.time_left_s(), 0.01))
        if deterministic:
            nodes = _ALONE_NODES if alone else _JOINT_NODES
            limits = SolverLimits(nodes=nodes, relative_gap=0.01, heuristics=False)
        solution = self._solved(program, limits, start)
        if solution is not None:
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
        """What the solver says; None where it fails, which ends no flight."""
        lower, upper = (None, None) if bounds is None else bounds
        try:
            return self._solve(program.built, limits, start=start, lower=lower, upper=upper)
        except SolverError:
            return None

    def _offer(self, plan: Plan) -> None:
        """Keep a plan that is better than the best and whose geometry holds."""
        if self._best is not None and plan.objective >= self._best.objective - 1e-6:
            return
        if self._together.trouble(plan) is None:
            self._best = plan

    def _has_time(self, seconds: float) -> bool:
        """Whether so much is left, where the clock counts."""
        return self.effort.deterministic or self.time_left_s() >= seconds

    def time_left_s(self) -> float:
        """Until the decision's time is up, less what is kept for afterwards."""
        limit = (1.0 - _RESERVE) * self.effort.time_limit_s
        return limit - (time.perf_counter() - self._began)


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

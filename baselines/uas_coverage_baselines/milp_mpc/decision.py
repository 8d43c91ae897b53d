"""One decision: from the problem to a verified plan within the time limit.

The order of work: write the OCP; solve it restricted around what is left of the previous plan
and around the best constructed flights (small programs, each some hundredths of a second); then
the whole OCP from the best of these with the time that is left, for the bound and what it still
finds.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.blocks.separation import (
    Separation,
    binary_columns,
    from_each_other,
    from_moving_obstacles,
    from_obstacles,
)
from uas_coverage_baselines.milp_mpc.construction import NEVER, Flight, flights, teams
from uas_coverage_baselines.milp_mpc.highs import Solution, SolverLimits, solve
from uas_coverage_baselines.milp_mpc.milp import ABSENT, BuiltMilp, Milp
from uas_coverage_baselines.milp_mpc.ocp import formulate
from uas_coverage_baselines.milp_mpc.problem import Plan, PlanningProblem, Variables
from uas_coverage_baselines.milp_mpc.verify import first_trouble

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Effort:
    """How much work a decision may take.

    Attributes:
        time_limit_s: wall clock of the whole decision.
        threads: how many restricted programs are solved side by side.
        deterministic: limits by nodes instead of the clock, so that the same state gives the
            same plan on any machine.
        teams: how many constructed combinations are refined.
        earlier: steps by which a restricted MILP may cover earlier than the flight it refines.
        later: steps by which it may cover later.
        face_slack_m: faces that the flight misses by no more than this stay free.
    """

    time_limit_s: float = 1.0
    threads: int = 2
    deterministic: bool = False
    teams: int = 3
    earlier: int = 4
    later: int = 2
    face_slack_m: float = 4.0


_RESTRICTED_SHARE = 0.5  # of the time limit, for one restricted program at most
_WORTHWHILE_S = 0.1  # less time than this is not worth starting a solve
_RESTRICTED_NODES = 60
_JOINT_NODES = 1


def decide(
    problem: PlanningProblem, previous: Plan | None, dt_s: float, effort: Effort
) -> Plan | None:
    """The best plan found, verified by our own arithmetic; None without any.

    Args:
        problem: the decision to make.
        previous: what is left of the last plan, beginning now.
        dt_s: sampling time.
        effort: how much work it may take.
    """
    search = _Search(problem, dt_s, effort)
    tried = [] if previous is None else [left_over_flights(problem, previous, dt_s)]
    with ThreadPoolExecutor(effort.threads) as side_by_side:  # the solver frees the interpreter
        pools = list(side_by_side.map(lambda u: flights(problem, u, dt_s), range(problem.n_uas)))
        tried += teams(problem, pools, effort.teams)
        for solution in side_by_side.map(search.refined, tried):
            search.offer(solution)
    search.improve()
    return search.plan


class _Search:
    """The OCP of one decision, the best verified solution so far and the time left."""

    def __init__(self, problem: PlanningProblem, dt_s: float, effort: Effort) -> None:
        self.problem, self.dt_s, self.effort = problem, dt_s, effort
        self._began = time.perf_counter()
        self.milp, self.variables = formulate(problem)
        self.built = self.milp.build()
        self._separations = list(
            chain(from_obstacles(problem), from_moving_obstacles(problem), from_each_other(problem))
        )
        self._best: Plan | None = None
        self._best_values: FloatArray | None = None
        self._bound = -np.inf

    @property
    def plan(self) -> Plan | None:
        """The best verified plan, with the bound that was proven."""
        if self._best is None:
            return None
        return replace(self._best, bound=min(self._bound, self._best.objective))

    def _time_left_s(self) -> float:
        return self.effort.time_limit_s - (time.perf_counter() - self._began)

    def refined(self, team: Sequence[Flight]) -> Solution | None:
        """Solve the OCP restricted to what the team's flights cover, and when."""
        left = self._time_left_s()
        if not self.effort.deterministic and left < _WORTHWHILE_S:
            return None
        lower, upper = restricted_bounds(
            self.problem, self.milp, self.variables, self.built, self._separations, team,
            self.effort,
        )  # fmt: skip
        share = min(_RESTRICTED_SHARE * self.effort.time_limit_s, left)
        limits = SolverLimits(
            time_s=None if self.effort.deterministic else share,
            nodes=_RESTRICTED_NODES if self.effort.deterministic else None,
            relative_gap=0.01,
            absolute_gap=0.05,
            heuristics=False,
        )
        return solve(self.built, limits, lower=lower, upper=upper)

    def improve(self) -> None:
        """The whole OCP from the best plan so far."""
        left = self._time_left_s()
        if not self.effort.deterministic and left < _WORTHWHILE_S:
            return
        start = None
        if self._best_values is not None:
            columns = np.flatnonzero(self.built.integer)
            start = (columns, self._best_values[columns])
        limits = SolverLimits(
            time_s=None if self.effort.deterministic else 0.95 * left,
            nodes=_JOINT_NODES if self.effort.deterministic else None,
        )
        solution = solve(self.built, limits, start=start)
        self._bound = solution.bound
        self.offer(solution)

    def offer(self, solution: Solution | None) -> None:
        """Keep a solution that is better than the best and whose geometry holds."""
        best = np.inf if self._best is None else self._best.objective
        if solution is None or solution.values is None or solution.objective >= best - 1e-6:
            return
        plan = read_plan(self.problem, self.variables, solution.values, solution.objective)
        if first_trouble(self.problem, plan) is None:
            self._best, self._best_values = plan, solution.values


def left_over_flights(problem: PlanningProblem, left: Plan, dt_s: float) -> list[Flight]:
    """What is left of the previous plan as flights; beyond its end at constant velocity."""
    result = []
    for row, name in enumerate(problem.names):
        path = problem.x0[row, None, :3]
        velocity = np.zeros(3)
        visit = np.full(problem.n_waypoints, NEVER, np.int64)
        if name in left.names:
            old = left.of(name)
            path, velocity = left.x[old, :, 0:3], left.x[old, -1, 3:6]
            for w, index in enumerate(problem.waypoint_index):
                steps = np.flatnonzero(left.covers[old, :, index])
                if len(steps):
                    visit[w] = steps[0]
        beyond = np.arange(1, problem.horizon + 2 - len(path))[:, None]
        result.append(
            Flight(np.vstack([path, path[-1] + 0.5 * dt_s * velocity * beyond]), visit, 0.0, 0.0)
        )
    return result


def restricted_bounds(
    problem: PlanningProblem,
    milp: Milp,
    v: Variables,
    built: BuiltMilp,
    separations: Sequence[Separation],
    team: Sequence[Flight],
    effort: Effort,
) -> tuple[FloatArray, FloatArray]:
    """Column bounds that leave free only what lies near the team's flights.

    Each waypoint may be covered by the UAS whose flight covers it first, within a window around
    that step; each shape may be passed along the faces that the flight passes, or nearly passes.
    """
    lower, upper = built.lower.copy(), built.upper.copy()
    visits = np.array([flight.visit for flight in team])
    if problem.n_waypoints:
        steps = np.arange(problem.horizon)
        own = (visits == visits.min(axis=0)) & (visits < NEVER)
        own &= np.cumsum(own, axis=0) == 1
        early = steps[None, :, None] >= visits[:, None, :] - effort.earlier
        late = steps[None, :, None] <= visits[:, None, :] + effort.later
        allowed = own[:, None, :] & early & late
        shut = v.covers[~allowed]
        upper[shut[shut != ABSENT]] = 0.0
    paths = np.array([flight.positions_m for flight in team])
    for separation in separations:
        columns = binary_columns(milp, separation)
        if columns is None:
            continue
        relaxed, crossed = columns
        position = paths[separation.mover]
        if separation.partner is not None:
            position = position - paths[separation.partner]
        spare = position @ separation.normals.T + separation.offset_m
        spare = spare - separation.clearance_m[:, None, :]
        spare[:, 0] = np.where(separation.always[:, 0], np.inf, -np.inf)
        over_interval = np.minimum(spare[:, :-1], spare[:, 1:])
        over_interval[separation.never[:, :-1] | separation.never[:, 1:]] = -np.inf
        best = over_interval.max(axis=2, keepdims=True)
        ample = best >= effort.face_slack_m
        near = np.where(ample, over_interval == best, over_interval >= best - effort.face_slack_m)
        near &= over_interval > -np.inf
        some = near.any(axis=2, keepdims=True)
        shut = crossed[~near & some]
        lower[shut[shut != ABSENT]] = 1.0
        used = np.zeros(spare.shape, bool)
        used[:, :-1] |= near | ~some
        used[:, 1:] |= near | ~some
        shut = relaxed[~used]
        lower[shut[shut != ABSENT]] = 1.0
    return lower, upper


def read_plan(problem: PlanningProblem, v: Variables, values: FloatArray, objective: float) -> Plan:
    """Column values back into trajectories."""
    covers = np.zeros((problem.n_uas, problem.horizon, problem.n_scenario_waypoints), bool)
    chosen = np.where(v.covers != ABSENT, values[v.covers], 0.0) > 0.5
    covers[:, :, problem.waypoint_index] = chosen
    return Plan(problem.names, values[v.x], values[v.u], covers, objective, -np.inf)

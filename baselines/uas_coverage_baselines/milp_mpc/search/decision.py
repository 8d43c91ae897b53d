"""One decision: from the problem to a verified plan, within an amount of work.

UAS couple only where they may cover the same waypoint or come close. So each UAS's own OCP is
solved first, restricted to the neighbourhood of a trajectory: what is left of its previous plan,
and the constructed trajectories that make the best teams (programs of some hundredths of a second,
solved side by side). A UAS without a plan then gets wider programs, and after these a plan that
needs no solver (`fallback.plans`). The best team of the plans found is checked as a whole; then the
root of the whole OCP starts from it with the work that is left, a share of which is kept for it,
for the bound. One UAS by itself whose plan covers nothing gets another program first.

Work is counted in what every machine repeats (nodes, simplex iterations, sizes of programs), and in
an order that does not depend on threads, so that a decision is the same on every machine. A time
limit is a cap that is off by default.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.fallback.plans import fallback_plans
from uas_coverage_baselines.milp_mpc.fallback.reasons import Reason
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem
from uas_coverage_baselines.milp_mpc.search.heuristic import construct
from uas_coverage_baselines.milp_mpc.search.restricted import ALONG, NARROW, WIDE
from uas_coverage_baselines.milp_mpc.search.round_robin import RoundRobin
from uas_coverage_baselines.milp_mpc.search.team_search import Effort, TeamSearch
from uas_coverage_baselines.milp_mpc.search.trajectories import (
    PlannedTrajectory,
    as_trajectory,
    left_over,
    teams,
)

FloatArray = NDArray[np.float64]


def decide(
    problem: PlanningProblem,
    previous: Plan | None,
    dt_s: float,
    effort: Effort,
    *,
    backup: Plan | None = None,
    began: float | None = None,
    round_robin: RoundRobin | None = None,
    blocks: Sequence[Block] = OCP,
) -> Plan | Reason:
    """The best plan found, verified by our own arithmetic; or why no UAS has a new one.

    Args:
        problem: the decision to make.
        previous: what is left of the last plan, beginning now.
        dt_s: sampling time.
        effort: how much work it may take.
        backup: what is left of the last backup trajectory, beginning now.
        began: `time.perf_counter()` at which the decision's time began to count; now where None.
        round_robin: which UAS was planned for when; where None none has been.
        blocks: of the OCP.
    """
    search = TeamSearch(problem, effort, time.perf_counter() if began is None else began, blocks)
    swarm = range(problem.n_uas)
    left = [fallback_plans(problem, uas, backup, dt_s, blocks) for uas in swarm]
    spare = [search.safe(uas, plans) for uas, plans in enumerate(left)]
    goes_on = [len(left[uas]) > 1 and any(p is left[uas][0] for p in spare[uas]) for uas in swarm]
    round_robin = RoundRobin() if round_robin is None else round_robin
    planned = search.planned(round_robin, [uas for uas in swarm if not goes_on[uas]])
    with ThreadPoolExecutor(effort.threads) as side_by_side:  # kernels and solver free the GIL
        constructing = {
            uas: side_by_side.submit(construct, problem, uas, dt_s, blocks=blocks)
            for uas in planned
        }
        search.prepare(planned)
        pools = [
            constructing[uas].result()
            if uas in planned
            else [as_trajectory(problem, uas, left[uas][0])]
            for uas in swarm
        ]
        candidates: list[Sequence[PlannedTrajectory]] = list(teams(problem, pools, effort.teams))
        if previous is not None:
            candidates.insert(0, left_over(problem, previous, dt_s, blocks))
        tasks = [task for task in _unique_tasks(candidates) if task[0] in planned]
        search.refine(tasks, ALONG if problem.tours else NARROW, side_by_side)
        resorts = [
            task
            for uas in planned
            if not search.has_plan(uas)
            for task in _last_resorts(problem, uas, tasks, left[uas])
        ]
        search.refine(resorts, WIDE, side_by_side)
    if search.programs:
        round_robin.work_of_one = search.work / search.programs
    search.combine(spare)
    search.cover()
    search.improve()
    return search.outcome


_RESORTS = 2  # trajectories of a UAS without a plan that are refined again, more widely


def _last_resorts(
    problem: PlanningProblem,
    uas: int,
    tasks: Sequence[tuple[int, PlannedTrajectory]],
    spare: Sequence[Plan],
) -> list[tuple[int, PlannedTrajectory]]:
    """Where to look more widely for a UAS without a plan: its best trajectories, stopping."""
    own = [task for task in tasks if task[0] == uas][:_RESORTS]
    return own + [(uas, as_trajectory(problem, uas, plan)) for plan in spare[-1:]]


def _unique_tasks(
    candidates: Sequence[Sequence[PlannedTrajectory]],
) -> list[tuple[int, PlannedTrajectory]]:
    """(UAS, trajectory) pairs to refine, the most promising first, none twice."""
    tasks, seen = [], set()
    for team in candidates:
        for uas, flight in enumerate(team):
            key = (uas, flight.visit.tobytes(), flight.positions_m.tobytes())
            if key not in seen:
                seen.add(key)
                tasks.append((uas, flight))
    return tasks

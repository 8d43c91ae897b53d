"""Trajectories that a decision starts from, and the teams they make.

They come from construction (`heuristic`), from what is left of the previous plan, and from plans.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.appraisal import Appraisal, gains, visits
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import NEVER, Plan, PlanningProblem, Trajectories
from uas_coverage_env.vehicle.layout import VX, VZ

FloatArray = NDArray[np.float64]
_PER_METRE = 1e-4  # of two that gain the same the shorter one; a waypoint's step is worth 1


@dataclass(frozen=True)
class PlannedTrajectory:
    """One UAS's simulated flight over the horizon.

    Attributes:
        positions_m: (N+1, 3).
        visit: (W,) first step at which each waypoint of the problem is covered, `NEVER` if not.
        cost: its part of the objective besides coverage, as far as it is known.
        too_close_m: how deep it enters keep-out zones, summed over samples; 0 where clear. Rows
            of other blocks that it breaks are counted likewise.
    """

    positions_m: FloatArray
    visit: NDArray[np.int64]
    cost: float
    too_close_m: float

    @property
    def length_m(self) -> float:
        """Length of its path."""
        return float(np.linalg.norm(np.diff(self.positions_m, axis=0), axis=1).sum())


def as_trajectory(problem: PlanningProblem, uas: int, plan: Plan) -> PlannedTrajectory:
    """A UAS's own plan as a flight: what it covers when, and what it costs besides."""
    visit = visits(problem, plan)[0]
    gained = float(gains(problem, visit).sum())
    return PlannedTrajectory(plan.x[0, :, 0:3], visit, plan.objective + gained, 0.0)


def left_over(
    problem: PlanningProblem, left: Plan, dt_s: float, blocks: Sequence[Block] = OCP
) -> list[PlannedTrajectory]:
    """What is left of the previous plan as flights; beyond its end at falling velocity."""
    appraisal, result = Appraisal(problem, blocks), []
    for row, name in enumerate(problem.names):
        path = problem.x0[row, None, :3]
        velocity = np.zeros(3)
        visit = np.full(problem.n_waypoints, NEVER, np.int64)
        if name in left.names:
            old = left.of(name)
            path, velocity = left.x[old, : problem.horizon + 1, 0:3], left.x[old, -1, VX : VZ + 1]
            covers = left.covers[old][:, problem.waypoint_index]
            visit = np.where(covers.any(axis=0), covers.argmax(axis=0), NEVER)
        beyond = np.arange(1, problem.horizon + 2 - len(path))[:, None]
        path = np.vstack([path, path[-1] + 0.5 * dt_s * velocity * beyond])
        cost = float(appraisal.costs(row, Trajectories(path[None], visit[None]))[0])
        (price,) = appraisal.prices_of_paths(row, [(path, visit)])
        result.append(PlannedTrajectory(path, visit, cost + price.cost, price.excess))
    return result


def teams(
    problem: PlanningProblem, pools: Sequence[Sequence[PlannedTrajectory]], keep: int
) -> list[tuple[PlannedTrajectory, ...]]:
    """Good combinations of one flight per UAS, best first.

    A waypoint counts once, for the UAS that gets there first; flights that come too close to each
    other are charged, and each metre a little: a UAS that gains nothing more flies no detour to a
    waypoint that another one takes. Coordinate ascent from each UAS's leading flights.
    """
    rewards = [np.array([gains(problem, f.visit[None])[0] for f in pool]) for pool in pools]
    costs = [
        np.array([f.cost + f.too_close_m + _PER_METRE * f.length_m for f in pool]) for pool in pools
    ]
    clashes = _clashes(problem, pools)
    undecided = [uas for uas, pool in enumerate(pools) if len(pool) > 1]
    found: dict[tuple[int, ...], float] = {}
    for leader in undecided or [0]:
        for first in range(min(keep, len(pools[leader]))):
            chosen = [0] * len(pools)
            chosen[leader] = first
            for _ in range(4):
                before = list(chosen)
                for uas in undecided:
                    if uas == leader:
                        continue
                    others = [rewards[j][chosen[j]] for j in range(len(pools)) if j != uas]
                    covered = np.max(others, axis=0) if others else 0.0
                    gain = np.maximum(rewards[uas] - covered, 0.0).sum(axis=1) - costs[uas]
                    for j, clash in clashes[uas].items():
                        gain = gain - clash[:, chosen[j]]
                    chosen[uas] = int(np.argmax(gain))
                if chosen == before:
                    break
            together = np.max([rewards[j][chosen[j]] for j in range(len(pools))], axis=0).sum()
            together -= sum(costs[j][chosen[j]] for j in range(len(pools)))
            together -= sum(
                clash[chosen[j], chosen[k]]
                for j in range(len(pools))
                for k, clash in clashes[j].items()
                if k < j
            )
            found[tuple(chosen)] = float(together)
    ranked = sorted(found, key=lambda key: -found[key])
    return [tuple(pools[j][row] for j, row in enumerate(key)) for key in ranked[:keep]]


def _clashes(
    problem: PlanningProblem, pools: Sequence[Sequence[PlannedTrajectory]]
) -> list[dict[int, FloatArray]]:
    """[j][k] (flights of j, flights of k) how deep they come too close, summed over samples.

    Only where any two flights of j and k do.
    """
    paths = [np.array([f.positions_m[1:] for f in pool]) for pool in pools]
    low = np.array([path.min(axis=(0, 1)) for path in paths])
    high = np.array([path.max(axis=(0, 1)) for path in paths])
    apart_m = np.maximum(low[:, None] - high, low - high[:, None]).max(axis=2)
    result: list[dict[int, FloatArray]] = [{} for _ in pools]
    for j, k in np.argwhere(np.triu(apart_m < problem.separation_m, 1)):
        apart = np.abs(paths[j][:, None] - paths[k][None])
        distance = np.maximum(np.hypot(apart[..., 0], apart[..., 1]), apart[..., 2])
        short = np.maximum(problem.separation_m[j, k] - distance, 0.0)
        clash = 10.0 * short.sum(axis=2)
        if clash.any():
            result[int(j)][int(k)], result[int(k)][int(j)] = clash, clash.T
    return result

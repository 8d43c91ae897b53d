"""UAS that take no commands: what a decision knows of them is where they are and how they move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.problem import MovingHull, PlanningProblem
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.vehicle.layout import VX, VZ
from uas_coverage_env.world import SwarmState


class SilentUas:
    """Moving obstacles in place of UAS that take no commands.

    Args:
        brief: The mission.
        margin_m: Kept in addition to the separation, since they may turn.
    """

    def __init__(self, brief: MissionBrief, margin_m: float) -> None:
        self._dt_s = brief.dt_s
        self._radius_m = {uas.name: uas.radius_m for uas in brief.uas}
        self._keep_m = brief.uas_safe_distance_m + margin_m

    def beside(
        self, problem: PlanningProblem, swarm: SwarmState, silent: NDArray[np.bool_]
    ) -> PlanningProblem:
        """The decision with those UAS as points that go on as they go now.

        Args:
            problem: Of the other UAS.
            swarm: What is seen of all.
            silent: (U,) those that take no commands.
        """
        if not silent.any():
            return problem
        clock_s = self._dt_s * np.arange(problem.horizon + 1)[:, None]
        own_m = np.array([self._radius_m[name] for name in problem.names])
        hulls, clearance_m = [], [problem.moving_clearance_m]
        for u in np.flatnonzero(silent):
            name, x = swarm.names[u], swarm.x[u]
            hulls.append(MovingHull(name, x[:3] + clock_s * x[VX : VZ + 1], 0.0, 0.0))
            clearance_m.append((own_m + self._radius_m[name] + self._keep_m)[:, None])
        return replace(
            problem,
            moving=(*problem.moving, *hulls),
            moving_clearance_m=np.hstack(clearance_m),
        )

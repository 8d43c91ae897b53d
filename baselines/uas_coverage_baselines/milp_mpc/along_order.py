"""Decisions along a global order of the waypoints: the option `order=search` of `milp-mpc`.

What the paper's planner loses, it loses in the order of the waypoints. Here the order of the whole
swarm is searched apart (`planning.routing`) and given to the OCP as a terminal cost, the time still
to go along one's own order, and as the few waypoints that get binaries.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem, Target, TourSegment
from uas_coverage_baselines.milp_mpc.options import OcpOptions
from uas_coverage_baselines.milp_mpc.problem_builder import ProblemBuilder
from uas_coverage_baselines.milp_mpc.route_guide import RouteGuide, TourShape
from uas_coverage_env.entities.commands import HOME, Mode
from uas_coverage_env.mission import MissionBrief, Ways, first_sight
from uas_coverage_env.vehicle.layout import VX, VY
from uas_coverage_env.world import SwarmState

_HOMING_PER_M = 0.1  # cost of a metre from home for one step, once nothing is left to visit
_EARLY_S = 0.05  # worth of covering a waypoint a step earlier, in seconds of flight


class AlongOrder:
    """What `ModeProblems` is, with the targets of a searched order in place of operation modes.

    Args:
        brief: the mission.
        options: of the planner.
        seed: of the search, which begins here, before take-off.
    """

    def __init__(self, brief: MissionBrief, options: OcpOptions, seed: int) -> None:
        self._weights = options.weights
        self._builder = ProblemBuilder(brief, options, Ways(brief))
        self._guide = RouteGuide(brief, self._builder, TourShape())
        self._guide.begin(first_sight(brief), seed)
        self._returning: set[str] = set()
        self._next: dict[str, int] = {}

    def mode(self, name: str) -> Mode:
        """Covering while a UAS has anything left to visit."""
        return "return" if name in self._returning else "covering"

    def target(self, name: str) -> int | None:
        """The next waypoint of its order, or home."""
        return self._next.get(name)

    @property
    def blocked(self) -> set[int]:
        """Waypoints that the order postpones while moving obstacles block them."""
        return self._guide.blocked

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that the order leaves out."""
        order = self._guide.order
        left_out = [] if order is None else order.left_out.tolist()
        return dict.fromkeys(left_out, "its order leaves it out")

    def problem(self, swarm: SwarmState, plan: Plan | None) -> PlanningProblem:
        """The OCP along the order of each UAS; the last plan changes nothing.

        Args:
            swarm: what is seen.
            plan: what is left of the last plan.
        """
        self._guide.update(swarm)
        ahead = self._guide.tours(swarm.active)
        index = np.concatenate(ahead).astype(np.int64)
        problem = self._builder.seen(swarm, self._weights, index, np.full(len(index), _EARLY_S))
        rows = np.split(np.arange(len(index)), np.cumsum([len(a) for a in ahead])[:-1])
        self._next = {
            name: int(a[0]) if len(a) else HOME for name, a in zip(swarm.active, ahead, strict=True)
        }
        straight = [
            self._guide.tour(name, row) for name, row in zip(swarm.active, rows, strict=True)
        ]
        tours, targets = zip(
            *(self._led_round(swarm, n, t) for n, t in zip(swarm.active, straight, strict=True)),
            strict=True,
        )
        self._returning = {n for n, t in zip(swarm.active, straight, strict=True) if t is None}
        return replace(problem, tours=tours, targets=targets)

    def _led_round(
        self, swarm: SwarmState, name: str, tour: TourSegment | None
    ) -> tuple[TourSegment | None, Target | None]:
        """The tour of a UAS, or the way home of one without; by a corner where they are shaded."""
        x = swarm.x[swarm.names.index(name)]
        speed_mps = float(np.hypot(x[VX], x[VY]))
        way = self._builder.way(name, self._next[name], x[:3], speed_mps)
        aim_m = self._builder.home_m[name]
        if way is not None:
            aim_m = self._builder.aim_m(name, x[:3], way)
        # at the end of the horizon alone a place within it may be reached as late as one likes
        if tour is None or (way is not None and way.tight):
            return None, Target(aim_m, _HOMING_PER_M)
        if way is None:
            return tour, None
        aims, radius, onward = tour.aims_m.copy(), tour.radius_m.copy(), tour.onward_s.copy()
        aims[0], radius[0] = aim_m, 0.0
        onward[0] += way.onward_s
        return replace(tour, aims_m=aims, radius_m=radius, onward_s=onward), None

"""What the planners in real time fly in a stated wind: their order, under the world's guidance.

A plan is a sequence of wrenches, computed in still air; in a wind each step ends elsewhere, and the
limits of the vehicle are exceeded. The inner loop knows what pushes the UAS, and guidance flies by
it. The order is the one of `order=search`, searched on at every decision.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from uas_coverage_baselines.milp_mpc.options import MovingHorizonOptions
from uas_coverage_baselines.milp_mpc.problem_builder import ProblemBuilder
from uas_coverage_baselines.milp_mpc.route_guide import RouteGuide, TourShape
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.planning.following import Following
from uas_coverage_env.world import Command, SwarmState


class Steering:
    """Sends each UAS along its route by the world's guidance; no program is solved.

    Args:
        brief: the mission.
        options: of the planner.
        seed: of the first search.
    """

    def __init__(self, brief: MissionBrief, options: MovingHorizonOptions, seed: int) -> None:
        builder = ProblemBuilder(brief, options)
        self._guide = RouteGuide(brief, builder, TourShape())
        self._guide.begin(first_sight(brief), seed)
        self._following = Following(brief, calls_home=False)

    def commands(self, swarm: SwarmState) -> Mapping[str, Command]:
        """A command for each UAS that flies and takes commands."""
        seen = self._following.update(swarm)
        self._guide.update(replace(swarm, uncovered=seen.wanted))
        ahead = dict(zip(swarm.active, self._guide.tours(swarm.active), strict=True))
        targets = {name: int(route[0]) for name, route in ahead.items() if len(route)}
        blocked = np.zeros(len(swarm.uncovered), np.bool_)
        blocked[list(self._guide.blocked)] = True
        return self._following.towards(replace(seen, blocked=blocked), targets)

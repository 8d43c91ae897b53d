"""What the planners in real time fly in a stated wind: an order, under the world's guidance.

A plan is a sequence of wrenches, computed in still air; in a wind each step ends elsewhere, and the
limits of the vehicle are exceeded. The inner loop knows what pushes the UAS, and guidance flies by
it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.following import Following, SearchedOrder, Seen
from uas_coverage_env.planning.following.searched_order import SearchedAgain
from uas_coverage_env.planning.reserves import ORDER_GUIDE
from uas_coverage_env.planning.routing import RoutingProblem, SearchEffort, empty_routes
from uas_coverage_env.planning.routing.legs import Legs

_MOVES = 1_000_000
_AGAIN_S = 10.0  # so often the order is searched anew: flights take as long as they take


def along_order(brief: MissionBrief, seed: int) -> Following:
    """Each UAS along its route by the world's guidance; no program is solved.

    Args:
        brief: The mission.
        seed: Of the searches.
    """
    legs = Legs(brief)

    def problem(seen: Seen, visited: NDArray[np.bool_]) -> RoutingProblem:
        swarm = replace(seen.swarm, uncovered=visited)
        return RoutingProblem.seen(brief, swarm, legs, seen.works, ORDER_GUIDE)

    again = SearchedAgain(SearchEffort(_MOVES), max(round(_AGAIN_S / brief.dt_s), 1), seed)
    order = SearchedOrder(problem, empty_routes(len(brief.uas)), again)
    return Following(brief, order, calls_home=False)

"""The beginning of an order as a problem of its own: what comes much later is not searched again.

Evaluating a route takes as long as it is, so that searching at every decision would cost the more
the larger the mission. The order of what comes later was searched before take-off; here it stays as
it is, and the routes' first waypoints are ordered towards it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.planning.routing.problem import RoutingProblem
from uas_coverage_env.planning.routing.search import Routes


@dataclass(frozen=True)
class RouteWindow:
    """The first waypoints of every route, each UAS's home being what follows them.

    Attributes:
        problem: the routing problem of these waypoints alone.
        order: their order.
        rests: (U) what follows in each route.
        aside: left out of the whole order, and far from these waypoints.
    """

    problem: RoutingProblem
    order: Routes
    rests: tuple[NDArray[np.int64], ...]
    aside: NDArray[np.int64]

    @classmethod
    def of(cls, problem: RoutingProblem, order: Routes, most: int) -> RouteWindow:
        """The first `most` waypoints of each route of an order."""
        rests = tuple(route[most:] for route in order.routes)
        if not any(map(len, rests)):
            return cls(problem, order, rests, order.left_out[:0])
        first = tuple(route[:most] for route in order.routes)
        home_s, uas = problem.home_s.copy(), problem.uas.copy()
        for u, rest in enumerate(rests):
            if len(rest):
                between = problem.between_s[uas["kind"][u]]
                rest_s = between[rest[:-1], rest[1:]].sum() + problem.home_s[u, rest[-1]]
                home_s[u] = between[:, rest[0]] + rest_s
                uas["idle_s"][u] = problem.first_s[u, rest[0]] + rest_s
                uas["home_m"][u] = problem.waypoints_m[rest[0], :2]
        near = np.isin(order.left_out, problem.neighbours[np.concatenate(first)])
        left_out = order.left_out[near]
        open_waypoints = np.concatenate([*first, left_out])
        part = problem.replace(open_waypoints=open_waypoints, home_s=home_s, uas=uas)
        return cls(
            part, replace(order, routes=first, left_out=left_out), rests, order.left_out[~near]
        )

    def joined(self, order: Routes) -> Routes:
        """The whole order again, with the beginnings as `order` has them."""
        routes = zip(order.routes, self.rests, strict=True)
        return replace(
            order,
            routes=tuple(np.concatenate(parts) for parts in routes),
            left_out=np.concatenate([order.left_out, self.aside]),
        )

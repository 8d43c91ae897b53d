"""The beginning of an order as a task of its own: what comes much later need not be searched again.

Evaluating a route takes as long as it is, so that searching at every decision would cost the more
the larger the mission. The order of what comes later was searched before take-off; here it stays as
it is, and the routes' first waypoints are ordered towards it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.planning.routing.search import Routes
from uas_coverage_env.planning.routing.task import RoutingTask


@dataclass(frozen=True)
class RouteWindow:
    """The first waypoints of every route, each UAS's home being what follows them.

    Attributes:
        task: the routing problem of these waypoints alone.
        order: their order.
        rests: (U) what follows in each route.
        aside: left out of the whole order, and far from these waypoints.
    """

    task: RoutingTask
    order: Routes
    rests: tuple[NDArray[np.int64], ...]
    aside: NDArray[np.int64]

    @classmethod
    def of(cls, task: RoutingTask, order: Routes, most: int) -> RouteWindow:
        """The first `most` waypoints of each route of an order."""
        rests = tuple(route[most:] for route in order.routes)
        if not any(map(len, rests)):
            return cls(task, order, rests, order.left_out[:0])
        first = tuple(route[:most] for route in order.routes)
        home_s, idle_s, start_m = task.home_s.copy(), task.idle_s.copy(), task.start_m.copy()
        for uas, rest in enumerate(rests):
            if len(rest):
                between = task.between_s[task.kind[uas]]
                rest_s = between[rest[:-1], rest[1:]].sum() + task.home_s[uas, rest[-1]]
                home_s[uas] = between[:, rest[0]] + rest_s
                idle_s[uas] = task.first_s[uas, rest[0]] + rest_s
                start_m[uas] = task.waypoints_m[rest[0], :2]
        near = np.isin(order.left_out, task.neighbours[np.concatenate(first)])
        left_out = order.left_out[near]
        part = replace(
            task,
            open_waypoints=np.concatenate([*first, left_out]),
            home_s=home_s,
            idle_s=idle_s,
            start_m=start_m,
        )
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

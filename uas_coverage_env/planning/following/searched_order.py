"""An order that is searched again when something happens."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.planning.following.following import Seen
from uas_coverage_env.planning.routing import (
    Routes,
    RoutingProblem,
    SearchEffort,
    improve_routes,
)

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

_WORTH_CHANGING_S = 2.0


@dataclass(frozen=True)
class SearchedAgain:
    """How an order is searched once it is flown.

    Attributes:
        effort: Of each search.
        every_steps: So often without an event; 0: on events alone.
        seed: Of the searches.
    """

    effort: SearchEffort
    every_steps: int
    seed: int


class SearchedOrder:
    """The cheapest order known for what is left of a mission.

    What is covered is left out of it at every sample. It is searched again where a UAS is back, or
    a waypoint is on no route, as those of a UAS that has dropped out are and one that opens; and
    every so many steps, since flights take as long as they take. What is blocked waits until
    nothing else is left.

    Args:
        problem_of: The routing problem of what is seen, and of the waypoints (W,) to visit.
        order: From which to go on.
        again: How.
    """

    def __init__(
        self,
        problem_of: Callable[[Seen, BoolArray], RoutingProblem],
        order: Routes,
        again: SearchedAgain,
    ) -> None:
        self._problem_of, self.order, self._again = problem_of, order, again
        self._worked: BoolArray | None = None
        self._made_at = -1

    def routes(self, seen: Seen) -> tuple[IntArray, ...]:
        """(U,) what each UAS still has to visit."""
        free = seen.wanted & ~seen.blocked
        visited = free if free.any() else seen.wanted
        self._drop(visited, seen.works)
        if self._is_due(seen, visited):
            self._search(seen, visited)
        return self.order.routes

    def _drop(self, visited: BoolArray, works: BoolArray) -> None:
        self.order = replace(
            self.order,
            routes=tuple(
                route[visited[route]] if works[u] else route[:0]
                for u, route in enumerate(self.order.routes)
            ),
            left_out=self.order.left_out[visited[self.order.left_out]],
        )

    def _is_due(self, seen: Seen, visited: BoolArray) -> bool:
        every, since = self._again.every_steps, seen.swarm.step - self._made_at
        known = np.zeros(len(visited), np.bool_)
        known[np.concatenate([*self.order.routes, self.order.left_out])] = True
        is_back = self._worked is not None and bool((seen.works & ~self._worked).any())
        self._worked = seen.works
        happened = is_back or bool((visited & ~known).any())
        return bool(visited.any()) and (happened or (every > 0 and since >= every))

    def _search(self, seen: Seen, visited: BoolArray) -> None:
        problem, again = self._problem_of(seen, visited), self._again
        kept = improve_routes(problem, self.order, replace(again.effort, moves=0), 0)
        better = improve_routes(problem, kept, again.effort, again.seed + seen.swarm.step)
        self.order = better if better.cost_s < kept.cost_s - _WORTH_CHANGING_S else kept
        self._made_at = seen.swarm.step

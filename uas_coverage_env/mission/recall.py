"""Which UAS have to fly home, for planners that bring them home themselves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.autopilot.return_mode import has_to_return
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.mission.views import WorldView
from uas_coverage_env.world import SwarmState

BoolArray = NDArray[np.bool_]


class Recall:
    """The rule of return mode, which need not be on: a UAS that it calls lands first.

    Where return mode is on, it may also call for as long as a gust blows, which only the world
    knows of.

    Args:
        n_uas: Size of the fleet.
    """

    def __init__(self, n_uas: int) -> None:
        self._called = np.zeros(n_uas, np.bool_)

    def update(self, swarm: SwarmState, view: WorldView) -> BoolArray:
        """(U,) which UAS fly, and have to fly home; to be called once per sample.

        Args:
            swarm: What is seen.
            view: The same, updated.
        """
        flies = swarm.status == FLYING
        self._called &= flies
        for u in np.flatnonzero(flies & ~self._called).tolist():
            self._called[u] = has_to_return(view.arena, view.state, u)
        return self._called | (swarm.returning & flies)

    def keep(self, called: BoolArray) -> None:
        """Forget others: what called them home no longer holds, as where there is more to cover.

        Args:
            called: (U,) of these it may hold.
        """
        self._called &= called

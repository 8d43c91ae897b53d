"""Which UAS have to fly home, for planners that bring them home themselves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.autopilot import has_to_return, needs_all_for_home
from uas_coverage_env.mission.learnt_wind import LearntWind, in_disturbances
from uas_coverage_env.mission.views import WorldView
from uas_coverage_env.world import FLYING, SwarmState

BoolArray = NDArray[np.bool_]


class Recall:
    """The rule of return mode, which need not be on: a UAS that it calls lands first.

    Where return mode is on, it may also call for as long as a gust blows, which only the world
    knows of.

    Args:
        n_uas: Size of the fleet.
    """

    def __init__(self, n_uas: int) -> None:
        self._called, self._called_in_wind = np.zeros(n_uas, np.bool_), np.zeros(n_uas, np.bool_)

    def update(
        self, swarm: SwarmState, view: WorldView, learnt: LearntWind | None = None
    ) -> BoolArray:
        """(U,) which UAS fly, and have to fly home; to be called once per sample.

        Args:
            swarm: What is seen.
            view: The same, updated.
            learnt: What is known of the wind, likewise, by a planner that plans in it: it calls UAS
                as well, for as long as it lasts; None: the rule of still air alone.
        """
        flies = swarm.status == FLYING
        self._called &= flies
        for u in np.flatnonzero(flies & ~self._called).tolist():
            self._called[u] = has_to_return(view.arena, view.state, u)
        self._called_in_wind &= flies
        if learnt is not None:
            arena = in_disturbances(view.arena)
            state = view.state._replace(belief=learnt.belief)
            for u in np.flatnonzero(flies).tolist():
                called = bool(self._called_in_wind[u])
                self._called_in_wind[u] = needs_all_for_home(arena, state, u, called)
        return self._called | self._called_in_wind | (swarm.returning & flies)

    def keep(self, called: BoolArray) -> None:
        """Forget others: what called them home no longer holds, as where there is more to cover.

        Args:
            called: (U,) of these it may hold.
        """
        self._called &= called

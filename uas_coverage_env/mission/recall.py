"""Which UAS have to fly home, for planners that bring them home themselves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.autopilot import call_home
from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.mission.learnt_wind import LearntWind, in_disturbances
from uas_coverage_env.mission.views import WorldView
from uas_coverage_env.world import FLYING, OUTCOME_DTYPE, SwarmState

BoolArray = NDArray[np.bool_]

_NO_OUTCOME = np.zeros(0, OUTCOME_DTYPE)


class Recall:
    """The rule of return mode, which need not be on: a UAS that it calls lands first.

    Where bounds of wind are stated, the rule is that in the wind that is learnt, and lets go whom
    only a gust has called. Where return mode is on, it may call more, since it also sees what
    charge is used.

    Args:
        brief: The mission.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._called = np.zeros(len(brief.uas), np.bool_)
        self._learnt = None if brief.conditions is None else LearntWind(brief)

    def update(self, swarm: SwarmState, view: WorldView) -> BoolArray:
        """(U,) which UAS fly, and have to fly home; to be called once per sample.

        Args:
            swarm: What is seen.
            view: The same, updated.
        """
        flies = swarm.status == FLYING
        self._called &= flies
        arena, state = view.arena, view.state._replace(returning=self._called)
        if self._learnt is not None:
            self._learnt.see(swarm)
            arena = in_disturbances(arena)
            state = state._replace(belief=self._learnt.belief)
        call_home(arena, state, False, _NO_OUTCOME)
        return self._called | (swarm.returning & flies)

    def keep(self, called: BoolArray) -> None:
        """Forget others: what called them home no longer holds, as where there is more to cover.

        Args:
            called: (U,) of these it may hold.
        """
        self._called &= called

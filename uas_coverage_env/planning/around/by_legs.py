"""What a planner commands, as an autopilot flies it from a file: by legs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.execution.leg_follower import LegFollower
from uas_coverage_env.world import Command, GoTo, SwarmState

Routes = Sequence[Sequence[int]] | Sequence[NDArray[np.int64]]


class ByLegs:
    """Flies to where planners send UAS by `GoTo`; other commands stay what they are.

    Args:
        brief: A mission that an autopilot flies.
        routes: (U,) waypoints of each UAS, in order, as the planner begins; None: it has none, and
            its UAS fly from target to target.
    """

    def __init__(self, brief: MissionBrief, routes: Routes | None) -> None:
        self._follower = LegFollower(brief)
        if routes is not None:
            self._follower.begin(_lists(routes))

    @property
    def returns(self) -> NDArray[np.bool_]:
        """(U,) called home for their charge: they are given no more waypoints."""
        return self._follower.returns

    def commands(
        self, swarm: SwarmState, commands: Mapping[str, Command], routes: Routes | None
    ) -> Mapping[str, Command]:
        """The commands, with legs in place of `GoTo`.

        Args:
            swarm: What the planner was shown.
            commands: Its commands.
            routes: (U,) its routes at this sample; None: it has none.
        """
        sent = {name: each for name, each in commands.items() if isinstance(each, GoTo)}
        if not sent:
            return commands
        if routes is None:
            to = [sent[name].waypoint if name in sent else None for name in swarm.names]
            routes = [[] if waypoint is None else [waypoint] for waypoint in to]
        legs = self._follower.commands(swarm, _lists(routes))
        return {name: legs[name] if name in sent else each for name, each in commands.items()}


def _lists(routes: Routes) -> list[list[int]]:
    return [[int(w) for w in route] for route in routes]

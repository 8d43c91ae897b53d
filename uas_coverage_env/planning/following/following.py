"""The loop that flies an order of the waypoints under the world's guidance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.mission import MissionBrief, WorldView
from uas_coverage_env.mission.guided_flight import GuidedFlight
from uas_coverage_env.mission.recall import Recall
from uas_coverage_env.world import Command, GoTo, SwarmState

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Seen:
    """What an order is made for.

    Attributes:
        swarm: What the planner sees.
        works: (U,) flies, and may be sent to waypoints: its charge calls it home not yet.
        wanted: (W,) open, and neither left for later nor given up.
        blocked: (W,) inside the keep-out of something that moves, now.
    """

    swarm: SwarmState
    works: BoolArray
    wanted: BoolArray
    blocked: BoolArray


class Order(Protocol):
    """Which UAS visits what, in which order."""

    def routes(self, seen: Seen) -> Sequence[IntArray] | Sequence[Sequence[int]]:
        """(U,) waypoints that each UAS still has to visit, searched again where that is due.

        To be called once per sample.
        """
        ...


class Following:
    """Sends each UAS along its route, to one waypoint after the other; home in the end.

    A waypoint that a UAS comes no nearer to is flown to with care, then left for later, and given
    up in the end (`GuidedFlight`). A UAS flies home by the rule of return mode, which need not be
    on (`Recall`).

    Args:
        brief: The mission.
        order: Along what it flies; None: `update` alone is asked, and `commands` is not.
        calls_home: Whether by that rule.
        blocked_from: Arguments of `WorldView.blocked`.

    Attributes:
        view: What was seen last, as arrays of the world's kernels.
        guided: The flights to single waypoints.
        recall: The rule that calls UAS home.
        called: (U,) which ones it calls.
    """

    def __init__(
        self,
        brief: MissionBrief,
        order: Order | None = None,
        *,
        calls_home: bool = True,
        blocked_from: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        self._order, self._calls_home, self._blocked_from = order, calls_home, blocked_from
        self.view, self.guided = WorldView(brief), GuidedFlight(brief)
        self.recall, self.called = Recall(len(brief.uas)), np.zeros(len(brief.uas), np.bool_)

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are given up, and why in a few words."""
        return self.guided.given_up

    def update(self, swarm: SwarmState) -> Seen:
        """Take in a sample; to be called once for each, unless `commands` is.

        Args:
            swarm: What is seen.
        """
        self.view.update(swarm)
        if self._calls_home and swarm.uncovered.any():
            self.called = self.recall.update(swarm, self.view)
        works = (swarm.status == FLYING) & ~swarm.returning & ~self.called
        wanted = self.guided.wanted(swarm.uncovered)
        return Seen(swarm, works, wanted, self.view.blocked(*self._blocked_from))

    def commands(self, swarm: SwarmState) -> dict[str, Command]:
        """A command for each active UAS; to be called once per sample.

        Args:
            swarm: What is seen.
        """
        assert self._order is not None
        seen = self.update(swarm)
        targets = first_of(self._order.routes(seen), swarm)
        return self.towards(seen, targets)

    def towards(self, seen: Seen, targets: Mapping[str, int]) -> dict[str, Command]:
        """A command for each active UAS: to its target, or home.

        Args:
            seen: What `update` returned.
            targets: Waypoint of each UAS that has one, by its name.
        """
        home: dict[str, Command] = {name: GoTo(None) for name in seen.swarm.active}
        return home | self.guided.commands(seen.swarm, targets, seen.blocked)


def first_of(
    routes: Sequence[IntArray] | Sequence[Sequence[int]], swarm: SwarmState
) -> dict[str, int]:
    """The next waypoint of each active UAS that has one, by its name."""
    return {
        name: int(routes[u][0])
        for u, name in enumerate(swarm.names)
        if swarm.status[u] == FLYING and len(routes[u])
    }

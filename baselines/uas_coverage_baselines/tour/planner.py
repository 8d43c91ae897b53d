"""The planner `tour`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from uas_coverage_baselines.tour.tour_flight import MakeLeader, TourFlight
from uas_coverage_env.flight import AssistedOptions
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.planning.decision import Decision
from uas_coverage_env.planning.following.leg_order import LegOrder
from uas_coverage_env.planning.routing import SearchEffort
from uas_coverage_env.world import Command, SwarmState

_LEG_SEARCHES = 3


class TourOptions(AssistedOptions):
    """Options of `tour`."""

    return_mode: bool = Field(
        default=False,
        description="let the world fly UAS home; else the planner does, by the same rule",
    )
    moves: int = Field(
        default=2_000_000, ge=0, le=10**9, description="changes tried by the order search"
    )
    changes: int = Field(
        default=700, ge=0, le=10**6, description="changes tried of each flight plan"
    )


class Tour:
    """Flies a global order of the waypoints, each UAS its own route, with plans of 8 s.

    Before take-off simulated annealing gives every UAS a route (`schedule`); on events the order
    is searched again. At every step each UAS's commands for the coming seconds are improved in
    simulation (`flight_plan`), and the first is flown. Where wind or wrong models are stated, order
    and plans are made in the wind that is learnt; a UAS whose plans do not come true nevertheless
    flies along its route under the world's guidance. There is no clock in any of it: the same seed
    flies the same mission.

    Args:
        options: See `TourOptions`.
        effort: Of the order's searches; None: by the options.
        make_leader: Of a mission and its arena, what plans ahead in a wind; None: nothing does.
    """

    Options = TourOptions
    goes_to = True

    def __init__(
        self,
        options: TourOptions | None = None,
        effort: SearchEffort | None = None,
        make_leader: MakeLeader | None = None,
    ) -> None:
        self.options = options or TourOptions()
        self.effort = effort or SearchEffort(self.options.moves)
        self._make_leader = make_leader
        self.assistants = self.options.assistants
        self.last_decision: Decision | None = None
        self.flight: TourFlight | LegOrder | None = None
        self._has_acted = False

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile everything."""
        quick = Tour(TourOptions(moves=10, changes=1))
        quick.reset(brief, 0)
        quick.act(first_sight(brief))

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Search the order from the starts; that of a mission under way, when it goes on."""
        flew = self.flight if isinstance(self.flight, TourFlight) and self._has_acted else None
        self._has_acted = False
        if brief.execution is not None:
            self.flight = LegOrder(brief, _LEG_SEARCHES, self.effort, seed)
            return
        self.flight = TourFlight(
            brief, self.options.changes, self.effort, seed, self._make_leader,
            flown=None if flew is None else flew.schedule.order, goes_on=flew is not None,
        )  # fmt: skip

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Plan for each flying UAS, in order, and fly the first command of each plan."""
        assert self.flight is not None
        self._has_acted = True
        commands = self.flight.act(swarm)
        self.last_decision = self.flight.decision
        return commands

    @property
    def routes(self) -> Sequence[NDArray[np.int64]] | None:
        """(U,) waypoints of each UAS where an autopilot flies; None: plans are flown."""
        return self.flight.routes if isinstance(self.flight, LegOrder) else None

    def is_idle(self, swarm: SwarmState) -> bool:
        """Whether a UAS flies home, with no visit left."""
        return not isinstance(self.flight, LegOrder | None) and self.flight.is_idle(swarm)

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are left out or given up, and why in a few words."""
        return {} if self.flight is None else self.flight.given_up

"""The planner `trajectory`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.margins import margins_in
from uas_coverage_baselines.tour import Tour
from uas_coverage_baselines.trajectory.in_wind import blows, tour_in_wind
from uas_coverage_baselines.trajectory.mission_flight import MissionFlight
from uas_coverage_baselines.trajectory.mission_plan import MissionPlan, order_effort
from uas_coverage_baselines.trajectory.options import TrajectoryOptions
from uas_coverage_baselines.trajectory.plan_in_force import PlanInForce
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.planning.decision import Decision
from uas_coverage_env.planning.following import Following
from uas_coverage_env.planning.following.leg_order import LegOrder
from uas_coverage_env.world import Command, SwarmState


class Trajectory:
    """Plans each UAS's whole mission as one trajectory, and flies it as planned.

    An order of the waypoints is searched, the flights along it are convex programs that are made
    shorter as long as nothing is violated, and what is flown is verified with a backup trajectory
    (`MissionFlight`). Plans are made anew where the state is another, or something moves otherwise.
    There is no clock in any of it: the same seed flies the same mission. In a stated wind `tour`
    flies; where an autopilot is to fly the mission, only the order is planned (`LegOrder`). The
    record of each decision says so.
    """

    Options = TrajectoryOptions

    def __init__(self, options: TrajectoryOptions | None = None) -> None:
        self.options = options or TrajectoryOptions()
        self.last_decision: Decision | None = None
        self._flies: MissionFlight | Tour | LegOrder | None = None
        self._has_acted = False

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile everything."""
        quick = Trajectory(TrajectoryOptions(orders=1, moves=10, programs=3))
        quick.reset(brief, 0)
        quick.act(first_sight(brief))
        if isinstance(quick._flies, MissionFlight):
            quick._flies.safeguard.evade([0], {}, [0])

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Plan the mission from the starts; one that may be under way, when it goes on."""
        flew, effort = self._flies, order_effort(self.options, len(brief.uas))
        margins = margins_in(brief, self.options.margin_m, self.options.moving_margin_m)
        goes_on, self._has_acted = self._has_acted, False
        if brief.execution is not None:
            self._flies = LegOrder(brief, self.options.orders, effort, seed)
        elif blows(brief):
            if not isinstance(flew, Tour) or flew.effort != effort:
                self._flies = flew = tour_in_wind(effort, margins.fixed_m)
            flew.reset(brief, seed)
        elif not goes_on:
            self._flies = MissionFlight(brief, self.options, seed)
        else:
            before = flew if isinstance(flew, MissionFlight) else None
            self._flies = MissionFlight(brief, self.options, seed, before, goes_on=True)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Fly on as planned, and plan anew where that is not possible or no longer right."""
        self._has_acted = True
        assert self._flies is not None
        commands = self._flies.act(swarm)
        if isinstance(self._flies, Tour):
            decision = self._flies.last_decision or Decision()
            self.last_decision = replace(decision, flown_by=("tour",))
        else:
            self.last_decision = self._flies.decision
        return commands

    @property
    def routes(self) -> Sequence[NDArray[np.int64]] | None:
        """(U,) waypoints of each UAS where an autopilot flies; None: trajectories are flown."""
        return self._flies.routes if isinstance(self._flies, LegOrder) else None

    def is_idle(self, swarm: SwarmState) -> bool:
        """Whether a UAS flies home, with no visit left."""
        return not isinstance(self._flies, LegOrder | None) and self._flies.is_idle(swarm)

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are left out or given up, and why in a few words."""
        return {} if self._flies is None else self._flies.given_up

    @property
    def in_force(self) -> PlanInForce | None:
        """The plan that is flown; None where another flies, or before there is one."""
        return self._flies.in_force if isinstance(self._flies, MissionFlight) else None

    @property
    def mission_plan(self) -> MissionPlan | None:
        """The same as it was made."""
        return None if self.in_force is None else self.in_force.plan

    @property
    def steering(self) -> Following | None:
        """What flies along the order where no flight goes as planned; None: all do."""
        return self._flies.following if isinstance(self._flies, MissionFlight) else None

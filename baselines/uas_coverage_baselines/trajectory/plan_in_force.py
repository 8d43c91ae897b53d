"""The plan that is flown: from what it was made, what is left of it, when it no longer holds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.mission_plan import MissionPlan, Planned
from uas_coverage_baselines.trajectory.moving_obstacles import NEVER, MovingObstacles
from uas_coverage_baselines.trajectory.waiting import Waiting
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.world import SwarmState

BoolArray = NDArray[np.bool_]

PLAN_MARGIN_M = 1.0
"""Plans keep this much more from what moves than what is flown has to, at scale 1 [m]."""

_AGAIN_S = 4.0  # a plan that did not come is looked for again after this time
_AT_LAST_S = 8.0  # a visit to what is still blocked so soon is given up; while the UAS may still
# brake it is put off where it can be


@dataclass
class PlanInForce:
    """A plan of the mission, and what has become of it.

    Attributes:
        plan: As it was made, or improved since.
        planned: What of it is flown, by index of the UAS.
        ends: Steps at which flights of the plan end, likewise.
        made_at: Number of the sample.
        had: UAS that had a flight then.
        may_fly: (U,) UAS that flew then.
        unresponsive: (U,) UAS that flew without commands then.
        moving: What moved then.
        blocked: (W,) waypoints that it blocked then.
        latest_visit: (W,) steps after which no UAS has the charge to visit a blocked one.
        waiting: Which UAS could wait for these.
    """

    plan: MissionPlan
    planned: dict[int, Planned]
    ends: dict[int, int]
    made_at: int
    had: frozenset[int]
    may_fly: BoolArray
    unresponsive: BoolArray
    moving: MovingObstacles
    blocked: BoolArray
    latest_visit: NDArray[np.int64]
    waiting: Waiting

    def take(self, better: MissionPlan) -> None:
        """Fly another plan of the same visits from now on."""
        order = replace(
            better.order, left_out=self.plan.order.left_out, trips=self.plan.order.trips
        )
        self.plan = replace(better, order=order)
        self.planned |= better.planned
        self.ends |= {u: p.course.end for u, p in better.planned.items()}

    def keep(self, flying: BoolArray) -> None:
        """Forget what was planned for UAS that no longer fly.

        Args:
            flying: (U,).
        """
        self.planned = {u: planned for u, planned in self.planned.items() if flying[u]}

    def fly_instead(self, uas: int, new: Planned | None) -> int:
        """Fly the same visits otherwise; None: drop them.

        Returns:
            Steps by which the flight ends later.
        """
        before = self.planned.pop(uas)
        if new is None:
            return 0
        self.planned[uas], self.ends[uas] = new, new.course.end
        return new.course.end - before.course.end

    def has_work(self, uas: int, swarm: SwarmState) -> bool:
        """Whether a UAS still has something to visit, or none knows how."""
        planned = self.planned.get(uas)
        if planned is None:
            return uas in self.plan.troubles
        return bool(planned.open_visits(swarm.step, swarm.uncovered).any())

    def stays(self, uas: int, swarm: SwarmState) -> bool:
        """Whether a UAS has nothing to do and is at home still, or should have landed."""
        if uas in self.planned:
            return self.planned[uas].course.end <= swarm.step
        return not swarm.departed[uas] and not self.has_work(uas, swarm) and swarm.step == 0

    def why_plan_anew(
        self,
        swarm: SwarmState,
        moving: MovingObstacles,
        fleet: Fleet,
        down: BoolArray,
        back: BoolArray,
        *,
        hands_over: bool,
    ) -> str | None:
        """Why another plan is needed, in a few words; None: this one holds.

        Args:
            swarm: What is seen, of UAS that take commands.
            moving: What moves now.
            fleet: The mission.
            down: (U,) UAS that have landed.
            back: (U,) UAS that fly again, with fresh packs.
            hands_over: Whether to plan anew for what only a UAS could wait for that flies home.
        """
        step, flying, dt_s = swarm.step, swarm.status == FLYING, fleet.brief.dt_s
        missing = [
            u for u in np.flatnonzero(flying & self.may_fly).tolist() if u not in self.planned
        ]
        waited = dt_s * (step - self.made_at) >= _AGAIN_S
        if missing and (waited or any(u in self.had for u in missing)):
            return "no plan"
        if not np.array_equal(flying & self.may_fly, self.may_fly & self._flies(step, down)):
            return "a UAS is lost"
        if (flying & self.unresponsive).any() or back.any():
            return "a UAS is back"
        if waited and self.planned:
            beyond = self.latest_visit < self.made_at  # no battery reaches them
            known = self.plan.thought_of(swarm, self.planned) | beyond
            if (swarm.uncovered & ~known).any():
                return "missed a waypoint"
        if not len(moving):
            return None
        return self._why_not_beside(swarm, moving, fleet, waited=waited, hands_over=hands_over)

    def _why_not_beside(
        self,
        swarm: SwarmState,
        moving: MovingObstacles,
        fleet: Fleet,
        *,
        waited: bool,
        hands_over: bool,
    ) -> str | None:
        """Likewise, for what moves."""
        if len(moving) != len(self.moving) or moving.has_turned(self.moving):
            return "something moves otherwise"
        later_s = fleet.brief.dt_s * (swarm.step - self.made_at)
        if waited and moving.off_m(self.moving, later_s) > fleet.length_scale * PLAN_MARGIN_M:
            return "a UAS without a radio flies otherwise"
        opens = fleet.opens(moving)
        if not np.array_equal((opens > 0) & swarm.uncovered, self.blocked & swarm.uncovered):
            return "a waypoint opened or closed"
        unknown = opens >= NEVER
        if not unknown.any():
            return None
        if self._is_nearly_there(unknown & swarm.uncovered, swarm, fleet):
            return "a waypoint is still blocked"
        if hands_over and self.waiting.is_left_to_others(self.planned, swarm.step, swarm.uncovered):
            return "a UAS that could wait longer is about to fly home"
        return None

    def _is_nearly_there(self, blocked: BoolArray, swarm: SwarmState, fleet: Fleet) -> bool:
        """Whether a waypoint (W,) that is blocked is about to be visited."""
        for planned in self.planned.values():
            visits = planned.flight.visits + planned.course.begin
            at_last = visits >= self.latest_visit[planned.route]
            soon_s = np.where(at_last, _AT_LAST_S, fleet.braking_s)
            ahead = visits - swarm.step
            near = (fleet.brief.dt_s * ahead < soon_s) & (ahead > 0)
            if (blocked[planned.route] & near).any():
                return True
        return False

    def _flies(self, step: int, down: BoolArray) -> BoolArray:
        """(U,) UAS that should be flying: by plan they have not ended, and are not home early."""
        ends = np.ones(len(down), np.bool_)
        for u, end in self.ends.items():
            ends[u] = step < end
        return ends & ~down

"""Flying legs in time: where an autopilot would be; time stops for a UAS that is late."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.mission import MissionBrief, WorldView
from uas_coverage_env.mission.recall import Recall
from uas_coverage_env.planning.execution.leg_course import Course, CoursePlanner
from uas_coverage_env.planning.execution.separation import Waits, separate
from uas_coverage_env.world import Command, GoTo, SwarmState, Velocity

FloatArray = NDArray[np.float64]

_LEAD_S, _PULL_PER_S = 2.4, 0.4
"""How far ahead velocities are, and how hard a UAS is pulled to its place: of twelve pairs those
with the least error."""

_SLOWER_FROM_M, _STOPS_AT_M = 3.0, 6.0
"""Behind by so much, the time of a UAS passes more slowly, and not at all."""

_HELD_UP_S = 15.0
"""So long without time passing, and guidance flies on, past what is in the way."""

_GUIDED_S = 40.0
_SPARE_SLACK_S = 10.0
"""Planned beyond the slack that is asked: the legs of a file are not quite those of the plan."""

_MISSED = 3
"""So often a waypoint is missed before it is left out."""


class LegFollower:
    """Commands along routes.

    Args:
        brief: A mission that an autopilot flies.
    """

    def __init__(self, brief: MissionBrief) -> None:
        assert brief.execution is not None
        self._brief, self._slack_s = brief, brief.execution.min_slack_s
        self.planner = CoursePlanner(brief)
        n_uas = len(brief.uas)
        self._courses: list[Course | None] = [None] * n_uas
        self._clock_s, self._held_s = np.zeros(n_uas), np.zeros(n_uas)
        self._view, self._begun = WorldView(brief), False
        self._recall, self._returns = Recall(n_uas), np.zeros(n_uas, np.bool_)
        self._guided: dict[int, tuple[int | None, float]] = {}
        self._missed = np.zeros((n_uas, len(brief.waypoints)), np.int64)

    def begin(self, routes: Sequence[Sequence[int]]) -> None:
        """Plan from the starts, with waits where UAS would come too close.

        Args:
            routes: Waypoints of each UAS.
        """
        flying = [u for u, route in enumerate(routes) if len(route)]
        corners = {u: self.planner.corners(u, routes[u]) for u in flying}
        fleet = [(u, lambda waits, u=u: self.planner.follow(u, corners[u], waits)) for u in flying]
        scenario, waits = self._brief.as_scenario(), None
        for spare_s in (_SPARE_SLACK_S, 0.0):
            waits = waits or separate(scenario, fleet, self._slack_s + spare_s)
        waits = waits or [Waits()] * len(flying)
        for u, one in zip(flying, waits, strict=True):
            self._courses[u] = self.planner.course(u, corners[u], one)

    @property
    def courses(self) -> tuple[Course | None, ...]:
        """(U,) what each UAS flies; None: nothing yet."""
        return tuple(self._courses)

    @property
    def returns(self) -> NDArray[np.bool_]:
        """(U,) called home for its charge."""
        return self._returns

    def commands(self, swarm: SwarmState, routes: Sequence[Sequence[int]]) -> Mapping[str, Command]:
        """A command for each active UAS: on along its legs, new ones where its route is another.

        Args:
            swarm: What is seen.
            routes: Waypoints of each UAS, what is covered left out.
        """
        if not self._begun and swarm.step > 0:  # planned anew in mid-mission: not from the starts
            self._courses = [None] * len(self._courses)
        self._begun = True
        self._call_home(swarm)
        result: dict[str, Command] = {}
        for name in swarm.active:
            u = swarm.names.index(name)
            route = [int(w) for w in routes[u] if self._missed[u, w] < _MISSED]
            result[name] = self._command(swarm, u, route)
        return result

    def _call_home(self, swarm: SwarmState) -> None:
        """Note whose charge suffices for nothing more than the way home."""
        self._view.update(swarm)
        # asked before it departs, too, so that nothing is compiled in mid-flight
        self._returns = self._recall.update(swarm, self._view)
        self._recall.keep(swarm.departed)

    def _command(self, swarm: SwarmState, u: int, route: list[int]) -> Command:
        if self._returns[u] or (not route and not swarm.departed[u]):
            return GoTo(None, "return")
        if u in self._guided:
            target, until_s = self._guided[u]
            if swarm.time_s < until_s and (target is None or swarm.uncovered[target]):
                return GoTo(target, "return" if target is None else "covering")
            if target is not None and swarm.uncovered[target]:
                self._missed[u, target] += 1
                route = [w for w in route if self._missed[u, w] < _MISSED]
            del self._guided[u]
            self._courses[u] = None
        course = self._course(swarm, u, route)
        if self._clock_s[u] >= course.lands_s and not route:
            return GoTo(None, "return")
        return self._along(swarm, u, course, route)

    def _course(self, swarm: SwarmState, u: int, route: list[int]) -> Course:
        """The course that is flown, or a new one along the route."""
        course = self._courses[u]
        if course is not None:
            left = [w for w in course.route if swarm.uncovered[w] and self._missed[u, w] < _MISSED]
            if left == route:
                if not left or self._clock_s[u] < course.covered_s + 2.0 * _LEAD_S:
                    return course
                self._missed[u, left] += 1  # time to pass them was over
                route[:] = [w for w in left if self._missed[u, w] < _MISSED]
        corners = self.planner.corners(u, route, swarm.x[u, :3])
        course = self.planner.course(u, corners, takes_off=False)
        self._courses[u], self._clock_s[u], self._held_s[u] = course, 0.0, 0.0
        return course

    def _along(self, swarm: SwarmState, u: int, course: Course, route: list[int]) -> Command:
        dt_s, clock_s = self._brief.dt_s, self._clock_s[u]
        behind_m = _at(course, clock_s) - swarm.x[u, :3]
        own = self._brief.uas[u]
        waits = clock_s <= _waits_until_s(course)
        if waits:
            behind_m[2] = 0.0  # it waits above its start, not on the ground
        off_m = float(np.linalg.norm(behind_m))
        passes = (_STOPS_AT_M - off_m) / (_STOPS_AT_M - _SLOWER_FROM_M)
        passes_s = dt_s * min(max(passes, 0.0), 1.0)
        self._clock_s[u] += passes_s
        self._held_s[u] = 0.0 if passes_s > 0.0 else self._held_s[u] + dt_s
        mode = "covering" if route else "transit"
        if self._held_s[u] >= _HELD_UP_S:
            self._guided[u] = (route[0] if route else None, swarm.time_s + _GUIDED_S)
        ahead_m = _at(course, clock_s + _LEAD_S + 0.5 * passes_s)
        before_m = _at(course, clock_s + _LEAD_S - 0.5 * passes_s)
        rate = (ahead_m - before_m) / dt_s + _PULL_PER_S * behind_m
        height_m = -_at(course, clock_s + passes_s)[2]
        height_m = max(height_m, -(own.start_m if waits else own.home_m)[2])
        return Velocity(float(rate[0]), float(rate[1]), float(height_m), mode)


def _waits_until_s(course: Course) -> float:
    return float(course.followed.corner_s[0])


def _at(course: Course, time_s: float) -> FloatArray:
    """(3,) where the course is at a time [m]."""
    followed = course.followed
    time_s = min(max(time_s, 0.0), float(followed.times_s[-1]))
    return np.array(
        [np.interp(time_s, followed.times_s, followed.places_m[:, axis]) for axis in range(3)]
    )

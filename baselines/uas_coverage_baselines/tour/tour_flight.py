"""A mission under `tour`: an order, and plans of some seconds along it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.tour.cost import SAFE_BELOW_S, SLOWER
from uas_coverage_baselines.tour.flight_plan import improve
from uas_coverage_baselines.tour.pursuit import LEGS, PursuitTask, brake_seconds, empty_plan
from uas_coverage_baselines.tour.schedule import Schedule, View
from uas_coverage_env.entities.commands import COMMAND_DTYPE
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.mission.learnt_wind import LearntWind, in_disturbances
from uas_coverage_env.planning.around.handover import away_of
from uas_coverage_env.planning.around.repeats import asked_in_s
from uas_coverage_env.planning.decision import Decision
from uas_coverage_env.planning.following import Following
from uas_coverage_env.planning.routing import Routes, SearchEffort
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.scale import length_scale
from uas_coverage_env.world import Arena, Command, GoTo, SwarmState, Velocity

FloatArray = NDArray[np.float64]
_HORIZON_S = 8.0  # a longer plan has more in it than so many changes can improve
_STEPS_AT_MOST = 60
_COVERED_WITHIN_M = 0.3  # nearer than the radius by this, or by a fiftieth of it
_NEAR = 0.7  # share of the radius at which the leg to a waypoint is expected to end
_FROM_WITHIN = 0.8  # share of the radius from within which a waypoint is covered, beside what moves
_WAITING_M = 100.0  # of a blocked waypoint to wait within, at scale 1: what blocks may set off
_PER_WAYPOINT_S = 5.0  # what a turn takes beyond that: there is no gain in putting one off
_MOVING_MARGIN_M = 6.0  # at scale 1
_SURPRISE_MPS = 0.3  # a larger deviation means that another flew: the filter, return mode
_OFF_MPS = 0.6  # a mean deviation with which no plan comes true
_OFF_SHARE = 0.1  # of the last step in that mean


class Leader(Protocol):
    """Plans in a wind what `Tour` flies where it is safe."""

    def commands(
        self,
        uas: int,
        step: int,
        x: FloatArray,
        route: NDArray[np.int64],
        learnt: LearntWind,
        n_steps: int,
    ) -> FloatArray | None:
        """(N, 3) velocities north and east [m/s], and altitudes [m]; None: no plan."""


MakeLeader = Callable[[MissionBrief, Arena], Leader | None]
"""Of a mission and its arena, what plans ahead in a wind; None: nothing does."""


class TourFlight:
    """Flies one mission.

    Args:
        brief: The mission.
        changes: Tried of each flight plan.
        effort: Of the order's searches.
        seed: Of these, and of the changes.
        make_leader: What plans ahead in a wind.
        flown: The order of the same mission in a scene that was another.
        goes_on: Whether the mission may be under way: its order is searched at the first sample. If
            not, it is searched now, from the starts.

    Attributes:
        schedule: The order.
        off_mps: (U,) how much velocities are off after a step, in the mean of the last ones [m/s].
        decision: About the last step.
    """

    def __init__(
        self,
        brief: MissionBrief,
        changes: int,
        effort: SearchEffort,
        seed: int,
        make_leader: MakeLeader | None = None,
        flown: Routes | None = None,
        *,
        goes_on: bool = False,
    ) -> None:
        self._brief, self._changes, self._seed = brief, changes, seed
        self._scale = length_scale(brief.vehicles, brief.dt_s)
        self._following = Following(
            brief, blocked_from=(_FROM_WITHIN, _FROM_WITHIN, self._scale * _MOVING_MARGIN_M)
        )
        self._world, self._guided = self._following.view, self._following.guided
        self._recall = self._following.recall
        self._arena = self._world.arena
        self._learnt: LearntWind | None = None
        if brief.conditions is not None:
            self._learnt, self._arena = LearntWind(brief), in_disturbances(self._arena)
        self._leader = None if make_leader is None else make_leader(brief, self._arena)
        n_uas, n_waypoints = len(brief.uas), len(brief.waypoints)
        self._n_steps = min(max(round(_HORIZON_S / brief.dt_s), 1), _STEPS_AT_MOST)
        self._rng = np.random.default_rng([seed, n_uas])
        self._command = np.zeros(1, dtype=COMMAND_DTYPE)[0]
        self._plans = [empty_plan(self._n_steps) for _ in range(n_uas)]
        for plan, uas in zip(self._plans, brief.uas, strict=True):
            plan.path_m[:] = uas.start_m
        self._trial = empty_plan(self._n_steps)
        self._is_flown = np.zeros(n_uas, np.bool_)
        self.off_mps = np.zeros(n_uas)
        self._aimed_at: list[NDArray[np.int64]] = [np.zeros(0, np.int64)] * n_uas
        self._brake_s = [brake_seconds(self._arena, i, self._command) for i in range(n_uas)]
        self._returns = np.zeros(n_uas, np.bool_)
        self._uncovered = self._later = np.zeros(n_waypoints, np.bool_)
        self._radius_m = self._arena.waypoints["radius_m"].copy()
        self.schedule = Schedule(brief, effort)
        self.decision: Decision | None = None
        self._flown, self._has_order = flown, not goes_on
        if self._has_order:
            self.schedule.begin(self._view(first_sight(brief)), seed)

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are left out or given up, and why in a few words."""
        left_out = dict.fromkeys(self.schedule.order.left_out.tolist(), "its order leaves it out")
        closed = np.flatnonzero(self.schedule.closed_off).tolist()
        return left_out | self._guided.given_up | dict.fromkeys(closed, "no way to it")

    def is_idle(self, swarm: SwarmState) -> bool:
        """Whether a UAS flies home, with no visit left."""
        routes = self.schedule.order.routes
        return any(not len(routes[i]) for i in np.flatnonzero(swarm.status == FLYING))

    def act(self, swarm: SwarmState) -> dict[str, Command]:
        """Plan for each flying UAS, in order, and fly the first command of each plan."""
        if self._learnt is not None:
            self._learnt.see(swarm)
        view = self._view(replace(swarm, uncovered=self._guided.wanted(swarm.uncovered)))
        if not self._has_order:
            self._go_on(view, swarm.step)
        self.schedule.update(view)
        others_m = self._where_others_go(view, away_of(swarm))
        commands: dict[str, Command] = {}
        predicted_m: dict[str, FloatArray] = {}
        for i in np.flatnonzero(view.flies).tolist():
            name = swarm.names[i]
            commands[name] = self._fly(i, view, others_m, swarm)
            predicted_m[name] = others_m[i].copy()
        self.decision = Decision(predicted_m)
        return commands | self._guided.commands(swarm, self._guided_to(swarm), _closed(view))

    def _guided_to(self, swarm: SwarmState) -> dict[str, int]:
        """The waypoints that UAS fly to whose plans do not come true."""
        routes = self.schedule.order.routes
        flying = np.flatnonzero(self._is_guided & (swarm.status == FLYING) & ~self._returns)
        return {swarm.names[i]: int(routes[i][0]) for i in flying if len(routes[i])}

    @property
    def _is_guided(self) -> NDArray[np.bool_]:
        """(U,) whose plans do not come true, in spite of what is learnt of the wind."""
        return self.off_mps > _OFF_MPS

    def _go_on(self, view: View, step: int) -> None:
        """Have an order for a mission whose scene is another, or for a new one."""
        self._has_order = True
        if step > 0 and self._flown is not None:
            self.schedule.go_on(view, self._flown)
        else:
            self.schedule.begin(self._view(first_sight(self._brief)), self._seed)

    def _fly(self, i: int, view: View, others_m: FloatArray, swarm: SwarmState) -> Command:
        task = self._task(i, view)
        plan, x = self._plans[i], view.x[i]
        n_kept = self._catch_up(i, x, task.route, swarm)
        belief = None if self._learnt is None else self._learnt.belief[i]
        is_guided = self._is_guided[i]
        changes = 0 if is_guided else self._changes
        seconds = improve(
            self._arena, i, task, others_m, plan, self._trial, n_kept, changes, self._rng,
            self._command, belief, self._led(i, x, task, swarm.step),
        )  # fmt: skip
        others_m[i] = plan.path_m
        mode = "covering" if len(task.route) else "return"
        # in wind the first step is a hover, for a first look at it
        looks = self._learnt is not None and swarm.step == 0
        self._is_flown[i] = seconds < SAFE_BELOW_S and not is_guided and not looks
        if not self._is_flown[i]:
            return GoTo(int(task.route[0]) if len(task.route) else None, mode)
        north_mps, east_mps, altitude_m = plan.commands[0].tolist()
        return Velocity(north_mps, east_mps, altitude_m, mode)

    def _led(self, i: int, x: FloatArray, task: PursuitTask, step: int) -> FloatArray | None:
        """What is flown where it is safe, (0, 3) where there is no plan; None: in still air."""
        if self._learnt is None:
            return None
        led = None
        if self._leader is not None and not self._is_guided[i] and (task.cover_m >= 0.0).all():
            led = self._leader.commands(i, step, x, task.route, self._learnt, self._n_steps)
        return np.zeros((0, 3)) if led is None else led

    def _task(self, i: int, view: View) -> PursuitTask:
        schedule = self.schedule
        route = schedule.order.routes[i]
        if self._returns[i]:
            route = route[:0]
        radius_m, blocked = self._radius_m[route], view.blocked[route]
        within_m = radius_m - np.minimum(_COVERED_WITHIN_M, radius_m / 50.0)
        return PursuitTask(
            np.ascontiguousarray(route),
            np.where(_closed(view)[route], -1.0, within_m),
            np.append(np.where(blocked, self._scale * _WAITING_M, _NEAR * radius_m), 0.0),
            schedule.rest_s(i, SLOWER, _PER_WAYPOINT_S) if len(route) else np.zeros(1),
            schedule.legs.acceleration_mps2[i],
            self._brake_s[i],
            self._scale * _MOVING_MARGIN_M,
        )

    def _catch_up(self, i: int, x: FloatArray, route: NDArray[np.int64], swarm: SwarmState) -> int:
        """Move what is left of the plan one step on; how many of its legs still hold."""
        plan = self._plans[i]
        off_mps = float(np.abs((plan.x[1] - x)[S.VX : S.VZ + 1]).max())
        if self._learnt is None:
            as_planned = self._is_flown[i] and off_mps < _SURPRISE_MPS
            plan.reference[0] = plan.reference[1] if as_planned else x[S.VX : S.VY + 1]
        else:
            filtered = len(swarm.filtered) > 0 and swarm.filtered[i]
            as_planned = self._is_flown[i] and not filtered and not swarm.returning[i]
            plan.reference[0] = swarm.reference_mps[i]
            if as_planned:
                self.off_mps[i] += _OFF_SHARE * (off_mps - self.off_mps[i])
        plan.x[0] = x
        plan.push[:-1], plan.share[:-1] = plan.push[1:].copy(), plan.share[1:].copy()
        plan.push[-1], plan.share[-1] = 0.0, 1.0
        if not as_planned:
            plan.push[:], plan.share[:] = 0.0, 1.0
        before = self._aimed_at[i]
        self._aimed_at[i] = route[:LEGS]
        if not len(route) or not len(before):
            return 0
        # what was aimed at before and is still ahead
        found = np.flatnonzero(before == route[0])
        if not len(found):
            return 0
        gone = int(found[0])
        for values in (plan.aim_m, plan.early_m):
            values[: LEGS - gone] = values[gone:].copy()
        still = before[gone:]
        n_same = min(len(still), len(route))
        same = still[:n_same] == route[:n_same]
        return n_same if same.all() else int(same.argmin())

    def _where_others_go(self, view: View, away: NDArray[np.bool_]) -> FloatArray:
        """(U, N+1, 3) [m] as planned before, one step on; NaN where none is flying.

        Args:
            view: What is seen.
            away: (U,) UAS that take no commands: they go on as they go now.
        """
        paths_m = np.full((len(view.x), self._n_steps + 1, 3), np.nan)
        clock_s = self._brief.dt_s * np.arange(self._n_steps + 1)[:, None]
        for i in np.flatnonzero(away).tolist():
            paths_m[i] = view.x[i, :3] + clock_s * view.x[i, S.VX : S.VZ + 1]
        for i in np.flatnonzero(view.flies).tolist():
            path_m = self._plans[i].path_m
            paths_m[i, :-1] = path_m[1:]
            paths_m[i, -1] = path_m[-1]
            # where it is now is known
            if np.linalg.norm(paths_m[i, 0] - view.x[i, :3]) > 1.0:
                paths_m[i] = view.x[i, :3]
        return paths_m

    def _view(self, swarm: SwarmState) -> View:
        later_s = asked_in_s(swarm) if len(swarm.again_s) else None
        if later_s is not None:
            self._recall.keep(swarm.departed & (not self._has_more(swarm, later_s > 0.0)))
        seen = self._following.update(swarm)
        self._returns = self._following.called
        flies = swarm.status == FLYING
        return View(
            x=swarm.x,
            may_work=flies & ~self._returns,
            flies=flies,
            uncovered=swarm.uncovered,
            blocked=seen.blocked,
            time_s=swarm.time_s,
            swarm=swarm if len(swarm.packs_left) else None,
            asked_in_s=later_s,
            wind_mps=None if self._learnt is None else self._learnt.mean_mps,
        )

    def _has_more(self, swarm: SwarmState, later: NDArray[np.bool_]) -> bool:
        """Whether there is more to visit than at the sample before, (W,) of it later."""
        more = swarm.uncovered & (~self._uncovered | (later & ~self._later))
        self._uncovered, self._later = swarm.uncovered, later
        return bool(more.any())


def _closed(view: View) -> NDArray[np.bool_]:
    """(W,) waypoints that cannot be covered yet."""
    return view.blocked if view.asked_in_s is None else view.blocked | (view.asked_in_s > 0.0)

"""The planner `trajectory`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.by_legs.mission import LegMission
from uas_coverage_baselines.trajectory.course import Course, hover_inputs
from uas_coverage_baselines.trajectory.fleet import Fleet, Moment
from uas_coverage_baselines.trajectory.improving import Ahead, Improvement, all_but_own
from uas_coverage_baselines.trajectory.in_wind import InWind, blows
from uas_coverage_baselines.trajectory.mission_plan import (
    Effort,
    MissionPlan,
    Planned,
    is_idle,
    order_effort,
    plan_mission,
)
from uas_coverage_baselines.trajectory.movers import NEVER, Movers
from uas_coverage_baselines.trajectory.options import TrajectoryOptions
from uas_coverage_baselines.trajectory.safeguard import Safeguard
from uas_coverage_baselines.trajectory.steering import Failures, Steering
from uas_coverage_baselines.trajectory.tracking import ProgramOf, tracked
from uas_coverage_baselines.trajectory.under_way import UnderWay, still_clear
from uas_coverage_baselines.trajectory.waiting import choose_waiting, opens_again, opens_first
from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.mission import MissionBrief, Range, Repeats, WorldView, first_sight
from uas_coverage_env.mission.handover import Handover, without
from uas_coverage_env.planning.decision import Decision
from uas_coverage_env.planning.reserves import BRAKING_S
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world import Command, GoTo, SwarmState, Wrench

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_AGAIN_S = 4.0  # a plan that did not come is looked for again after this time
_HOME_AFTER_S = 30.0  # without a plan for so long a UAS flies home
_PLAN_MARGIN_M = 1.0  # plans keep this much more from what moves than what is flown has to
_SOON_S = BRAKING_S  # a visit to what is still blocked so soon is put off,
_AT_LAST_S = 8.0  # given up where it cannot be put off


class Trajectory:
    """Plans each UAS's whole mission as one trajectory, and flies it as planned.

    An order of the waypoints is searched, the flights along it are convex programs that are made
    shorter as long as nothing is violated, and what is flown is verified with a backup trajectory.
    Plans are made anew where the state is another, or something moves otherwise. There is no clock
    in any of it: the same seed flies the same mission. In a stated wind `tour` flies, see `InWind`.
    """

    Options = TrajectoryOptions
    comes_home_by_legs = True
    plans_on_after_swaps = True

    def __init__(self, options: TrajectoryOptions | None = None) -> None:
        self.options = options or TrajectoryOptions()
        self.last_decision: Decision | None = None
        self.mission_plan: MissionPlan | None = None
        self._has_acted, self.given_up = False, dict[int, str]()
        self._in_wind = InWind(self.options.margin_m)
        self._repeats: Repeats | None = None

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile everything."""
        quick = Trajectory(TrajectoryOptions(orders=1, moves=10, programs=3))
        quick.reset(brief, 0)
        swarm = first_sight(brief)
        quick.act(swarm)
        if brief.execution is not None or blows(brief):
            return
        quick._safeguard.evade([0], {}, [0])

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Plan the mission from the starts; one that may be under way, when it goes on."""
        if self._in_wind.takes(brief, order_effort(self.options, len(brief.uas)), seed):
            self._has_acted, self.given_up = False, {}
            return
        repeats = self._repeats if self._has_acted and seed == self._seed else None
        if repeats is not None and repeats.goes_on(brief):
            return
        self._repeats = Repeats.of(brief) if brief.execution is None else None
        brief = brief if self._repeats is None else self._repeats.brief
        self._under_way = self._kept(brief) if self._has_acted else None
        self._has_acted = False
        self._brief, self._seed = brief, seed
        self._by_legs: LegMission | None = None
        self.mission_plan, self.given_up = None, {}
        if brief.execution is not None:
            effort = order_effort(self.options, len(brief.uas))
            self._by_legs = LegMission(brief, self.options.orders, effort, seed)
            return
        self._world, self._handover = WorldView(brief), Handover(brief)
        options = self.options
        way_home = self._way_home = Range(brief)
        moving_m = options.moving_margin_m + _PLAN_MARGIN_M
        self._fleet = Fleet(brief, options.margin_m, options.speed_share, moving_m)
        self._safeguard = Safeguard(self._fleet, self._world, way_home, options.moving_margin_m)
        self._planned: dict[int, Planned] = {}
        self._is_disturbed, self._failures = False, Failures()
        self.steering: Steering | None = None
        effort = Effort(1, 1, options.moves, options.programs, self.total_weight)
        self._improvement = Improvement(self._fleet, effort, options.idle_work, seed)
        self._is_handed_over = False
        self._without_plan_since = np.full(len(brief.uas), -1)
        self._flown_as_planned = set(range(len(brief.uas)))
        self._silent = self._silent_then = np.zeros(len(brief.uas), np.bool_)
        self._down = np.zeros(len(brief.uas), np.bool_)
        self._back, self._blocked = self._down, np.zeros(len(brief.waypoints), np.bool_)
        if self._under_way is None:
            self._begin(None)

    def _kept(self, brief: MissionBrief) -> UnderWay:
        """What was flown, if it may be flown on in this scene."""
        if self._by_legs is not None or self.mission_plan is None:
            return UnderWay()
        order = self.mission_plan.order
        if not still_clear(self._brief, brief):
            return UnderWay(order)
        return UnderWay(order, self._planned, self._safeguard.backups)

    def _begin(self, swarm: SwarmState | None) -> None:
        """Make the first plan of a mission, or of one under way since its scene is another."""
        before = UnderWay()
        if swarm is None or swarm.step == 0:
            swarm = first_sight(self._brief)
        elif self._under_way is not None:
            before = self._under_way.at(swarm)
        self._world.update(swarm)
        self._planned, self._order = dict(before.planned), before.order
        self._safeguard.backups.update(before.backups)
        self._make_plan(swarm, Movers.seen(self._brief, swarm, self._silent))

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Fly on as planned, and plan anew where that is not possible or no longer right."""
        if (in_wind := self._in_wind.act(swarm)) is not None:
            commands, decision = in_wind
            self.last_decision = decision and replace(decision, flown_by=("tour",))
            return commands
        if self._repeats is not None:
            if self._has_acted and swarm.step == 0:  # the same mission once more
                self._has_acted = False
                self.reset(self._brief, self._seed)
            swarm = self._repeats.seen(swarm, is_idle(swarm, self._planned))
        self._has_acted = True
        if self._by_legs is not None:
            self.last_decision = None
            return self._by_legs.commands(swarm)
        if self.mission_plan is None:
            self._begin(swarm)
        self._world.update(swarm)
        away = swarm.returning | ~self._handover.workers(swarm)  # they fly without commands
        self._silent = (swarm.status == FLYING) & away
        movers = Movers.seen(self._brief, swarm, self._silent)
        # with a fresh battery pack
        self._back = (swarm.status == FLYING) & self._down
        self._down = swarm.status == LANDED
        swarm = without(swarm, self._silent)
        home = {swarm.names[u]: GoTo(None, "return") for u in np.flatnonzero(self._silent)}
        if self.steering is None and self._failures.are_many:
            self.steering = self._steer()
        if self.steering is not None:
            if self._repeats is not None:
                swarm = self._repeats.open_now(swarm)
            self.last_decision = Decision({})
            commands = {**self.steering.commands(swarm, self._world), **home}
            return commands if self._repeats is None else self._repeats.addressed(commands)
        flying = swarm.status == FLYING
        self._planned = {u: planned for u, planned in self._planned.items() if flying[u]}
        self._follow(swarm, movers)
        reason = self._why_plan_anew(swarm, movers)
        if reason is not None:
            self._make_plan(swarm, movers)
        else:
            self._improve(swarm, movers)
        courses = {u: p.course.rest(swarm.step) for u, p in self._planned.items()}
        idle = [u for u in np.flatnonzero(flying).tolist() if u not in self._planned]
        staying = [u for u in idle if self._stays(u, swarm)]
        chosen = self._safeguard.chosen(swarm, courses, movers, staying)
        return {**self._commands(swarm, flying, chosen, reason), **home}

    def _steer(self) -> Steering:
        assert self.mission_plan is not None
        made = self._fleet, self._brief, self.mission_plan.order
        return Steering(*made, self.options.moves // 10, self.total_weight, self._seed)

    @property
    def total_weight(self) -> float:
        """Worth of a second of each UAS's flight."""
        return order_effort(self.options, len(self._brief.uas)).total_weight

    def _commands(
        self,
        swarm: SwarmState,
        flying: BoolArray,
        chosen: Mapping[int, tuple[Course, bool]],
        reason: str | None,
    ) -> Mapping[str, Command]:
        step, dt_s = swarm.step, self._brief.dt_s
        commands: dict[str, Command] = {}
        self._flown_as_planned = {u for u, (_, as_planned) in chosen.items() if as_planned}
        predicted_m: dict[str, FloatArray] = {}
        flown: dict[int, FloatArray] = {}
        rest: list[int] = []
        fallback = None
        for u in np.flatnonzero(flying).tolist():
            name = swarm.names[u]
            course, as_planned = chosen.get(u, (None, False))
            if self._stays(u, swarm):
                commands[name] = GoTo(None, "return")
                continue
            if not as_planned:
                fallback = fallback or reason or "no backup trajectory"
                self._failures.add(float(self._is_disturbed and swarm.responds[u]))
                if self._without_plan_since[u] < 0:
                    self._without_plan_since[u] = step
            else:
                self._without_plan_since[u] = -1
            waits_s = dt_s * (step - self._without_plan_since[u])
            hovers = course is None or not len(course.u)
            if course is None or (not as_planned and hovers and waits_s >= _HOME_AFTER_S):
                rest.append(u)
                continue
            u_now = hover_inputs(self._fleet, u, swarm.x[u]) if hovers else course.u[0]
            flown[u] = u_now
            mode = "covering" if self._has_work(u, swarm) else "return"
            commands[name] = Wrench(*(float(value) for value in u_now[: S.DELTA_THRUST]), mode=mode)
            predicted_m[name] = course.path_m(max(len(course.u), 1))
        if rest:
            late = [u for u in rest if dt_s * (step - self._without_plan_since[u]) >= _HOME_AFTER_S]
            inputs = self._safeguard.evade(rest, flown, late)
            for u in rest:
                self._safeguard.backups.pop(u, None)
                wrench = (float(value) for value in inputs[u][: S.DELTA_THRUST])
                mode = "return" if u in late else "covering"
                commands[swarm.names[u]] = Wrench(*wrench, mode=mode)
        self.last_decision = Decision(predicted_m, fallback=fallback is not None, reason=fallback)
        return commands

    def _stays(self, uas: int, swarm: SwarmState) -> bool:
        """Whether a UAS has nothing to do and is at home still, or should have landed."""
        if uas in self._planned:
            return self._planned[uas].course.end <= swarm.step
        return not swarm.departed[uas] and not self._has_work(uas, swarm) and swarm.step == 0

    def _has_work(self, uas: int, swarm: SwarmState) -> bool:
        planned = self._planned.get(uas)
        if planned is None:
            return self.mission_plan is not None and uas in self.mission_plan.troubles
        return bool(planned.open_visits(swarm.step, swarm.uncovered).any())

    def _follow(self, swarm: SwarmState, movers: Movers) -> None:
        """Courses from where the UAS are, where that is not where they were planned to be."""
        self._failures.next_step()
        filtered = swarm.filtered if len(swarm.filtered) else np.zeros(len(swarm.x), np.bool_)
        for u, planned in list(self._planned.items()):
            rest = planned.course.rest(swarm.step)
            if rest.begins_at(swarm.x[u]):
                continue
            if u not in self._flown_as_planned:  # nothing pushed it: it flew something else
                del self._planned[u]
                continue
            off = rest.x[0, S.VX : S.VZ + 1] - swarm.x[u, S.VX : S.VZ + 1]
            obeys = swarm.responds[u] and not filtered[u]  # else it flies something else
            self._failures.see(float(obeys * np.linalg.norm(off)))
            if not self._is_disturbed and not filtered[u]:
                self._is_disturbed = True
                self._fleet.leave_room()
                for k in list(self._planned):
                    self._refit(k, self._fleet.program, swarm, movers)
                return
            later = self._refit(u, self._fleet.tracking_program, swarm, movers)
            self._failures.add(float(obeys * later))

    def _refit(self, uas: int, program_of: ProgramOf, swarm: SwarmState, movers: Movers) -> int:
        """Plan the same visits from where a UAS is; steps by which its flight ends later."""
        new = tracked(self._fleet, uas, self._planned, swarm, movers, program_of)
        planned = self._planned.pop(uas)
        if new is not None:
            self._planned[uas], self._ends[uas] = new, new.course.end
        return 0 if new is None else new.course.end - planned.course.end

    def _earliest(self, opens: NDArray[np.int64], later: int) -> NDArray[np.int64]:
        """(W,) steps, from a sample so much later, before which waypoints are not to be visited."""
        if self._repeats is None:
            return np.maximum(opens, 0)
        return np.maximum(opens, self._repeats.steps_until_open - later).clip(0)

    def _why_plan_anew(self, swarm: SwarmState, movers: Movers) -> str | None:
        flying = swarm.status == FLYING
        assert self.mission_plan is not None
        missing = [
            u for u in np.flatnonzero(flying & self._may_fly).tolist() if u not in self._planned
        ]
        waited = self._brief.dt_s * (swarm.step - self._planned_at) >= _AGAIN_S
        if missing and (waited or any(u in self._had for u in missing)):
            return "no plan"
        if not np.array_equal(flying & self._may_fly, self._may_fly & self._flew(swarm)):
            return "a UAS is lost"
        if (flying & self._silent_then).any() or self._back.any():
            return "a UAS is back"
        if waited and self._planned:
            beyond = self._latest_visit < self._planned_at  # no battery reaches them
            known = self.mission_plan.thought_of(swarm, self._planned) | beyond
            if (swarm.uncovered & ~known).any():
                return "missed a waypoint"
        if not len(movers):
            return None
        if len(movers) != len(self._seen) or movers.has_turned(self._seen):
            return "something moves otherwise"
        later_s = self._brief.dt_s * (swarm.step - self._planned_at)
        if waited and movers.off_m(self._seen, later_s) > _PLAN_MARGIN_M:
            return "a UAS without a radio flies otherwise"
        opens = self._fleet.opens(movers)
        if not np.array_equal((opens > 0) & swarm.uncovered, self._blocked & swarm.uncovered):
            return "a waypoint opened or closed"
        if (opens >= NEVER).any():
            for planned in self._planned.values():
                visits = planned.flight.visits + planned.course.begin
                at_last = visits >= self._latest_visit[planned.route]
                soon_s = np.where(at_last, _AT_LAST_S, _SOON_S)
                ahead = visits - swarm.step
                waits = (opens[planned.route] >= NEVER) & swarm.uncovered[planned.route]
                if (waits & (self._brief.dt_s * ahead < soon_s) & (ahead > 0)).any():
                    return "a waypoint is still blocked"
            if not self._is_handed_over and self._waiting.is_left_to_others(
                self._planned, swarm.step, swarm.uncovered
            ):
                return "a UAS that could wait longer is about to fly home"
        return None

    def _flew(self, swarm: SwarmState) -> BoolArray:
        """(U,) UAS that should be flying: by plan they have not ended, and are not home early."""
        ends = np.ones(len(swarm.status), np.bool_)
        for u, end in self._ends.items():
            ends[u] = swarm.step < end
        return ends & ~self._down

    def _make_plan(self, swarm: SwarmState, movers: Movers) -> None:
        first, self._step = self.mission_plan is None and self._order is None, swarm.step
        flying = swarm.status == FLYING
        opens = self._fleet.opens(movers)
        earliest = self._earliest(opens, 0)
        # a flight that had to wait for something may be shorter now
        waits = (opens > 0) if first else (opens > 0) | self._blocked
        left = {u: p.rest(swarm.step, swarm.uncovered) for u, p in self._planned.items()}
        flown = {u: rest for u, rest in left.items() if not waits[rest[0]].any()}
        moment = Moment(swarm.x, flying, swarm.uncovered, earliest, swarm.time_s)
        bodies = {u: self._fleet.bodies(movers, u) for u in range(len(swarm.x))}
        unknown = (opens >= NEVER) & swarm.uncovered
        effort = Effort.of(self.options, moment, self.total_weight, first=first)
        self._latest_visit = np.full(len(unknown), NEVER)
        self._waiting = choose_waiting(self._fleet, self._way_home, moment, unknown)
        if unknown.any():
            latest = self._waiting.latest
            self._latest_visit[unknown] = swarm.step + latest[unknown]
            if self.mission_plan is None:
                opens_at = opens_first(self._fleet, moment, unknown, effort.moves, self._seed)
            else:
                steps_left = [len(p.course.rest(swarm.step).u) for p in self._planned.values()]
                opens_at = opens_again(steps_left, self._brief.dt_s)
            visit = np.minimum(latest, opens_at)
            moment.earliest[unknown] = visit[unknown]
            moment = replace(moment, uncovered=moment.uncovered & ~(unknown & (latest < 0)))
        kept = self._order if self.mission_plan is None else None
        # changes of an order in which one that is back has no part rarely give it one
        back = (flying & self._silent_then).any() or self._back.any()
        if self.mission_plan is not None and (self.mission_plan.order.trips or not back):
            kept = self.mission_plan.order
        seed = self._seed + swarm.step
        fresh = self._fleet.fresh_packs(swarm, moment.uncovered, flown)

        def found(forbidden: BoolArray | None) -> MissionPlan:
            now = replace(moment, forbidden=forbidden)
            return plan_mission(
                self._fleet, now, swarm.step, bodies, effort, seed, kept, flown, fresh
            )

        # before take-off it costs little to have what is blocked visited by one that can wait
        forbidden = None
        if unknown.any() and (first or self._is_handed_over):
            forbidden = self._waiting.forbidden
        plan = found(forbidden)
        if forbidden is None and self._waiting.is_left_to_others(
            plan.planned, swarm.step, swarm.uncovered
        ):
            self._is_handed_over = True
            plan = found(self._waiting.forbidden)
        self.mission_plan, self._planned = plan, dict(plan.planned)
        self.given_up = plan.given_up(self._fleet)
        self._planned_at, self._seen = swarm.step, movers
        self._silent_then, self._blocked = self._silent, opens > 0
        self._may_fly = flying.copy()
        if first:
            for u in range(len(flying)):
                self._may_fly[u] = u in plan.planned or u in plan.troubles
        self._ends = {u: p.course.end for u, p in plan.planned.items()}
        self._had = set(plan.planned)

    def _improve(self, swarm: SwarmState, movers: Movers) -> None:
        """Look for a better plan, where it is known where the UAS will be."""
        plan, flying = self.mission_plan, set(np.flatnonzero(swarm.status == FLYING).tolist())
        assert plan is not None
        followed = self._planned.keys() & self._flown_as_planned
        if self._is_disturbed or self._silent.any() or plan.troubles or not flying <= followed:
            return

        def ahead(then: int, planned: Mapping[int, Planned]) -> Ahead:
            expected = movers.later(then - swarm.step)
            opens = self._fleet.opens(expected)
            unknown = (opens >= NEVER) & swarm.uncovered
            opens[unknown] = 0
            earliest = self._earliest(opens, then - swarm.step)
            for p in planned.values():  # what is blocked is visited as late as planned
                visits = p.flight.visits + p.course.begin - then
                late = unknown[p.route]
                earliest[p.route[late]] = np.maximum(visits[late], 0)
            bodies = {u: self._fleet.bodies(expected, u) for u in range(len(swarm.x))}
            forbidden = self._waiting.forbidden if unknown.any() else None
            if plan.order.trips:  # which UAS visits what is part of a larger plan
                others = all_but_own(planned, (len(swarm.x), len(swarm.uncovered)))
                forbidden = others if forbidden is None else forbidden | others
            return Ahead(earliest, forbidden, bodies)

        better = self._improvement.better(swarm, plan, self._planned, ahead)
        if better is not None:
            order = replace(better.order, left_out=plan.order.left_out, trips=plan.order.trips)
            self.mission_plan = replace(better, order=order)
            self._planned |= better.planned
            self._ends |= {u: p.course.end for u, p in better.planned.items()}

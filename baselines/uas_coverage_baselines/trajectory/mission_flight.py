"""A mission in still air: planned whole, flown as planned, and planned anew where it has to be."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.margins import margins_in
from uas_coverage_baselines.trajectory.course import Course, hover_inputs
from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.mission_plan import is_idle
from uas_coverage_baselines.trajectory.moving_obstacles import MovingObstacles
from uas_coverage_baselines.trajectory.options import TrajectoryOptions
from uas_coverage_baselines.trajectory.plan_in_force import PLAN_MARGIN_M, PlanInForce
from uas_coverage_baselines.trajectory.replanning import Replanning
from uas_coverage_baselines.trajectory.safeguard import Safeguard
from uas_coverage_baselines.trajectory.steering import along_order
from uas_coverage_baselines.trajectory.tracking import Tracking
from uas_coverage_baselines.trajectory.under_way import UnderWay, still_clear
from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.mission import MissionBrief, Range, WorldView, first_sight
from uas_coverage_env.planning.around.handover import away_of, without
from uas_coverage_env.planning.around.repeats import open_now
from uas_coverage_env.planning.decision import Decision
from uas_coverage_env.planning.following import Following
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.scale import length_scale
from uas_coverage_env.world import Command, GoTo, SwarmState, Wrench

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_HOME_AFTER_S = 30.0  # without a plan for so long a UAS flies home


class MissionFlight:
    """Flies one mission.

    Args:
        brief: The mission.
        options: Of the planner.
        seed: Of its searches.
        before: The same mission in a scene that was another, if it is under way.
        goes_on: Whether the mission may be under way: it is planned at the first sample. If not, it
            is planned now, from the starts.

    Attributes:
        in_force: The plan that is flown; None before there is one.
        following: What flies along the order where no flight goes as planned; None: all do.
        decision: About the last step.
    """

    def __init__(
        self,
        brief: MissionBrief,
        options: TrajectoryOptions,
        seed: int,
        before: MissionFlight | None = None,
        *,
        goes_on: bool = False,
    ) -> None:
        self._brief, self._seed, self._moves = brief, seed, options.moves
        self._world, way_home = WorldView(brief), Range(brief)
        margins = margins_in(brief, options.margin_m, options.moving_margin_m)
        scale = length_scale(brief.vehicles, brief.dt_s)
        moving_m = margins.moving_m + scale * PLAN_MARGIN_M
        self._fleet = Fleet(brief, margins.fixed_m, options.speed_share, moving_m)
        self.safeguard = Safeguard(self._fleet, self._world, way_home, margins.moving_m)
        self._replanning = Replanning(self._fleet, way_home, options, seed)
        self._tracking = Tracking(self._fleet)
        self._none = np.zeros(len(brief.uas), np.bool_)
        self._down, self._without_plan_since = self._none, np.full(len(brief.uas), -1)
        self._as_planned: frozenset[int] = frozenset(range(len(brief.uas)))
        self.in_force: PlanInForce | None = None
        self.following: Following | None = None
        self.decision: Decision | None = None
        self._under_way = UnderWay() if before is None else before._kept(brief)
        if not goes_on:
            self._begin(first_sight(brief), self._none, self._none)

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are left out, and why in a few words."""
        return {} if self.in_force is None else self.in_force.plan.given_up(self._fleet)

    def is_idle(self, swarm: SwarmState) -> bool:
        """Whether a UAS flies home, with no visit left."""
        return self.in_force is not None and is_idle(swarm, self.in_force.planned)

    def _kept(self, brief: MissionBrief) -> UnderWay:
        """What was flown, if it may be flown on in this scene."""
        if self.in_force is None:
            return UnderWay()
        order = self.in_force.plan.order
        if not still_clear(self._brief, brief):
            return UnderWay(order)
        return UnderWay(order, self.in_force.planned, self.safeguard.backups)

    def _begin(self, swarm: SwarmState, unresponsive: BoolArray, back: BoolArray) -> PlanInForce:
        """Make the first plan of a mission, or of one under way since its scene is another."""
        before = UnderWay()
        if swarm.step == 0:
            swarm = first_sight(self._brief)
        else:
            before = self._under_way.at(swarm)
        self._world.update(swarm)
        self.safeguard.backups.update(before.backups)
        moving = MovingObstacles.seen(self._brief, swarm, unresponsive)
        self.in_force = self._replanning.made(swarm, moving, before, unresponsive, back)
        return self.in_force

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """A command for each UAS: on as planned, or by a plan made anew."""
        returning = (swarm.status == FLYING) & swarm.returning  # they fly without commands, too
        unresponsive = returning | away_of(swarm)
        if self.in_force is None:
            self._begin(swarm, self._none, self._none)
        assert self.in_force is not None
        self._world.update(swarm)
        moving = MovingObstacles.seen(self._brief, swarm, unresponsive)
        back = (swarm.status == FLYING) & self._down
        self._down = (swarm.status == LANDED) & ~unresponsive
        swarm = without(swarm, returning)
        home = {swarm.names[u]: GoTo(None, "return") for u in np.flatnonzero(returning)}
        if self.following is None and self._tracking.fails:
            self.following = along_order(
                self._fleet, self.in_force.plan.order, self._moves // 10,
                self._replanning.total_weight, self._seed,
            )  # fmt: skip
        if self.following is not None:
            self.decision = Decision()
            return {**self.following.commands(open_now(swarm)), **home}
        flying = swarm.status == FLYING
        self.in_force.keep(flying)
        self._tracking.follow(self.in_force, swarm, moving, self._as_planned)
        reason = self.in_force.why_plan_anew(
            swarm, moving, self._fleet, self._down, back,
            hands_over=not self._replanning.is_handed_over,
        )  # fmt: skip
        if reason is not None:
            self.in_force = self._replanning.made(swarm, moving, self.in_force, unresponsive, back)
        elif not (self._tracking.is_disturbed or unresponsive.any()):
            self._replanning.improve(self.in_force, swarm, moving, self._as_planned)
        planned = self.in_force.planned
        courses = {u: p.course.rest(swarm.step) for u, p in planned.items()}
        staying = [
            u
            for u in np.flatnonzero(flying).tolist()
            if u not in planned and self.in_force.stays(u, swarm)
        ]
        chosen = self.safeguard.chosen(swarm, courses, moving, staying)
        return {**self._commands(swarm, self.in_force, chosen, reason), **home}

    def _commands(
        self,
        swarm: SwarmState,
        in_force: PlanInForce,
        chosen: Mapping[int, tuple[Course, bool]],
        reason: str | None,
    ) -> dict[str, Command]:
        """What was verified, as commands; for UAS without such, the nearest that does no harm."""
        commands: dict[str, Command] = {}
        self._as_planned = frozenset(u for u, (_, as_planned) in chosen.items() if as_planned)
        predicted_m: dict[str, FloatArray] = {}
        flown: dict[int, FloatArray] = {}
        rest: list[int] = []
        fallback = None
        for u in np.flatnonzero(swarm.status == FLYING).tolist():
            name = swarm.names[u]
            course, as_planned = chosen.get(u, (None, False))
            if in_force.stays(u, swarm):
                commands[name] = GoTo(None, "return")
                continue
            self._note(u, swarm, as_planned=as_planned)
            if not as_planned:
                fallback = fallback or reason or "no backup trajectory"
            hovers = course is None or not len(course.u)
            if course is None or (not as_planned and hovers and self._is_late(u, swarm)):
                rest.append(u)
                continue
            u_now = hover_inputs(self._fleet, u, swarm.x[u]) if hovers else course.u[0]
            flown[u] = u_now
            mode = "covering" if in_force.has_work(u, swarm) else "return"
            commands[name] = Wrench(*(float(value) for value in u_now[: S.DELTA_THRUST]), mode=mode)
            predicted_m[name] = course.path_m(max(len(course.u), 1))
        if rest:
            late = [u for u in rest if self._is_late(u, swarm)]
            inputs = self.safeguard.evade(rest, flown, late)
            for u in rest:
                self.safeguard.backups.pop(u, None)
                wrench = (float(value) for value in inputs[u][: S.DELTA_THRUST])
                mode = "return" if u in late else "covering"
                commands[swarm.names[u]] = Wrench(*wrench, mode=mode)
        self.decision = Decision(predicted_m, fallback=fallback is not None, reason=fallback)
        return commands

    def _note(self, uas: int, swarm: SwarmState, *, as_planned: bool) -> None:
        """Note whether a UAS flies as planned, and since when it does not."""
        if as_planned:
            self._without_plan_since[uas] = -1
            return
        self._tracking.flies_without_plan(uas, swarm)
        if self._without_plan_since[uas] < 0:
            self._without_plan_since[uas] = swarm.step

    def _is_late(self, uas: int, swarm: SwarmState) -> bool:
        """Whether a UAS has had no plan for so long that it flies home."""
        waits = swarm.step - self._without_plan_since[uas]
        return bool(self._brief.dt_s * waits >= _HOME_AFTER_S)

"""Algorithm 1: decide, fly the first step, decide again; with what is flown when no plan comes."""

from __future__ import annotations

import dataclasses
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence, Set
from typing import Generic, Self, TypeVar

import numpy as np

from uas_coverage_baselines.milp_mpc.commands import first_inputs, hovering
from uas_coverage_baselines.milp_mpc.fallback.backup import backup_trajectory, still_holds
from uas_coverage_baselines.milp_mpc.fallback.evasion import Asked, evasion
from uas_coverage_baselines.milp_mpc.fallback.reasons import Reason
from uas_coverage_baselines.milp_mpc.fallback.route_following import RouteFollower, Sent
from uas_coverage_baselines.milp_mpc.model.named_blocks import block_named, checked
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem
from uas_coverage_baselines.milp_mpc.options import MovingHorizonOptions
from uas_coverage_baselines.milp_mpc.search.decision import Effort, decide
from uas_coverage_baselines.milp_mpc.search.round_robin import RoundRobin
from uas_coverage_baselines.milp_mpc.silent_uas import SilentUas
from uas_coverage_baselines.milp_mpc.steering import along_order
from uas_coverage_baselines.rehearsal import rehearse_once
from uas_coverage_env.entities.commands import HOME, Mode
from uas_coverage_env.flight import Decision
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.mission.attempts import Attempts
from uas_coverage_env.mission.refusal import refuse_what_asks
from uas_coverage_env.planning.around.handover import away_of
from uas_coverage_env.planning.following import Following
from uas_coverage_env.vehicle.scale import length_scale
from uas_coverage_env.world import Command, SwarmState

_CAREFUL_WITHIN_M = 40.0  # at scale 1: of home a UAS that does not come nearer to it flies slowly

Chosen = TypeVar("Chosen", bound=MovingHorizonOptions)


class MovingHorizon(ABC, Generic[Chosen]):
    """The loop around the OCP; what is planned for is up to the planner that derives from it.

    Args:
        options: of the planner.
        blocks: of the OCP; those that `options.blocks` names come after them.

    Raises:
        InputError: one of the blocks is none.
    """

    def __init__(self, options: Chosen, blocks: Sequence[Block] = OCP) -> None:
        self.options, self._given = options, tuple(checked(block) for block in blocks)
        self.blocks = (*self._given, *(block_named(name) for name in options.blocks))
        self.last_decision: Decision | None = None
        self.last_plan: Plan | None = None  # of the last decision, as it was made
        self.plan: Plan | None = None  # what is left of it, beginning now
        self._backup: Plan | None = None  # likewise, ending in a hover

    @abstractmethod
    def problem(self, swarm: SwarmState) -> PlanningProblem:
        """The decision to make now, for the active UAS."""

    @abstractmethod
    def mode(self, name: str) -> Mode:
        """What a UAS is doing, for the record."""

    @abstractmethod
    def target(self, name: str) -> int | None:
        """The waypoint that a UAS flies to, `world.HOME`, or None where it is to none of them."""

    def waits_for(self) -> Set[int]:
        """Waypoints that moving obstacles block now: waiting for them is no standstill."""
        return frozenset()

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are given up, and why in a few words."""
        return self._attempts.given_up

    def rehearsal(self) -> Self:
        """The same planner with a short horizon, and no limit while everything is compiled."""
        quick = self.options.model_copy(update={"time_limit_s": None, "horizon": 8})
        return type(self)(quick, self._given)

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile what a decision compiles, on the first one of the first mission of its kind."""
        choices = {k: v for k, v in self.options if isinstance(v, str | tuple)}
        has = (brief.conditions, brief.obstacles, brief.moving_obstacles, brief.uas[1:])
        kinds = (type(self), *map(type, self.blocks), *choices.items(), *map(bool, has))
        rehearse_once(kinds, lambda: self._rehearse(brief))

    def _rehearse(self, brief: MissionBrief) -> None:
        rehearsal = self.rehearsal()
        rehearsal.reset(brief, 0)
        swarm = first_sight(brief)
        rehearsal.act(swarm)
        problem = rehearsal.problem(swarm)
        evasion(problem, brief.dt_s)
        last = dataclasses.replace(swarm, step=brief.max_steps)
        rehearsal._follower.apply(problem, last, None, ())

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Start a mission."""
        refuse_what_asks(brief)
        self.dt_s = brief.dt_s
        stated = brief.conditions is not None
        self._steering: Following | None = None
        if stated and self.options.in_wind == "guidance":
            self._steering = along_order(brief, seed)
        self.last_plan = self.plan = self._backup = None
        self._round_robin = RoundRobin()
        margins = self.options.margins(brief)
        self._near_home_m = length_scale(brief.vehicles, brief.dt_s) * _CAREFUL_WITHIN_M
        radius_m = {uas.name: uas.radius_m for uas in brief.uas}
        self._asked = Asked(radius_m, margins, brief.geofence.margin_m)
        self._follower = RouteFollower(brief, margins.fixed_m, self.blocks)
        self._returning_home = frozenset[str]()  # UAS that fly home since their charge runs short
        self._attempts = Attempts(brief)
        self._silent_uas = SilentUas(brief, margins.moving_m)
        self._called = set[str]()  # UAS whose plans have left no charge but for the way home
        self.last_decision = None

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Decide for every active UAS: one step of Algorithm 1."""
        if not swarm.active:
            return {}
        if self._steering is not None:
            self.last_decision = Decision()
            return self._steering.commands(swarm)
        began, self._returning_home = time.perf_counter(), frozenset[str]()
        wanted = self._attempts.wanted(swarm.uncovered)
        seen = swarm if wanted is swarm.uncovered else dataclasses.replace(swarm, uncovered=wanted)
        problem = self._silent_uas.beside(self.problem(seen), swarm, away_of(swarm))
        self._called &= set(swarm.active)  # with a fresh pack it need not fly home
        if any(plan and set(problem.names) - set(plan.names) for plan in (self.plan, self._backup)):
            self.plan = self._backup = None  # one that is back has a part in neither
        overruled = self._overruled(problem, swarm)
        found = decide(
            problem,
            self.plan,
            self.dt_s,
            self._effort(),
            backup=self._backup,
            began=began,
            round_robin=self._round_robin,
            blocks=self.blocks,
        )
        plan = backup = None
        if isinstance(found, Reason):
            reason = found
        else:
            plan, backup = found, backup_trajectory(problem, found, self.dt_s, self.blocks)
            reason = Reason.NO_BACKUP if backup is None else None
        if reason is not None:
            plan = backup = self._backup
            if backup is None or not still_holds(problem, backup, self.blocks):
                plan = backup = evasion(problem, self.dt_s, backup, self._asked)
        renewed = () if reason or plan is None else plan.renewed
        followed = self._follower.apply(
            problem, swarm, backup, renewed, {name: to for name, (to, _) in overruled.items()}
        )
        if followed is not None:
            plan = backup = followed.plan
            self._returning_home = followed.home
            reasons = [why for name, (_, why) in overruled.items() if name in followed.names]
            reason = reason or next(iter(reasons), None)
        if plan is None or backup is None:
            return self._hover(swarm, reason)
        self.last_plan = plan
        self.plan, self._backup = plan.advanced(), backup.advanced()
        paths = {name: path for name, path in plan.positions().items() if name in swarm.active}
        gap = None if reason else plan.relative_gap()
        late = Reason.CUT_SHORT if plan.cut_short else None
        self.last_decision = Decision(paths, reason is not None, gap, reason or late)
        return first_inputs(plan, swarm, self._announced)

    def _overruled(
        self, problem: PlanningProblem, swarm: SwarmState
    ) -> dict[str, tuple[Sent, Reason]]:
        """UAS that follow a route whatever is planned: where to, and why."""
        targets = {name: self.target(name) for name in problem.names}
        known = {name: target for name, target in targets.items() if target is not None}
        blocked = np.zeros(len(swarm.uncovered), np.bool_)
        blocked[list(self.waits_for())] = True
        self._attempts.update(swarm, known, blocked)
        result: dict[str, tuple[Sent, Reason]] = {}
        for uas, name in enumerate(problem.names):
            if self._follower.has_to_return(problem, uas):
                self._called.add(name)
            target = HOME if name in self._called else known.get(name)
            if target is None:
                continue
            hard = self._attempts.is_hard(swarm.names.index(name), target)
            # the whole way home flown slowly takes more charge than there is
            careful = hard and (target != HOME or self._is_near_home(problem, uas))
            if name in self._called:
                result[name] = Sent(HOME, careful), Reason.CHARGE
            elif hard:
                result[name] = Sent(target, careful), Reason.STANDSTILL
        return result

    def _is_near_home(self, problem: PlanningProblem, uas: int) -> bool:
        away_m = problem.x0[uas, :2] - problem.home_m[uas, :2]
        return float(np.hypot(*away_m)) < self._near_home_m

    def _effort(self) -> Effort:
        return Effort(
            work=self.options.effort * min(self.dt_s, 1.0),  # shorter steps are due sooner
            threads=self.options.threads,
            teams=self.options.teams,
            at_once=self.options.at_once,
            solver=self.options.solver,
            time_limit_s=self.options.time_limit_s,
        )

    def _announced(self, name: str) -> Mode:
        return "return" if name in self._returning_home else self.mode(name)

    def _hover(self, swarm: SwarmState, reason: Reason | None) -> dict[str, Command]:
        """Brake and hold with the vehicle's inner loop: there is neither plan nor backup."""
        self.last_plan = self.plan = self._backup = None
        paths = {name: swarm.x[[swarm.names.index(name)], 0:3] for name in swarm.active}
        self.last_decision = Decision(paths, fallback=True, reason=reason)
        return hovering(swarm, self.mode)

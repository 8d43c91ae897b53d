"""The paper's decisions: operation modes choose each UAS's target, the OCP's data follow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem, Target
from uas_coverage_baselines.milp_mpc.modes import Mode as ModeOfUas
from uas_coverage_baselines.milp_mpc.modes import (
    ModeMemory,
    Situation,
    TargetChoice,
    target_of,
    update_modes,
)
from uas_coverage_baselines.milp_mpc.options import ModeOptions
from uas_coverage_baselines.milp_mpc.problem_builder import ProblemBuilder
from uas_coverage_baselines.milp_mpc.return_rule import ReturnRule
from uas_coverage_env.entities.commands import HOME, Mode
from uas_coverage_env.mission import MissionBrief, Ways
from uas_coverage_env.scenario import Uas
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.scale import length_scale
from uas_coverage_env.world import SwarmState

_FARTHEST = 4.0  # horizons of cruising: with a metre's cost as low as this a UAS still sets off


class ModeProblems:
    """Algorithms 2 and 3 before each decision, with the memory they need.

    Args:
        brief: the mission.
        options: of the planner.
        ways: past the fixed obstacles; where None, targets are aimed at straight, as the paper's.
        farthest: with ways, targets farther than so many horizons of cruising cost no less a metre.
    """

    def __init__(
        self,
        brief: MissionBrief,
        options: ModeOptions,
        ways: Ways | None = None,
        farthest: float = _FARTHEST,
    ) -> None:
        self._farthest = np.inf if ways is None else farthest
        self._options, self._weights = options, options.weights
        self._scale = length_scale(brief.vehicles, brief.dt_s)
        self._choice = TargetChoice(
            distance_scale_m=self._scale * TargetChoice.distance_scale_m,
            height_scale_m=self._scale * TargetChoice.height_scale_m,
            among_candidates=options.target_scale == "candidates",
        )
        self._builder = ProblemBuilder(brief, options, ways)
        self.blocked: set[int] = set()
        self._planless: dict[str, int] = {}  # the nearest open waypoint of UAS without any plan
        self._memories = {uas.name: ModeMemory() for uas in brief.uas}
        detours = [
            options.return_detour if _by_waypoints(options, uas) else None for uas in brief.uas
        ]
        self._return_rule = ReturnRule(brief, detours, ways)
        self._beyond: dict[str, frozenset[int]] = {}

    def mode(self, name: str) -> Mode:
        """The operation mode of a UAS."""
        return self._memories[name].mode.label

    def target(self, name: str) -> int | None:
        """The waypoint or home that a UAS flies to; None while it covers what is around it."""
        memory = self._memories[name]
        if memory.mode is ModeOfUas.RETURN:
            return HOME
        return self._planless.get(name) if memory.waypoint is None else memory.waypoint

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints for which a UAS had no charge left when it was last looked at, and how much."""
        beyond = sorted(set().union(*self._beyond.values()))
        return dict.fromkeys(beyond, f"beyond what is kept back ({self._return_rule})")

    def problem(self, swarm: SwarmState, plan: Plan | None) -> PlanningProblem:
        """The decision to make now.

        Args:
            swarm: what is seen.
            plan: what is left of the last plan, beginning now.
        """
        planned = _still_planned(plan)
        self.blocked = self._builder.blocked_waypoints(swarm)
        situations = [self._situation(swarm, name, planned.get(name)) for name in swarm.active]
        memories = update_modes(
            [self._memories[name] for name in swarm.active],
            situations,
            self._builder.waypoints_m,
            set().union(*planned.values()),
            self.blocked,
            self._choice,
        )
        self._memories.update(zip(swarm.active, memories, strict=True))
        self._planless = self._nearest(swarm, situations) if plan is None else {}
        targets = self._targets(swarm, situations)
        return self._builder.problem(swarm, targets, self._weights, self._options.priority_per_s)

    def _situation(self, swarm: SwarmState, name: str, planned: set[int] | None) -> Situation:
        x, rule = swarm.x[swarm.names.index(name)], self._return_rule
        beyond = rule.beyond(name, x[0:3], float(x[S.DOD]), swarm.uncovered)
        self._beyond[name] = frozenset(beyond)
        return Situation(
            position_m=x[0:3],
            velocity_mps=x[S.VX : S.VZ + 1],
            dod=float(x[S.DOD]),
            dod_return=rule.dod_return(name, x[0:3], swarm.uncovered),
            uncovered=swarm.uncovered,
            plans_coverage=planned is None or bool(planned),
            beyond=self._beyond[name],
        )

    def _targets(
        self, swarm: SwarmState, situations: Sequence[Situation]
    ) -> dict[str, Target | None]:
        # near home the normalised cost of flying away outweighs all coverage: where distances
        # within the horizon count alike, a UAS goes on covering there
        level = self._options.return_scale == "horizon"
        return {
            name: self._led_round(
                name,
                now,
                target_of(
                    self._memories[name],
                    now,
                    self._builder.home_m[name],
                    self._builder.waypoints_m,
                    self._builder.seconds_left(name, now.dod),
                    self._builder.seconds_home(name, now.position_m),
                    self._builder.horizon_m(name) if level else 0.0,
                    self._weights,
                    self._farthest * self._builder.horizon_m(name),
                    self._scale,
                ),
            )
            for name, now in zip(swarm.active, situations, strict=True)
        }

    def _led_round(self, name: str, now: Situation, target: Target | None) -> Target | None:
        """The target, or the next corner of the way there where an obstacle shades it."""
        if target is None:
            return None
        to = HOME if target.waypoint is None else target.waypoint
        speed_mps = float(np.hypot(*now.velocity_mps[:2]))
        way = self._builder.way(name, to, now.position_m, speed_mps)
        if way is None:
            return target
        return replace(target, position_m=self._builder.aim_m(name, now.position_m, way))

    def _nearest(self, swarm: SwarmState, situations: Sequence[Situation]) -> dict[str, int]:
        """The open waypoint nearest to each UAS."""
        open_now = np.flatnonzero(swarm.uncovered)
        if not len(open_now):
            return {}
        waypoints_m = self._builder.waypoints_m[open_now]
        return {
            name: int(open_now[np.linalg.norm(waypoints_m - now.position_m, axis=1).argmin()])
            for name, now in zip(swarm.active, situations, strict=True)
        }


def _by_waypoints(options: ModeOptions, uas: Uas) -> bool:
    """Whether D_r,max of a UAS is the way home by an open waypoint."""
    if options.return_rule is None:
        # that of a vehicle is the way back to where it has started, however near that is
        return uas.home_m != uas.start_m
    return options.return_rule == "waypoints"


def _still_planned(plan: Plan | None) -> dict[str, set[int]]:
    """The waypoints that a plan still covers, by UAS."""
    if plan is None:
        return {}
    return {
        name: set(np.flatnonzero(covers.any(axis=0)).tolist())
        for name, covers in zip(plan.names, plan.covers, strict=True)
    }

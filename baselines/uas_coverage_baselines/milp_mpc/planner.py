"""The moving-horizon planner: Algorithm 1 around the OCP, with its modes and its fallbacks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from pydantic import Field

from uas_coverage_baselines.milp_mpc.braking import still_holds, way_out
from uas_coverage_baselines.milp_mpc.decision import Effort, decide
from uas_coverage_baselines.milp_mpc.modes import (
    Memory,
    Situation,
    TargetChoice,
    target_of,
    update_modes,
)
from uas_coverage_baselines.milp_mpc.problem import Plan, Target, Weights
from uas_coverage_baselines.milp_mpc.surroundings import Surroundings
from uas_coverage_env.flight import Decision, PlannerOptions
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import DOD, LIFT, TAU_X, TAU_Y, TAU_Z
from uas_coverage_env.world import Command, SwarmState, Velocity, World, Wrench


class Options(PlannerOptions):
    """Options of `milp-mpc`; the defaults are the paper's table and our tuning."""

    time_limit_s: float = Field(
        default=1.0, gt=0.0, le=3600.0, description="wall clock per decision"
    )
    threads: int = Field(default=2, ge=1, le=64, description="programs solved side by side")
    horizon: int = Field(default=18, ge=8, le=60, description="N, steps of the prediction")
    solver: Literal["highs"] = Field(default="highs", description="MILP solver")
    deterministic: bool = Field(
        default=False,
        description="limit work by nodes, not by the clock: the same seed flies the same",
    )
    obstacle_sides: int = Field(default=8, ge=4, le=32, multiple_of=2, description="H_O")
    waypoint_sides: int = Field(default=4, ge=4, le=16, multiple_of=4, description="H_WP")
    margin_m: float = Field(
        default=0.3,
        ge=0.0,
        le=10.0,
        description="added to every clearance, for the path between samples",
    )
    moving_margin_m: float = Field(
        default=3.0,
        ge=0.0,
        le=50.0,
        description="added for a moving obstacle's next change of velocity",
    )
    priority_per_s: float = Field(
        default=0.15,
        ge=0.0,
        le=10.0,
        description="added to a waypoint's weight per second its coverage takes off the way left",
    )
    return_detour: float = Field(
        default=2.5,
        ge=1.0,
        le=20.0,
        description="D_r,max over the distance from home to the fence's far corner",
    )
    teams: int = Field(
        default=6, ge=1, le=20, description="constructed teams whose flights are refined"
    )


class MilpMpc:
    """The paper's energy-aware MILP-MPC (Gasche et al., Sec. III), solved with HiGHS."""

    Options = Options

    def __init__(self, options: Options | None = None) -> None:
        self.options = options or Options()
        self.last_decision: Decision | None = None
        self._weights, self._choice = Weights(), TargetChoice()

    def warm_up(self, scenario: Scenario) -> None:
        """Compile what a decision compiles, on the scenario's first one."""
        world = World(scenario)
        world.reset()
        rehearsal = MilpMpc(self.options.model_copy(update={"time_limit_s": 10.0}))
        rehearsal.reset(scenario, 0)
        rehearsal.act(world.swarm_state())

    def reset(self, scenario: Scenario, seed: int) -> None:
        """Start a mission; the planner draws no lots, so the seed changes nothing."""
        self._around = Surroundings(scenario, self.options)
        self._memories = {uas.name: Memory() for uas in scenario.uas}
        self._plan: Plan | None = None  # what is left of the last plan, beginning now
        self._way_out: Plan | None = None  # likewise, ending in a hover
        self.last_decision = None

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Decide for every active UAS: one step of Algorithm 1."""
        if not swarm.active:
            return {}
        situations = [self._situation(swarm, name) for name in swarm.active]
        memories = update_modes(
            [self._memories[name] for name in swarm.active],
            situations,
            self._around.waypoints_m,
            self._planned_waypoints(),
            self._around.blocked_waypoints(swarm),
            self._choice,
        )
        self._memories.update(zip(swarm.active, memories, strict=True))
        problem = self._around.problem(swarm, self._targets(swarm, situations), self._weights)
        dt_s = self._around.dt_s
        plan, fallback = decide(problem, self._plan, dt_s, self._effort()), False
        out = None if plan is None else way_out(problem, plan, dt_s)
        if plan is None or out is None:
            plan, out, fallback = self._way_out, self._way_out, True
        if plan is None or out is None or (fallback and not still_holds(problem, out)):
            return self._hover(swarm, situations)
        self._plan, self._way_out = plan.advanced(), out.advanced()
        self.last_decision = Decision(
            plan.positions(), fallback, None if fallback else plan.relative_gap()
        )
        return {name: self._command(plan, name) for name in swarm.active}

    def _situation(self, swarm: SwarmState, name: str) -> Situation:
        x = swarm.x[swarm.names.index(name)]
        covering = self._plan is None or name not in self._plan.names
        return Situation(
            position_m=x[0:3],
            velocity_mps=x[3:6],
            dod=float(x[DOD]),
            dod_return=self._around.dod_return(name),
            uncovered=swarm.uncovered,
            plans_coverage=covering or bool(self._still_planned(name)),
        )

    def _still_planned(self, name: str) -> set[int]:
        if self._plan is None or name not in self._plan.names:
            return set()
        return set(np.flatnonzero(self._plan.covers[self._plan.of(name)].any(axis=0)).tolist())

    def _planned_waypoints(self) -> set[int]:
        names = () if self._plan is None else self._plan.names
        return set().union(*(self._still_planned(name) for name in names))

    def _targets(
        self, swarm: SwarmState, situations: Sequence[Situation]
    ) -> dict[str, Target | None]:
        return {
            name: target_of(
                self._memories[name],
                now,
                self._around.home_m[name],
                self._around.waypoints_m,
                self._around.seconds_left(name, now.dod),
                self._around.seconds_home(name, now.position_m),
                self._around.horizon_m(name),
                self._weights,
            )
            for name, now in zip(swarm.active, situations, strict=True)
        }

    def _effort(self) -> Effort:
        return Effort(
            time_limit_s=self.options.time_limit_s,
            threads=self.options.threads,
            deterministic=self.options.deterministic,
            teams=self.options.teams,
        )

    def _command(self, plan: Plan, name: str) -> Wrench:
        wrench = plan.u[plan.of(name), 0]
        return Wrench(
            float(wrench[LIFT]),
            float(wrench[TAU_X]),
            float(wrench[TAU_Y]),
            float(wrench[TAU_Z]),
            mode=self._memories[name].mode.label,
        )

    def _hover(self, swarm: SwarmState, situations: Sequence[Situation]) -> dict[str, Command]:
        """Brake and hold with the vehicle's inner loop: no plan has come, no way out holds."""
        self._plan = self._way_out = None
        here = {n: s.position_m for n, s in zip(swarm.active, situations, strict=True)}
        self.last_decision = Decision({n: p[None] for n, p in here.items()}, fallback=True)
        return {
            name: Velocity(0.0, 0.0, -float(p[2]), mode=self._memories[name].mode.label)
            for name, p in here.items()
        }

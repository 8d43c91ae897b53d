"""Algorithm 1: decide, fly the first step, decide again; with what is flown when no plan comes."""

from __future__ import annotations

import dataclasses
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Generic, Literal, Self, TypeVar

from pydantic import Field, field_validator

from uas_coverage_baselines.milp_mpc.braking import still_holds, way_out
from uas_coverage_baselines.milp_mpc.decision import Effort, decide
from uas_coverage_baselines.milp_mpc.evasion import evasion
from uas_coverage_baselines.milp_mpc.homing import WayHome
from uas_coverage_baselines.milp_mpc.problem import Plan, PlanningProblem
from uas_coverage_baselines.milp_mpc.solvers import solver_named
from uas_coverage_baselines.milp_mpc.turns import Turns
from uas_coverage_env.flight import Decision, PlannerOptions
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import LIFT, TAU_X, TAU_Y, TAU_Z
from uas_coverage_env.world import Command, Mode, SwarmState, Velocity, World, Wrench


class MovingHorizonOptions(PlannerOptions):
    """What every MILP-MPC takes; the defaults are the paper's table and our tuning."""

    time_limit_s: float = Field(
        default=1.0, gt=0.0, le=3600.0, description="wall clock per decision"
    )
    threads: int = Field(default=2, ge=1, le=64, description="programs solved side by side")
    horizon: int = Field(default=18, ge=8, le=60, description="N, steps of the prediction")
    solver: Literal["highs", "scip", "gurobi"] = Field(default="highs", description="MILP solver")
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
    teams: int = Field(
        default=6, ge=1, le=20, description="constructed teams whose flights are refined"
    )
    at_once: int = Field(
        default=64,
        ge=1,
        le=64,
        description="UAS planned anew in a decision, at most; the others go on with their plans",
    )

    @field_validator("solver")
    @classmethod
    def _installed(cls, name: str) -> str:
        solver_named(name)
        return name


Chosen = TypeVar("Chosen", bound=MovingHorizonOptions)


class MovingHorizon(ABC, Generic[Chosen]):
    """The loop around the OCP; what is planned for is up to the planner that derives from it."""

    def __init__(self, options: Chosen) -> None:
        self.options = options
        self.last_decision: Decision | None = None
        self.plan: Plan | None = None  # what is left of the last plan, beginning now
        self._way_out: Plan | None = None  # likewise, ending in a hover

    @abstractmethod
    def problem(self, swarm: SwarmState) -> PlanningProblem:
        """The decision to make now, for the active UAS."""

    @abstractmethod
    def mode(self, name: str) -> Mode:
        """What a UAS is doing, for the record."""

    @abstractmethod
    def rehearsal(self) -> Self:
        """The same planner with time enough to compile everything."""

    def warm_up(self, scenario: Scenario) -> None:
        """Compile what a decision compiles, on the scenario's first one."""
        world = World(scenario)
        world.reset()
        rehearsal = self.rehearsal()
        rehearsal.reset(scenario, 0)
        swarm = world.swarm_state()
        rehearsal.act(swarm)
        problem = rehearsal.problem(swarm)
        evasion(problem, scenario.dt_s)
        last = dataclasses.replace(swarm, step=scenario.max_steps)
        rehearsal._way_home.turned_home(problem, last, None, ())

    def reset(self, scenario: Scenario, seed: int) -> None:
        """Start a mission."""
        self.dt_s = scenario.dt_s
        self.plan = self._way_out = None
        self._turns = Turns()
        self._way_home = WayHome(scenario, self.options.margin_m)
        self._homing = frozenset[str]()  # who flies home since its charge runs short
        self.last_decision = None

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Decide for every active UAS: one step of Algorithm 1."""
        if not swarm.active:
            return {}
        began, fallback, self._homing = time.perf_counter(), False, frozenset[str]()
        problem = self.problem(swarm)
        plan = decide(
            problem,
            self.plan,
            self.dt_s,
            self._effort(),
            out=self._way_out,
            began=began,
            turns=self._turns,
        )
        out = None if plan is None else way_out(problem, plan, self.dt_s)
        if plan is None or out is None:
            plan, out, fallback = self._way_out, self._way_out, True
        if plan is None or out is None or (fallback and not still_holds(problem, out)):
            plan = out = evasion(problem, self.dt_s)
        renewed = () if fallback or plan is None else plan.renewed
        turned = self._way_home.turned_home(problem, swarm, out, renewed)
        if turned is not None:
            (plan, self._homing), out = turned, turned[0]
        if plan is None or out is None:
            return self._hover(swarm)
        self.plan, self._way_out = plan.advanced(), out.advanced()
        paths = {name: path for name, path in plan.positions().items() if name in swarm.active}
        self.last_decision = Decision(paths, fallback, None if fallback else plan.relative_gap())
        return {name: self._command(plan, name) for name in swarm.active}

    def _effort(self) -> Effort:
        return Effort(
            time_limit_s=self.options.time_limit_s,
            threads=self.options.threads,
            deterministic=self.options.deterministic,
            teams=self.options.teams,
            at_once=self.options.at_once,
            solver=self.options.solver,
        )

    def _command(self, plan: Plan, name: str) -> Wrench:
        wrench = plan.u[plan.of(name), 0]
        return Wrench(
            float(wrench[LIFT]),
            float(wrench[TAU_X]),
            float(wrench[TAU_Y]),
            float(wrench[TAU_Z]),
            mode="return" if name in self._homing else self.mode(name),
        )

    def _hover(self, swarm: SwarmState) -> dict[str, Command]:
        """Brake and hold with the vehicle's inner loop: no plan has come, no way out holds."""
        self.plan = self._way_out = None
        here = {name: swarm.x[swarm.names.index(name), 0:3] for name in swarm.active}
        self.last_decision = Decision({n: p[None] for n, p in here.items()}, fallback=True)
        return {
            name: Velocity(0.0, 0.0, -float(p[2]), mode=self.mode(name)) for name, p in here.items()
        }

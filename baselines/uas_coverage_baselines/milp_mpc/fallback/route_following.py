"""Routes flown without a solver: home on the last charge, and out of a standstill.

A backup trajectory ends in a hover, which uses up the battery. Where a UAS has had no new plan and
could soon not come home any more, it takes the way home that the world's guidance would fly (`GoTo`
home), some steps of it and then the brakes, verified like any other backup trajectory. So at every
later decision there is either more of the way home or the rest of this one. The same is flown in
place of a plan where the plan leaves no charge for the way home, and, to a waypoint or home, where
plans have led nowhere for too long.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.fallback.backup import course_of, prolonged
from uas_coverage_baselines.milp_mpc.model.appraisal import trouble
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem
from uas_coverage_env.autopilot.control import command_wrench
from uas_coverage_env.autopilot.guidance import guide
from uas_coverage_env.autopilot.return_path import flight_home
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.entities.commands import COMMAND_DTYPE, HOME
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.approach import carefully, with_free_aims
from uas_coverage_env.planning.backup.course import Course, braked
from uas_coverage_env.planning.reserves import ROUTE_HOME_RESERVE
from uas_coverage_env.vehicle import compile_vehicle, lpv_step
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.inner_loop import reseed_reference, velocity_climb_wrench
from uas_coverage_env.vehicle.range import dod_per_s
from uas_coverage_env.vehicle.scale import braking_s
from uas_coverage_env.world import SwarmState, build_arena

FloatArray = NDArray[np.float64]
_PURSUED_S = (8.0, 4.0, 2.0, 1.0)  # how long the way home is followed before the brakes
_LONGEST_WAY_S = 900.0
_NEXT_STEPS = 2  # a decision later it is later by a step, and as far again away


@dataclass(frozen=True)
class Sent:
    """The route that a UAS is to follow.

    Attributes:
        target: waypoint of the scenario, or `world.HOME`.
        careful: whether slowly.
    """

    target: int
    careful: bool = False


@dataclass(frozen=True)
class Followed:
    """Backup trajectories of which some follow routes.

    Attributes:
        plan: of all UAS.
        names: the UAS that follow routes.
        home: those of them that fly home.
    """

    plan: Plan
    names: frozenset[str]
    home: frozenset[str]


class RouteFollower:
    """The guidance's ways in a mission.

    Args:
        brief: the mission.
        margin_m: kept in addition to every safe distance.
        blocks: of the OCP; what of their rows the guidance breaks is not flown.
    """

    def __init__(self, brief: MissionBrief, margin_m: float, blocks: Sequence[Block] = OCP) -> None:
        self._blocks = blocks
        wider = [
            obstacle.model_copy(update={"safe_distance_m": obstacle.safe_distance_m + margin_m})
            for obstacle in brief.obstacles
        ]
        aims = with_free_aims(brief).waypoints
        fence = brief.geofence
        fence = fence.model_copy(update={"margin_m": fence.margin_m + margin_m})
        self._arena = build_arena(
            brief.model_copy(
                update={"obstacles": tuple(wider), "geofence": fence, "waypoints": aims}
            ).as_scenario()
        )
        self._careful = carefully(self._arena)
        self._brief = brief
        self._row = {uas.name: row for row, uas in enumerate(brief.uas)}

    def apply(
        self,
        problem: PlanningProblem,
        swarm: SwarmState,
        backup: Plan | None,
        planned: Collection[str],
        sent: Mapping[str, Sent] | None = None,
    ) -> Followed | None:
        """The backup trajectories, some of them replaced by routes; None where none is.

        Args:
            problem: the decision.
            swarm: what is seen.
            backup: what is flown otherwise; None: every UAS brakes.
            planned: names of the UAS with a new plan, which sees to it itself.
            sent: UAS that are to follow a route whether they have a plan or not.
        """
        sent = sent or {}
        left_s = {
            uas: self._left_at_home_s(problem, swarm, uas)
            for uas, name in enumerate(problem.names)
            if name not in planned and (name not in sent or sent[name].target != HOME)
        }
        short = sorted((s, uas) for uas, s in left_s.items() if s < ROUTE_HOME_RESERVE.kept_s)
        # ways home before any others
        routes = {name: route for name, route in sent.items() if route.target == HOME}
        routes |= {problem.names[uas]: Sent(HOME) for _, uas in short}
        routes |= {name: route for name, route in sent.items() if name not in routes}
        followed: dict[str, int] = {}
        for name, route in routes.items():
            for pursued_s in _PURSUED_S:
                trial = self._replaced(problem, backup, problem.names.index(name), pursued_s, route)
                moving = prolonged(problem, trial.u.shape[1])
                if trouble(replace(problem, moving=moving), trial, self._blocks) is None:
                    backup = trial
                    followed[name] = route.target
                    break
        if backup is None or not followed:
            return None
        home = frozenset(name for name, target in followed.items() if target == HOME)
        return Followed(backup, frozenset(followed), home)

    def has_to_return(self, problem: PlanningProblem, uas: int) -> bool:
        """Whether a UAS has no more charge than its way home takes, with margin (`mission.Range`).

        Args:
            problem: the decision.
            uas: row of the UAS.
        """
        x, most = problem.x0[uas], float(problem.dod_max[uas])
        left_s = (most - float(x[S.DOD])) / dod_per_s(problem.vehicles[uas], most)
        home_s = sum(flight_home(self._arena, self._row[problem.names[uas]], x))
        return left_s - home_s < _NEXT_STEPS * self._brief.dt_s

    def _left_at_home_s(self, problem: PlanningProblem, swarm: SwarmState, uas: int) -> float:
        """Flight time that battery and mission still give once it is home; -inf: never there."""
        rules, x = self._brief, problem.x0[uas]
        most = float(problem.dod_max[uas])
        per_s = dod_per_s(problem.vehicles[uas], most)
        clock_s = (rules.max_steps - swarm.step) * rules.dt_s
        roughly_s = sum(flight_home(self._arena, self._row[problem.names[uas]], x))
        left_s = min((most - float(x[S.DOD])) / per_s, clock_s) - roughly_s
        if left_s > ROUTE_HOME_RESERVE.kept_s:
            return left_s
        steps = int(np.ceil(_LONGEST_WAY_S / rules.dt_s))
        states, _ = self._flown(problem, uas, steps, steps)
        away_m = np.linalg.norm(states[:, :3] - problem.home_m[uas], axis=1)
        slow = np.linalg.norm(states[:, S.VX : S.VZ + 1], axis=1) < rules.landing_speed_mps
        there = np.flatnonzero((away_m <= rules.landing_distance_m) & slow)
        if not len(there):
            return -np.inf
        battery_s = (most - float(states[there[0], S.DOD])) / per_s
        return min(battery_s, clock_s - int(there[0]) * rules.dt_s)

    def _replaced(
        self,
        problem: PlanningProblem,
        backup: Plan | None,
        uas: int,
        pursued_s: float,
        route: Sent,
    ) -> Plan:
        """The backup trajectories with that of one UAS replaced by its route."""
        dt_s = self._brief.dt_s
        pursued = max(round(pursued_s / dt_s), 1)
        steps = pursued + int(np.ceil(braking_s(self._brief.vehicles, dt_s) / dt_s))
        steps = steps if backup is None else max(steps, backup.u.shape[1])
        flown = []
        for row, name in enumerate(problem.names):
            if row == uas:
                flown.append(self._flown(problem, row, pursued, steps, route))
                continue
            here = Course(0, problem.x0[row, None], np.zeros((0, 5)), False)
            left = here if backup is None else course_of(backup, name)
            record = compile_vehicle(problem.vehicles[row], dt_s)[()]
            held = braked(record, left, len(left.u), steps - len(left.u))
            flown.append((held.x, held.u))
        x, u = (np.array([flight[k] for flight in flown]) for k in range(2))
        covers = np.zeros((problem.n_uas, steps, problem.n_scenario_waypoints), bool)
        return Plan(problem.names, x, u, covers, 0.0, -np.inf)

    def _flown(
        self,
        problem: PlanningProblem,
        uas: int,
        pursued: int,
        steps: int,
        route: Sent | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """States (steps+1, 14) and inputs (steps, 5) of a route, then the brakes."""
        command = np.zeros(1, COMMAND_DTYPE)
        row = self._row[problem.names[uas]]
        arena, target = self._arena, HOME
        if route is not None:
            arena, target = self._careful if route.careful else arena, route.target
        return _pursued(arena, row, problem.x0[uas], target, pursued, steps, command)


@allocating_kernel
def _pursued(arena, i, start, target, pursued, steps, commands):
    states, inputs = np.empty((steps + 1, start.shape[0])), np.zeros((steps, 5))
    x, reference = start.copy(), np.empty(2)
    vehicle, command = arena.vehicles[i], commands[0]
    reseed_reference(vehicle, x, reference)
    states[0] = x
    for step in range(steps):
        if step < pursued:
            guide(arena, i, x, reference, target, True, False, command)
            command_wrench(vehicle, x, reference, command, inputs[step])
        else:
            velocity_climb_wrench(vehicle, x, reference, 0.0, 0.0, 0.0, inputs[step])
        lpv_step(vehicle, x, inputs[step], x)
        states[step + 1] = x
    return states, inputs

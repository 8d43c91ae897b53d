"""Decisions of a flight as programs: the paper's size, and smaller ones to be solved."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem
from uas_coverage_baselines.milp_mpc.planner import MilpMpc, MilpMpcOptions
from uas_coverage_baselines.milp_mpc.problem_builder import ProblemBuilder
from uas_coverage_env.entities.state import FLYING, LANDED, LOST
from uas_coverage_env.flight import MODES, Flight, covered_at
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.vehicle.layout import VX, VY
from uas_coverage_env.world import SwarmState

_NO_REACH_M = -1e4  # a distance that is kept wherever two UAS are


def seen_at(flight: Flight, step: int) -> SwarmState:
    """What the planner saw at a sample of a flight, as far as the flight's record tells."""
    scenario, x, mode = flight.scenario, flight.x[step], flight.mode[step]
    ended = np.where(mode == MODES.index("landed"), LANDED, LOST)
    time_s = step * scenario.dt_s
    return SwarmState(
        time_s=time_s,
        step=step,
        names=flight.names,
        x=x.copy(),
        reference_mps=x[:, VX : VY + 1].copy(),
        status=np.where(mode < MODES.index("landed"), FLYING, ended),
        departed=np.ones(len(x), bool),
        returning=np.zeros(len(x), bool),
        uncovered=covered_at(flight) > step,
        home_m=np.array([uas.home_m for uas in scenario.uas]),
        moving_position_m=scenario.moving_positions(time_s),
        moving_velocity_mps=scenario.moving_velocities(time_s),
        responds=np.ones(len(x), bool),
    )


def decision(
    flight: Flight, step: int, changed: Mapping[str, Any] | None = None
) -> PlanningProblem:
    """The decision of `milp-mpc` at a sample of a flight.

    Args:
        flight: Of which.
        step: Number of the sample.
        changed: Options that differ from those of the flight.
    """
    options = MilpMpcOptions.model_validate({**flight.planner_options, **(changed or {})})
    planner = MilpMpc(options)
    planner.reset(MissionBrief.of(flight.scenario), flight.seed)
    problem = planner.problem(seen_at(flight, step))
    return replace(problem, physical_sides=options.limit_sides)


def whole_decision(flight: Flight, step: int = 0) -> PlanningProblem:
    """The same with every open waypoint and nothing left out: the paper's size."""
    options = MilpMpcOptions.model_validate(dict(flight.planner_options))
    brief, swarm = MissionBrief.of(flight.scenario), seen_at(flight, step)
    still_open = np.flatnonzero(swarm.uncovered)
    weight = np.array([brief.waypoints[w].weight for w in still_open])
    builder = ProblemBuilder(brief, options)
    problem = builder.seen(swarm, options.weights, still_open, weight)
    every_obstacle = tuple(zip((o.name for o in brief.obstacles), brief.hulls, strict=True))
    if len(problem.obstacles) < len(every_obstacle):
        safe_m = np.array([obstacle.safe_distance_m for obstacle in brief.obstacles])
        radius_m = np.array([uas.radius_m for uas in brief.uas if uas.name in problem.names])
        margins = options.margins(brief)
        clearance_m = radius_m[:, None] + safe_m + margins.fixed_m
        problem = replace(problem, obstacles=every_obstacle, obstacle_clearance_m=clearance_m)
    return replace(problem, physical_sides=options.limit_sides, prune=False)


def with_waypoints(problem: PlanningProblem, share: float) -> PlanningProblem:
    """The decision with a share of its waypoints, evenly picked."""
    kept = _picked(problem.n_waypoints, share)
    return replace(
        problem,
        waypoints_m=problem.waypoints_m[kept],
        waypoint_reach_m=problem.waypoint_reach_m[kept],
        waypoint_weight=problem.waypoint_weight[kept],
        waypoint_index=problem.waypoint_index[kept],
        targets=tuple(target and replace(target, waypoint=None) for target in problem.targets),
    )


def with_obstacles(problem: PlanningProblem, share: float) -> PlanningProblem:
    """The decision with a share of what stands, evenly picked; without what moves where it is 0."""
    kept = _picked(len(problem.obstacles), share)
    moving = problem.moving if share > 0.0 else ()
    return replace(
        problem,
        obstacles=tuple(problem.obstacles[o] for o in kept),
        obstacle_clearance_m=problem.obstacle_clearance_m[:, kept],
        moving=moving,
        moving_clearance_m=problem.moving_clearance_m[:, : len(moving)],
    )


def without_collision(problem: PlanningProblem) -> PlanningProblem:
    """The decision in which UAS need not keep apart."""
    return replace(problem, separation_m=np.full_like(problem.separation_m, _NO_REACH_M))


def _picked(count: int, share: float) -> NDArray[np.int64]:
    return np.linspace(0, count - 1, round(share * count)).astype(np.int64)

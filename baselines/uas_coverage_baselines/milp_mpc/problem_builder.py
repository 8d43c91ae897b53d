"""From the brief and what is seen now to the `PlanningProblem` of one decision."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.blocks.battery_reserve import (
    seconds_onward,
    straight_seconds_home,
)
from uas_coverage_baselines.milp_mpc.model.blocks.coverage import coverable
from uas_coverage_baselines.milp_mpc.model.priority import seconds_saved
from uas_coverage_baselines.milp_mpc.model.problem import (
    MovingHull,
    PlanningProblem,
    Target,
    WayHome,
    Weights,
)
from uas_coverage_baselines.milp_mpc.options import OcpOptions
from uas_coverage_env.entities.commands import HOME
from uas_coverage_env.geometry.round_shapes import inner_factor
from uas_coverage_env.mission import MissionBrief, Ways, WorldView
from uas_coverage_env.mission.ways import Way
from uas_coverage_env.vehicle import VehicleParams, linear_model
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.range import dod_per_s
from uas_coverage_env.vehicle.scale import braking_s
from uas_coverage_env.world import SwarmState

FloatArray = NDArray[np.float64]


class ProblemBuilder:
    """What stays the same over a mission, and the view of it at one sample.

    Args:
        brief: the mission.
        options: of the planner.
        ways: past the fixed obstacles; where None, aims and the way home are straight, as the
            paper's are.
    """

    def __init__(self, brief: MissionBrief, options: OcpOptions, ways: Ways | None = None) -> None:
        self._ways = ways
        self._margins = options.margins(brief)
        self.brief, self._options, self._form = brief, options, options.form
        self._view = WorldView(brief)
        self.dt_s = brief.dt_s
        self.waypoints_m = np.array([w.position_m for w in brief.waypoints], float)
        self.home_m = {uas.name: np.array(uas.home_m, float) for uas in brief.uas}
        self._vehicles = dict(zip((u.name for u in brief.uas), brief.vehicles, strict=True))
        self._uas = {uas.name: uas for uas in brief.uas}
        self._row = {uas.name: row for row, uas in enumerate(brief.uas)}
        self._obstacles = tuple(
            (obstacle.name, hull if brief.planar is None else brief.planar.section(hull))
            for obstacle, hull in zip(brief.obstacles, brief.kept_hulls, strict=True)
        )
        self._fence = brief.fence if brief.planar is None else brief.planar.section(brief.fence)
        factor = inner_factor(options.waypoint_sides, 3 if brief.planar is None else 2)
        self._waypoint_reach_m = np.array([w.radius_m * factor for w in brief.waypoints])
        self._waypoint_weight = np.array([w.weight for w in brief.waypoints], float)

    def vehicle(self, name: str) -> VehicleParams:
        """Parameters of a UAS's vehicle."""
        return self._vehicles[name]

    def seconds_left(self, name: str, dod: float) -> float:
        """Flight time until it has to have landed, at the pace of cruising."""
        dod_max = self.brief.dod_landed[self._row[name]]
        return (dod_max - dod) / dod_per_s(self._vehicles[name], dod_max)

    def seconds_home(self, name: str, position_m: FloatArray) -> float:
        """Flight time home, with a detour and the landing, see `BatteryReserve`."""
        way = self._way_home(name, self.way(name, HOME, position_m))
        if way is None:
            return straight_seconds_home(self._vehicles[name], self.home_m[name] - position_m)
        return straight_seconds_home(self._vehicles[name], way.corner_m - position_m) + way.onward_s

    def way(
        self, name: str, target: int, position_m: FloatArray, speed_mps: float = 0.0
    ) -> Way | None:
        """The way round what shades a waypoint or home; None where the straight one will do.

        Args:
            name: of the UAS.
            target: the scenario's waypoint, or `world.HOME`.
            position_m: (3,).
            speed_mps: of the UAS.
        """
        if self._ways is None:
            return None
        way = self._ways.to(self._row[name], target, position_m, speed_mps)
        return way if way.shaded else None

    def aim_m(self, name: str, position_m: FloatArray, way: Way) -> FloatArray:
        """(3,) what to aim at to pass a corner: as far as a horizon goes, in its direction.

        A plan that can reach its aim slows down for it, which is right at a narrow gap only.
        """
        if way.tight:
            return way.aim_m
        away_m = way.aim_m - position_m
        farthest_m = self.horizon_s * self._vehicles[name].limits.v_xy_max_mps
        return position_m + away_m * max(farthest_m / max(float(np.linalg.norm(away_m)), 1.0), 1.0)

    def _way_home(self, name: str, way: Way | None) -> WayHome | None:
        if way is None:
            return None
        down_m = float(self.home_m[name][2] - way.aim_m[2])
        onward_s = seconds_onward(self._vehicles[name], way.onward_m, abs(down_m))
        return WayHome(way.aim_m, onward_s)

    @property
    def horizon_s(self) -> float:
        """How long a plan lasts."""
        return self._options.horizon * self.dt_s

    def horizon_m(self, name: str) -> float:
        """How far a UAS cruises within the horizon."""
        return self._options.horizon * self.dt_s * self._vehicles[name].limits.v_cruise_mps

    def blocked_waypoints(self, swarm: SwarmState) -> set[int]:
        """Waypoints whose whole inner polyhedron lies in a moving obstacle's keep-out, now."""
        self._view.update(swarm)
        # its faces are `up` of the radius away, its upright edges `level` of it
        up = inner_factor(self._options.waypoint_sides, 3)
        level = inner_factor(self._options.waypoint_sides, 2)
        return set(np.flatnonzero(self._view.blocked(level, up, 0.0)).tolist())

    def problem(
        self,
        swarm: SwarmState,
        targets: Mapping[str, Target | None],
        weights: Weights,
        priority_per_s: float,
    ) -> PlanningProblem:
        """The paper's decision: open waypoints, but those that no UAS can reach in time.

        Args:
            swarm: what is seen.
            targets: of each active UAS; waypoints are the scenario's rows.
            weights: cost coefficients.
            priority_per_s: added to W_Phi per second saved, see `priority`.
        """
        open_now = np.flatnonzero(swarm.uncovered)
        problem = self.seen(swarm, weights, open_now, self._waypoint_weight[open_now])
        near = np.flatnonzero(coverable(problem).any(axis=(0, 1)))
        index = open_now[near]
        weight = self._waypoint_weight[index]
        if priority_per_s > 0.0:
            speed = min(vehicle.limits.v_xy_max_mps for vehicle in problem.vehicles)
            saved = seconds_saved(self.waypoints_m[open_now], speed, near)
            weight = weight + priority_per_s * saved
        return replace(
            problem,
            waypoints_m=self.waypoints_m[index],
            waypoint_reach_m=self._waypoint_reach_m[index],
            waypoint_weight=weight,
            waypoint_index=index,
            targets=tuple(_in_rows(targets[name], index) for name in problem.names),
        )

    def seen(
        self,
        swarm: SwarmState,
        weights: Weights,
        waypoints: NDArray[np.int64],
        waypoint_weight: FloatArray,
    ) -> PlanningProblem:
        """What is seen now, about the given waypoints, which are the scenario's rows."""
        options, names = self._options, swarm.active
        margin_m = min(self._margins.fixed_m, 0.1)
        # in the plane, heights are checked when the file is read
        least_m = self.brief.min_height_m if self.brief.planar is None else 0.0
        order = self._form.get("order", PlanningProblem.order)
        obstacles = self._within_reach(swarm)
        rows = [swarm.names.index(name) for name in names]
        x0 = swarm.x[rows]
        uas = [self._uas[name] for name in names]
        radius = np.array([u.radius_m for u in uas])
        fixed = np.array([self.brief.obstacles[o].safe_distance_m for o in obstacles])
        moving = np.array([o.safe_distance_m for o in self.brief.moving_obstacles])
        vehicles = tuple(self._vehicles[name] for name in names)
        ways_home = tuple(
            self._way_home(name, self.way(name, HOME, x[:3], float(np.hypot(x[S.VX], x[S.VY]))))
            for name, x in zip(names, x0, strict=True)
        )
        return PlanningProblem(
            names=names,
            vehicles=vehicles,
            models=tuple(
                linear_model(vehicle, float(x[S.DOD]), self.dt_s, order)
                for vehicle, x in zip(vehicles, x0, strict=True)
            ),
            x0=x0,
            horizon=options.horizon,
            fence=self._fence,
            fence_margin_m=self.brief.geofence.margin_m + margin_m,
            obstacles=tuple(self._obstacles[o] for o in obstacles),
            obstacle_clearance_m=radius[:, None] + fixed + self._margins.fixed_m,
            moving=self._predicted(swarm),
            moving_clearance_m=radius[:, None] + moving + self._margins.moving_m,
            separation_m=(
                radius[:, None] + radius + self.brief.uas_safe_distance_m + self._margins.fixed_m
            ),
            waypoints_m=self.waypoints_m[waypoints],
            waypoint_reach_m=self._waypoint_reach_m[waypoints],
            waypoint_weight=waypoint_weight,
            waypoint_index=waypoints,
            n_scenario_waypoints=len(self.waypoints_m),
            home_m=np.array([self.home_m[name] for name in names]),
            dod_max=np.array([self.brief.dod_landed[self._row[name]] for name in names]),
            targets=(None,) * len(names),
            ways_home=ways_home if any(ways_home) else (),
            dt_s=self.dt_s,
            min_height_m=least_m + margin_m if least_m else 0.0,
            landing_zone_m=self.brief.landing_zone_m - margin_m,
            weights=weights,
            planar=self.brief.planar is not None,
            **self._form,
        )

    def _within_reach(self, swarm: SwarmState) -> list[int]:
        """Obstacles that some UAS could come near, within the horizon or braking after it.

        By boxes: a UAS that flies straight at full speed all the time does not get to the others.
        """
        if not self._form.get("prune", PlanningProblem.prune):
            return list(range(len(self.brief.obstacles)))
        near_m = max(u.radius_m for u in self.brief.uas) + self._margins.fixed_m
        result = []
        rows = [swarm.names.index(name) for name in swarm.active]
        speed = [self._vehicles[name].limits.v_xy_max_mps for name in swarm.active]
        # at most: the corners of the speed's polygon, and what a UAS flies while it brakes
        way_m = 1.1 * np.array(speed) * (self.horizon_s + braking_s(self.brief.vehicles, self.dt_s))
        for o, (obstacle, (_, hull)) in enumerate(
            zip(self.brief.obstacles, self._obstacles, strict=True)
        ):
            low, high = hull.vertices_m.min(axis=0)[:2], hull.vertices_m.max(axis=0)[:2]
            here = swarm.x[rows, 0:2]
            apart = np.linalg.norm(np.maximum(np.maximum(low - here, here - high), 0.0), axis=1)
            if (apart <= way_m + near_m + obstacle.safe_distance_m).any():
                result.append(o)
        return result

    def _predicted(self, swarm: SwarmState) -> tuple[MovingHull, ...]:
        steps = np.arange(self._options.horizon + 1)[:, None] * self.dt_s
        return tuple(
            MovingHull(
                obstacle.name,
                swarm.moving_position_m[row] + steps * swarm.moving_velocity_mps[row],
                obstacle.radius_m,
                0.5 * obstacle.height_m,
            )
            for row, obstacle in enumerate(self.brief.moving_obstacles)
        )


def _in_rows(target: Target | None, index: NDArray[np.int64]) -> Target | None:
    """The target with its waypoint as a row of the problem; one out of reach relaxes nothing."""
    if target is None or target.waypoint is None:
        return target
    rows = np.flatnonzero(index == target.waypoint)
    return replace(target, waypoint=int(rows[0]) if len(rows) else None)

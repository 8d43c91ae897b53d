"""Decisions as a file: whole `PlanningProblem`s, for benchmarks, tests and reports of defects.

One JSON file holds decisions of one mission. What they share (fence, obstacles, vehicles) is
written once, everything else per decision, so that a file is read without the scenario it is from.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from uas_coverage_baselines.milp_mpc.model.problem import (
    MovingHull,
    PlanningProblem,
    Target,
    TourSegment,
    WayHome,
    Weights,
)
from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.vehicle import VehicleParams, linear_model
from uas_coverage_env.vehicle.layout import DOD

_ARRAYS = (
    "x0",
    "obstacle_clearance_m",
    "moving_clearance_m",
    "separation_m",
    "waypoints_m",
    "waypoint_reach_m",
    "waypoint_weight",
    "home_m",
    "dod_max",
)
_NUMBERS = (
    *("horizon", "dt_s", "fence_margin_m", "min_height_m", "landing_zone_m"),
    "n_scenario_waypoints",
)
_OF_A_TOUR = ("aims_m", "radius_m", "onward_s")
_FORM = (
    *("physical_sides", "limit_sides", "obstacle_sides", "waypoint_sides"),
    *("outer_limits", "order", "corners_of_all", "prune", "planar"),
)


def write_problems(
    path: str | Path, made_by: str, problems: Sequence[PlanningProblem], steps: Sequence[int]
) -> None:
    """Write decisions of one mission.

    Args:
        path: of the file.
        made_by: the command that makes it.
        problems: the decisions.
        steps: which sample of the mission each was taken at.
    """
    shared = problems[0]
    document = {
        "made_by": made_by,
        "fence": _hull(shared.fence),
        "obstacles": {name: _hull(hull) for name, hull in shared.obstacles},
        "vehicles": {
            vehicle.name: vehicle.model_dump(mode="json")
            for problem in problems
            for vehicle in problem.vehicles
        },
        "decisions": [
            {"step": step, **_decision(problem)}
            for step, problem in zip(steps, problems, strict=True)
        ],
    }
    text = json.dumps(document, separators=(",", ":"))
    Path(path).write_text(text.replace('{"step"', '\n{"step"') + "\n", encoding="utf-8")


def read_problems(path: str | Path) -> dict[int, PlanningProblem]:
    """Decisions of a file by the step they were taken at."""
    document = json.loads(Path(path).read_text(encoding="utf-8"))
    fence = _polytope(document["fence"])
    obstacles = tuple((name, _polytope(hull)) for name, hull in document["obstacles"].items())
    vehicles = {
        name: VehicleParams.model_validate_json(json.dumps(values))
        for name, values in document["vehicles"].items()
    }
    return {row["step"]: _problem(row, fence, obstacles, vehicles) for row in document["decisions"]}


def _decision(problem: PlanningProblem) -> dict[str, Any]:
    return {
        "names": list(problem.names),
        "vehicles": [vehicle.name for vehicle in problem.vehicles],
        **{name: getattr(problem, name) for name in (*_NUMBERS, *_FORM)},
        **{name: getattr(problem, name).tolist() for name in _ARRAYS},
        "waypoint_index": problem.waypoint_index.tolist(),
        "moving": [
            {
                "name": moving.name,
                "position_m": moving.position_m.tolist(),
                "radius_m": moving.radius_m,
                "half_height_m": moving.half_height_m,
            }
            for moving in problem.moving
        ],
        "targets": [
            None
            if target is None
            else {
                "position_m": target.position_m.tolist(),
                "weight": target.weight,
                "waypoint": target.waypoint,
            }
            for target in problem.targets
        ],
        "tours": [None if tour is None else _tour(tour) for tour in problem.tours],
        "ways_home": [
            None if way is None else {"corner_m": way.corner_m.tolist(), "onward_s": way.onward_s}
            for way in problem.ways_home
        ],
        "weights": asdict(problem.weights),
        "data": {
            block: {name: np.asarray(value).tolist() for name, value in own.items()}
            for block, own in problem.data.items()
        },
    }


def _tour(tour: TourSegment) -> dict[str, Any]:
    arrays = {name: getattr(tour, name).tolist() for name in _OF_A_TOUR}
    return {"waypoints": tour.waypoints.tolist(), "lead_s": tour.lead_s, **arrays}


def _problem(
    row: dict[str, Any],
    fence: ConvexPolytope,
    obstacles: tuple[tuple[str, ConvexPolytope], ...],
    known: Mapping[str, VehicleParams],
) -> PlanningProblem:
    vehicles = tuple(known[name] for name in row["vehicles"])
    fields: dict[str, Any] = {name: np.array(row[name], float) for name in _ARRAYS}
    fields["waypoints_m"] = fields["waypoints_m"].reshape(-1, 3)
    # older files do not have all of these
    fields |= {name: row[name] for name in (*_NUMBERS, *_FORM) if name in row}
    return PlanningProblem(
        names=tuple(row["names"]),
        vehicles=vehicles,
        models=tuple(
            linear_model(vehicle, float(x[DOD]), row["dt_s"], row.get("order", 4))
            for vehicle, x in zip(vehicles, fields["x0"], strict=True)
        ),
        fence=fence,
        obstacles=obstacles,
        moving=tuple(
            MovingHull(
                moving["name"],
                np.array(moving["position_m"], float),
                moving["radius_m"],
                moving["half_height_m"],
            )
            for moving in row["moving"]
        ),
        waypoint_index=np.array(row["waypoint_index"], np.int64),
        targets=tuple(
            None
            if target is None
            else Target(np.array(target["position_m"], float), target["weight"], target["waypoint"])
            for target in row["targets"]
        ),
        # files from before these were written: no tours, straight ways, the default weights
        tours=tuple(None if tour is None else _read_tour(tour) for tour in row.get("tours", ())),
        ways_home=tuple(
            None if way is None else WayHome(np.array(way["corner_m"], float), way["onward_s"])
            for way in row.get("ways_home", ())
        ),
        weights=Weights(**row.get("weights", {})),
        data={
            block: {name: np.array(value) for name, value in own.items()}
            for block, own in row.get("data", {}).items()
        },
        **fields,
    )


def _read_tour(tour: dict[str, Any]) -> TourSegment:
    return TourSegment(
        waypoints=np.array(tour["waypoints"], np.int64),
        lead_s=tour["lead_s"],
        **{name: np.array(tour[name], float) for name in _OF_A_TOUR},
    )


def _hull(hull: ConvexPolytope) -> dict[str, Any]:
    return {
        "normals": hull.normals.tolist(),
        "offsets_m": hull.offsets_m.tolist(),
        "vertices_m": hull.vertices_m.tolist(),
    }


def _polytope(hull: dict[str, Any]) -> ConvexPolytope:
    return ConvexPolytope(
        np.array(hull["normals"]), np.array(hull["offsets_m"]), np.array(hull["vertices_m"])
    )

"""The mission as it looks to routes that lead round obstacles rather than over them."""

from __future__ import annotations

from typing import Any

import numpy as np

from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.scenario import Obstacle

_ABOVE_M = 1.0


def raised(brief: MissionBrief) -> MissionBrief | None:
    """The mission with what rises above the usual waypoint made as tall as the fence.

    None where nothing does, and routes would be the same.
    """
    targets_m = [*(w.position_m[2] for w in brief.waypoints), *(u.start_m[2] for u in brief.uas)]
    usual_m = float(np.median(targets_m)) - _ABOVE_M
    top_m = float(brief.fence.vertices_m[:, 2].min())
    radius_m = max(uas.radius_m for uas in brief.uas)
    obstacles, changed = [], False
    for obstacle in brief.obstacles:
        vertices_m = np.array(obstacle.vertices_m, float)
        roof_m = vertices_m[:, 2].min()
        if top_m < roof_m and roof_m - radius_m - obstacle.safe_distance_m < usual_m:
            vertices_m[vertices_m[:, 2] <= roof_m + 1e-6, 2] = top_m
            known = obstacle.model_dump() | {"vertices_m": tuple(map(tuple, vertices_m.tolist()))}
            obstacles.append(Obstacle.model_validate(known))
            changed = True
        else:
            obstacles.append(obstacle)
    if not changed:
        return None
    known: dict[str, Any] = {name: getattr(brief, name) for name in MissionBrief.model_fields}
    known["obstacles"] = tuple(obstacles)
    return MissionBrief.model_construct(**known)

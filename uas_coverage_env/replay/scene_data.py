"""What a replay page knows of a scenario: shapes ready to draw, in the colours of our pictures."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from uas_coverage_env.draw import colours
from uas_coverage_env.draw.marks import heavy_waypoints
from uas_coverage_env.draw.terrain import lintels
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.geometry.outline import outline_of


def scene_data(history: SceneHistory) -> dict[str, Any]:
    """The scenes of a flight as plain data: lengths in metres, NED, rounded to centimetres.

    Bodies come as `corners` (V, 3), `triangles` (K, 3 corners each, seen from outside in the order
    of the clock's reverse in a right-handed frame) and `outline` (C, 2), the hull seen from above.
    What events add has the sample `from` which it is there; what they drop, `until` when.
    """
    scenario = history.scenario
    return {
        "name": scenario.name,
        "fence": _body(scenario.fence),
        "obstacles": _obstacles(history),
        "decorations": [
            {
                "kind": item.kind or "",
                "colour": colours.hex_of(colours.of_decoration(item.kind)),
                "outline": _metres(np.array(item.polygon_m)),
            }
            for item in scenario.decorations
        ],
        "waypoints": _waypoints(history),
        "moving": [
            {
                "name": obstacle.name,
                "kind": obstacle.kind or "",
                "radius": obstacle.radius_m,
                "height": obstacle.height_m,
                "safe": obstacle.safe_distance_m,
                "from": int(since),
            }
            for obstacle, since in zip(scenario.moving_obstacles, history.moving_from, strict=True)
        ],
        "uas": [
            {
                "name": uas.name,
                "colour": colours.hex_of(colours.of_uas(i)),
                "homes": _homes(history, i),
                "lowest_soc": round(1.0 - scenario.dod_landed[i], 4),
            }
            for i, uas in enumerate(scenario.uas)
        ],
    }


def _obstacles(history: SceneHistory) -> list[dict[str, Any]]:
    scenario = history.scenario
    return [
        {
            "name": obstacle.name,
            "kind": obstacle.kind or "",
            "colour": colours.hex_of(colours.of_obstacle(obstacle.kind)),
            "from": int(since),
            **({"overhead": True} if overhead else {}),
            **_body(hull),
        }
        for obstacle, hull, since, overhead in zip(
            scenario.obstacles,
            scenario.hulls,
            history.obstacle_from,
            lintels(scenario),
            strict=True,
        )
    ]


def _waypoints(history: SceneHistory) -> list[dict[str, Any]]:
    waypoints, never = history.scenario.waypoints, len(history.moving_position_m)
    return [
        {
            "at": _metres(np.array(waypoint.position_m)),
            "radius": waypoint.radius_m,
            "heavy": heavy,
            "from": int(since),
            "until": int(until) if until < never else None,
        }
        for waypoint, heavy, since, until in zip(
            waypoints,
            heavy_waypoints(history.scenario),
            history.waypoint_from,
            history.waypoint_until,
            strict=True,
        )
    ]


def _homes(history: SceneHistory, i: int) -> list[dict[str, Any]]:
    """Where a UAS is to land, and from which sample on."""
    homes_m = [(since, scenario.uas[i].home_m) for since, scenario in history.changes]
    moved = [k for k in range(len(homes_m)) if k == 0 or homes_m[k][1] != homes_m[k - 1][1]]
    return [{"from": homes_m[k][0], "at": _metres(np.array(homes_m[k][1]))} for k in moved]


def _body(hull: ConvexPolytope) -> dict[str, Any]:
    corners = hull.vertices_m
    # about the centre, as in ConvexPolytope: far from the origin Qhull would lose digits
    triangulated = ConvexHull(corners - corners.mean(axis=0))
    triangles = triangulated.simplices.copy()
    a, b, c = (corners[triangles[:, i]] for i in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), triangulated.equations[:, :3]) < 0
    triangles[inwards] = triangles[inwards][:, ::-1]
    return {
        "corners": _metres(corners),
        "triangles": triangles.tolist(),
        "outline": _metres(outline_of(hull.vertices_m)),
    }


def _metres(values: NDArray[np.float64]) -> list[Any]:
    return values.round(2).tolist()

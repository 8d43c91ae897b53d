"""What a replay page knows of a scenario: shapes ready to draw, in the colours of our pictures."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from uas_coverage_env.draw import colours
from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.replay.outline import outline_of
from uas_coverage_env.scenario import Scenario


def scene_data(scenario: Scenario) -> dict[str, Any]:
    """The scenario as plain data: lengths in metres, NED, rounded to centimetres.

    Bodies come as `corners` (V, 3), `triangles` (K, 3 corners each, seen from outside in the order
    of the clock's reverse in a right-handed frame) and `outline` (C, 2), the hull seen from above.
    """
    lightest = min(waypoint.weight for waypoint in scenario.waypoints)
    return {
        "name": scenario.name,
        "fence": _body(scenario.fence),
        "obstacles": [
            {
                "name": obstacle.name,
                "kind": obstacle.kind or "",
                "colour": hex_colour(colours.of_obstacle(obstacle.kind)),
                **_body(hull),
            }
            for obstacle, hull in zip(scenario.obstacles, scenario.hulls, strict=True)
        ],
        "decorations": [
            {
                "kind": item.kind or "",
                "colour": hex_colour(colours.of_decoration(item.kind)),
                "outline": _metres(np.array(item.polygon_m)),
            }
            for item in scenario.decorations
        ],
        "waypoints": [
            {
                "at": _metres(np.array(waypoint.position_m)),
                "radius": waypoint.radius_m,
                "heavy": waypoint.weight > lightest,
            }
            for waypoint in scenario.waypoints
        ],
        "moving": [
            {
                "name": obstacle.name,
                "kind": obstacle.kind or "",
                "radius": obstacle.radius_m,
                "height": obstacle.height_m,
                "safe": obstacle.safe_distance_m,
            }
            for obstacle in scenario.moving_obstacles
        ],
        "uas": [
            {
                "name": uas.name,
                "colour": hex_colour(colours.UAS[i % len(colours.UAS)]),
                "start": _metres(np.array(uas.start_m)),
                "lowest_soc": round(1.0 - uas.dod_max, 4),
            }
            for i, uas in enumerate(scenario.uas)
        ],
    }


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
        "outline": _metres(outline_of(hull)),
    }


def _metres(values: NDArray[np.float64]) -> list[Any]:
    return values.round(2).tolist()


def hex_colour(colour: colours.Colour) -> str:
    """As the page writes it: #rrggbb."""
    return "#" + "".join(f"{part:02x}" for part in colour)

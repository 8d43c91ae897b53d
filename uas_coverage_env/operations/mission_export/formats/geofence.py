"""The fence that a vehicle is told: where to stay, and the zones to stay out of."""

import numpy as np

from uas_coverage_env.geometry.outline import outline_of
from uas_coverage_env.operations.mission_export.mission_file import MissionFile
from uas_coverage_env.scenario import Scenario

ZONES = ("no_fly", "outside_fence")
"""Kinds of obstacles at which nothing stands: where no UAS may fly."""

_STAY_IN, _STAY_OUT = 5001, 5002
"""MAV_CMD_NAV_FENCE_POLYGON_VERTEX_..., of INCLUSION and EXCLUSION."""

_GLOBAL = 0


def polygons_of(scenario: Scenario, one: MissionFile) -> list[tuple[list[list[float]], bool]]:
    """Each polygon as corners of latitude and longitude [degrees], and whether to stay in it.

    Args:
        scenario: The mission, with its fence and no-fly zones.
        one: The UAS.
    """
    bodies = [(scenario.fence.vertices_m, True)]
    bodies += [
        (hull.vertices_m, False)
        for obstacle, hull in zip(scenario.obstacles, scenario.hulls, strict=True)
        if obstacle.kind in ZONES
    ]
    found = []
    for vertices_m, inside in bodies:
        places = one.geodetic([(*corner, 0.0) for corner in outline_of(vertices_m)])
        found.append((np.round(places[:, :2], 8).tolist(), inside))
    return found


def fence_text(scenario: Scenario, one: MissionFile) -> str:
    """The text of a .fence file (QGC WPL 110), one corner a line, as MAVProxy loads it.

    Args:
        scenario: The mission.
        one: The UAS.
    """
    lines = ["QGC WPL 110"]
    for corners, inside in polygons_of(scenario, one):
        first = f"0\t{_GLOBAL}\t{_STAY_IN if inside else _STAY_OUT}\t{len(corners)}\t0\t0\t0"
        lines += [f"{first}\t{a:.8f}\t{b:.8f}\t0\t1" for a, b in corners]
    return "\n".join([lines[0], *(f"{n}\t{line}" for n, line in enumerate(lines[1:]))]) + "\n"

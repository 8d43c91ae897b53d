"""ArduPilot: waypoint files (QGC WPL 110)."""

import math

from uas_coverage_env.operations.mission_export.formats.mission_items import (
    ALTITUDE,
    LATITUDE,
    LONGITUDE,
    items_of,
)
from uas_coverage_env.operations.mission_export.mission_file import MissionFile
from uas_coverage_env.operations.mission_export.tracks import Tolerances


def waypoints_text(one: MissionFile, tolerances: Tolerances) -> str:
    """The text of a .waypoints file; its first line is home.

    Args:
        one: The UAS.
        tolerances: How far from a corner it may pass.
    """
    latitude, longitude, _ = one.geodetic(one.track.home_m).tolist()
    place = f"{latitude:.8f}\t{longitude:.8f}\t{one.frame.place.height_m:.3f}"
    lines = ["QGC WPL 110", f"0\t1\t0\t16\t0\t0\t0\t0\t{place}\t1"]
    for n, item in enumerate(items_of(one, tolerances.corner_m, px4=False), 1):
        numbers = [0.0 if math.isnan(value) else value for value in item.params]
        first = "\t".join(f"{value:.3f}" for value in numbers[:LATITUDE])
        place = f"{numbers[LATITUDE]:.8f}\t{numbers[LONGITUDE]:.8f}\t{numbers[ALTITUDE]:.3f}"
        lines.append(f"{n}\t0\t{item.frame}\t{item.command}\t{first}\t{place}\t1")
    return "\n".join(lines) + "\n"

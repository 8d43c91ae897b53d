"""Which UAS can cover what: the sensors that UAS carry, and those that waypoints ask for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.scenario.fields import Uas, Waypoint


def asks(waypoint: Waypoint) -> bool:
    """Whether a waypoint asks for more than that a UAS comes near."""
    demands = (waypoint.sensor, waypoint.heights_m, waypoint.max_speed_mps)
    return any(demand is not None for demand in demands)


def who_covers(uas: Sequence[Uas], waypoints: Sequence[Waypoint]) -> NDArray[np.bool_]:
    """(U, W) whether each UAS carries what each waypoint asks for."""
    carried = [{sensor.name for sensor in one.sensors} for one in uas]
    wanted = [waypoint.sensor for waypoint in waypoints]
    rows = [[name is None or name in names for name in wanted] for names in carried]
    return np.array(rows, dtype=np.bool_)

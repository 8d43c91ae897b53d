"""The clock of routes: what a turn and setting off take beside the legs, in tables and kernels.

The only place that says what a turn costs. Legs are timed by `Legs`, landings by the reserve of the
planner (`planning.reserves`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import inlined_kernel

FloatArray = NDArray[np.float64]

TURN_STEPS = 256
"""Steps of a table of turn costs, by the cosine of the angle from -1 to 1."""


def turn_table(angles_deg: list[float], costs: list[float]) -> FloatArray:
    """(TURN_STEPS + 1,) what turning costs, by cosine, from some angles [deg] and their costs."""
    cosines = np.linspace(-1.0, 1.0, TURN_STEPS + 1)
    return np.interp(np.degrees(np.arccos(cosines)), angles_deg, costs)


CUTTING = turn_table([0.0, 45.0, 90.0, 135.0, 180.0], [0.0, -0.3, -0.45, 0.1, 1.5])
"""Of a flight that turns at a waypoint, in times to fly the waypoint's radius: it cuts through the
sphere, but brakes. Calibrated on flights past spheres of 15 m at 12 m/s."""

STOPPING = turn_table([0.0, 10.0, 25.0, 90.0, 180.0], [0.0, 0.0, 0.6, 1.0, 1.1])
"""Of an autopilot, which slows down in every corner, in stops at corners of 90 degrees; a few
degrees are no corner."""


@inlined_kernel
def turn_cost(table, ax, ay, bx, by):
    """What a turn from a way (ax, ay) to a way (bx, by) costs, by a table."""
    length = np.sqrt((ax * ax + ay * ay) * (bx * bx + by * by))
    if length < 1e-9:
        return 0.0
    cosine = min(max((ax * bx + ay * by) / length, -1.0), 1.0)
    return table[int(0.5 * (cosine + 1.0) * (len(table) - 1) + 0.5)]


@inlined_kernel
def setting_off_s(uas, dx, dy):
    """What is lost until the velocity of a UAS points to the first waypoint, at its cruising speed.

    Args:
        uas: Record of ROUTED_UAS_DTYPE.
        dx: How far the waypoint is to the north [m].
        dy: And to the east [m].
    """
    length = np.hypot(dx, dy) + 1e-9
    ax = uas.velocity_mps[0] - uas.speed_mps * dx / length
    ay = uas.velocity_mps[1] - uas.speed_mps * dy / length
    return (ax * ax + ay * ay) / (2.0 * uas.acceleration_mps2 * uas.speed_mps)

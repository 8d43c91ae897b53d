"""Courses, bodies and inputs made by hand, for the tests of what is flown."""

import numpy as np
from uas_coverage_baselines.trajectory.moving_obstacles import MovingObstacles
from uas_coverage_baselines.trajectory.program import PlannedFlight

from uas_coverage_env.planning.backup.course import Course
from uas_coverage_env.vehicle.layout import DOD, N_STATES, VX, VZ

NOWHERE, NONE = np.zeros((0, 3)), np.zeros(0)
NOTHING = MovingObstacles(NOWHERE, NOWHERE, NONE, NONE, NONE, 1.0, 0, 0.0)


def states_along(path_m, dod=0.1):
    """Level states (N+1, 14) at the places (N+1, 3) of a path, a second each, from rest."""
    path_m = np.array(path_m, float)
    x = np.zeros((len(path_m), N_STATES))
    x[:, :3], x[:, DOD] = path_m, dod + 1e-4 * np.arange(len(path_m))
    x[1:, VX : VZ + 1] = np.diff(path_m, axis=0)
    return x


def course_along(path_m, begin=0, lands=True, dod=0.1):
    """A course through places (N+1, 3)."""
    x = states_along(path_m, dod)
    return Course(begin, x, np.zeros((len(x) - 1, 5)), lands)


def straight(start_m, velocity_mps, steps, **known):
    """A course at a steady velocity."""
    start_m, velocity_mps = np.array(start_m, float), np.array(velocity_mps, float)
    return course_along(start_m + np.arange(steps + 1)[:, None] * velocity_mps, **known)


def hover(place_m, steps=1, **known):
    """A course that stays where it is."""
    return straight(place_m, (0.0, 0.0, 0.0), steps, **({"lands": False} | known))


def moving(*bodies, dt_s=1.0):
    """What moves: (position, velocity) of cylinders 8 m wide and 6 m high, to be kept 3 m from."""
    n = len(bodies)
    places, velocities = (np.array(rows, float) for rows in zip(*bodies, strict=True))
    return MovingObstacles(
        places, velocities, np.full(n, 4.0), np.full(n, 3.0), np.full(n, 3.0), dt_s, n, 0.0
    )


def flight_of(inputs):
    """A planned flight of which nothing but the inputs (N, 3) matters."""
    inputs = np.array(inputs, float)
    n = len(inputs)
    return PlannedFlight(
        np.zeros(0, np.int64), np.zeros((n + 1, 10)), inputs, np.zeros((n, 10)), 0.0, np.zeros(0)
    )

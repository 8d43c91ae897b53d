"""Courses at a steady velocity, and a world of a few numbers, for the tests of backups."""

import numpy as np

from uas_coverage_env.planning.backup.course import Course, are_apart
from uas_coverage_env.planning.backup.supervisor import Supervisor
from uas_coverage_env.vehicle import compile_vehicle, load_vehicle
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.scale import braking_s

BRAKING = 14


def straight(start_m, velocity_mps, steps, begin=0, lands=True):
    """A course at a steady velocity, from rest, a second a step."""
    x = np.zeros((steps + 1, S.N_STATES))
    x[:, :3] = np.array(start_m) + np.outer(np.arange(steps + 1), velocity_mps)
    x[1:, S.VX : S.VZ + 1] = velocity_mps
    return Course(begin, x, np.zeros((steps, S.N_INPUTS)), lands)


def supervisor_of(n_uas=1, dt_s=1.0):
    vehicle = load_vehicle("s500_v2")
    records = [compile_vehicle(vehicle, dt_s)[()]] * n_uas
    return Supervisor(records, dt_s, braking_s([vehicle], dt_s))


class World:
    """What stands in the north, what crosses there, and from where in the north no way leads home.

    It keeps what it was asked.
    """

    def __init__(self, wall_m=np.inf, crossed_m=np.inf, home_m=np.inf, keep_m=6.0):
        self.wall_m, self.crossed_m, self.home_m, self.keep_m = wall_m, crossed_m, home_m, keep_m
        self.stops, self.hovers = [], []

    def is_clear(self, uas, course):
        return bool(course.x[:, 0].max() <= self.crossed_m)

    def may_stop(self, uas, course, followed):
        self.stops.append((uas, followed, len(course.u)))
        return bool(course.x[:, 0].max() <= self.wall_m) and self.is_clear(uas, course)

    def comes_home(self, uas, x):
        self.hovers.append((uas, x.copy()))
        return bool(x[0] <= self.home_m)

    def apart(self, i, j, one, other):
        assert i != j
        return are_apart(one, other, self.keep_m)

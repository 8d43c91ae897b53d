"""Blocks as a user writes them, outside the package."""

from itertools import combinations

import numpy as np

from uas_coverage_env.vehicle.layout import DOD, PSI


class Ceiling:
    """z(n) >= -height: no plan leads higher."""

    def __init__(self, height_m=14.0):
        self.height_m = height_m

    def add_to(self, milp, v, problem):
        down = v.position[:, 1:, 2:]
        milp.subject_to("ceiling", (1.0, down), lower=-self.height_m)


class Floor:
    """Each metre below a height costs, at each step."""

    def __init__(self, height_m=8.0, per_metre=5.0):
        self.height_m, self.per_metre = height_m, per_metre

    def add_to(self, milp, v, problem):
        down = v.position[:, 1:, 2:]
        below = milp.variables("floor.below", down.shape, lower=0.0)
        milp.subject_to("floor", (1.0, below), (-1.0, down), lower=self.height_m)
        milp.minimize(self.per_metre, below)


class Apart:
    """The second UAS of a pair keeps so far east of the first, or pays for each metre."""

    def __init__(self, distance_m=60.0):
        self.distance_m = distance_m

    def add_to(self, milp, v, problem):
        for i, j in combinations(range(problem.n_uas), 2):
            east_i, east_j = v.position[i, 1:, 1:2], v.position[j, 1:, 1:2]
            short = milp.variables(f"apart.{i}.{j}", east_i.shape, lower=0.0)
            terms = (1.0, short), (-1.0, east_i), (1.0, east_j)
            milp.subject_to(f"apart.{i}.{j}", *terms, lower=self.distance_m)
            milp.minimize(0.1, short)


class Thrifty:
    """Uses the depth of discharge, which the flown programs do without."""

    def add_to(self, milp, v, problem):
        milp.subject_to("thrifty", (1.0, v.x[:, 1:, [DOD]]), upper=0.9)


class Turned:
    """Asks for a yaw angle, which is at rest at zero otherwise."""

    def add_to(self, milp, v, problem):
        milp.subject_to("turned", (1.0, v.x[:, -1, [PSI]]), lower=0.05)


class Early:
    """Uses Phi, which the flown programs do without: all waypoints half way count double."""

    def add_to(self, milp, v, problem):
        milp.minimize(problem.waypoint_weight, v.uncovered[problem.horizon // 2])


class Doubled:
    """Uses columns of another block."""

    def add_to(self, milp, v, problem):
        milp.minimize(1.0, milp.columns("slack.lift"))


class OneLevel:
    """Whole columns of its own: each UAS keeps to one of two bands of height, at a price."""

    def add_to(self, milp, v, problem):
        N = problem.horizon
        high = milp.variables("level.high", (problem.n_uas, N), lower=0, upper=1, integer=True)
        down = v.position[:, 1:, 2:]
        milp.subject_to("level.low", (1.0, down), (60.0, high[..., None]), lower=-10.0)
        milp.minimize(2.0, high)


LOW = Ceiling(9.0)


def made():
    """A function that makes one."""
    return Ceiling(10.0)


class NoBlock:
    """No method add_to."""


UNCALLED = np.zeros(3)

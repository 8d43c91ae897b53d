"""What few missions have: wind, faults, sensors with errors, events; a file each.

A file holds a feature's table in scenario files, its records, its memory and its kernels at named
points of the step (`feature.Point`).
"""

from uas_coverage_env.compiled.random import normal, uniform
from uas_coverage_env.features.dryden import turbulence
from uas_coverage_env.features.event import EventTable, OfUas
from uas_coverage_env.features.feature import DISTURBANCE_MEMORY, Disturbance, Feature, Point
from uas_coverage_env.features.gusts import discrete_gusts, random_gusts
from uas_coverage_env.features.of_scenario import disturbances_of
from uas_coverage_env.features.parameter_errors import uncertainty
from uas_coverage_env.features.steady_wind import constant_wind, mean_wind, wind_velocity_mps
from uas_coverage_env.features.table import FeatureTable
from uas_coverage_env.features.true_vehicles import perturb

__all__ = [
    "DISTURBANCE_MEMORY",
    "Disturbance",
    "EventTable",
    "Feature",
    "FeatureTable",
    "OfUas",
    "Point",
    "constant_wind",
    "discrete_gusts",
    "disturbances_of",
    "mean_wind",
    "normal",
    "perturb",
    "random_gusts",
    "turbulence",
    "uncertainty",
    "uniform",
    "wind_velocity_mps",
]

"""What few missions have: wind, faults, sensors with errors, events; a file each.

A file holds a feature's table in scenario files, its records, its memory and its kernels at named
points of the step (`feature.Point`).
"""

from uas_coverage_env.compiled.random import normal, uniform
from uas_coverage_env.features.event import OfUas
from uas_coverage_env.features.feature import Disturbance, MissionFeature, Point
from uas_coverage_env.features.of_scenario import disturbances_of
from uas_coverage_env.features.steady_wind import constant_wind
from uas_coverage_env.features.table import FeatureTable

__all__ = [
    "Disturbance",
    "FeatureTable",
    "MissionFeature",
    "OfUas",
    "Point",
    "constant_wind",
    "disturbances_of",
    "normal",
    "uniform",
]

"""How the world pushes back: disturbances as blocks, those of the package and those of others."""

from uas_coverage_env.compiled.random import normal, uniform
from uas_coverage_env.disturbances.dryden import turbulence
from uas_coverage_env.disturbances.gusts import discrete_gusts, random_gusts
from uas_coverage_env.disturbances.of_scenario import disturbances_of
from uas_coverage_env.disturbances.parameter_errors import uncertainty
from uas_coverage_env.disturbances.true_vehicles import perturb, true_vehicle
from uas_coverage_env.disturbances.wind import constant_wind, mean_wind, wind_velocity_mps
from uas_coverage_env.world.disturbance import DISTURBANCE_MEMORY, Disturbance

__all__ = [
    "DISTURBANCE_MEMORY",
    "Disturbance",
    "constant_wind",
    "discrete_gusts",
    "disturbances_of",
    "mean_wind",
    "normal",
    "perturb",
    "random_gusts",
    "true_vehicle",
    "turbulence",
    "uncertainty",
    "uniform",
    "wind_velocity_mps",
]

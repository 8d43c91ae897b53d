"""Observations that have a name: `observation="local"`."""

from collections.abc import Mapping

from uas_coverage_env.env.observation.block import ObservationBlock
from uas_coverage_env.env.observation.channels import grid
from uas_coverage_env.env.observation.layout import OBSERVATION, OBSERVATION_V1
from uas_coverage_env.env.observation.own_senses import local

OBSERVATIONS: Mapping[str, tuple[ObservationBlock, ...]] = {
    "default": OBSERVATION,
    "local": local(),
    "grid": (*OBSERVATION, grid()),
}
"""Name -> blocks."""

OBSERVATIONS_V1: Mapping[str, tuple[ObservationBlock, ...]] = {
    "default": OBSERVATION_V1,
    "local": local(),
    "grid": (*OBSERVATION_V1, grid()),
}
"""The same in `uas_coverage_v1`."""

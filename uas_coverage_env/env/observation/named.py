"""Observations that have a name: `observation="local"`."""

from collections.abc import Mapping

from uas_coverage_env.env.observation.block import ObservationBlock
from uas_coverage_env.env.observation.channels import grid
from uas_coverage_env.env.observation.layout import OBSERVATION
from uas_coverage_env.env.observation.own_senses import local

OBSERVATIONS: Mapping[str, tuple[ObservationBlock, ...]] = {
    "default": OBSERVATION,
    "local": local(),
    "grid": (*OBSERVATION, grid()),
}
"""Name -> blocks."""

"""What a UAS observes: blocks, each one file that holds its table and the kernel that writes it."""

from uas_coverage_env.env.observation.block import Feature, ObservationBlock
from uas_coverage_env.env.observation.channels import grid
from uas_coverage_env.env.observation.layout import (
    OBSERVATION,
    OBSERVATION_SIZE,
    observation_columns,
)
from uas_coverage_env.env.observation.own_senses import local
from uas_coverage_env.env.observation.scales import K_WAYPOINTS
from uas_coverage_env.env.observation.whole_mission import full_state, full_state_of

__all__ = [
    "K_WAYPOINTS",
    "OBSERVATION",
    "OBSERVATION_SIZE",
    "Feature",
    "ObservationBlock",
    "full_state",
    "full_state_of",
    "grid",
    "local",
    "observation_columns",
]

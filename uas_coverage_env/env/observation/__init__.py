"""What a UAS observes: blocks, each one file that holds its table and the kernel that writes it."""

from uas_coverage_env.env.observation.block import Feature, Group, ObservationBlock, flag
from uas_coverage_env.env.observation.channels import grid
from uas_coverage_env.env.observation.layout import (
    OBSERVATION,
    OBSERVATION_SIZE,
    layout_table,
    observation_bounds,
    observation_columns,
)
from uas_coverage_env.env.observation.named import OBSERVATIONS
from uas_coverage_env.env.observation.own_senses import local
from uas_coverage_env.env.observation.scales import K_MOVING, K_UAS, K_WAYPOINTS, SCALES
from uas_coverage_env.env.observation.whole_mission import full_state, full_state_of

__all__ = [
    "K_MOVING",
    "K_UAS",
    "K_WAYPOINTS",
    "OBSERVATION",
    "OBSERVATIONS",
    "OBSERVATION_SIZE",
    "SCALES",
    "Feature",
    "Group",
    "ObservationBlock",
    "flag",
    "full_state",
    "full_state_of",
    "grid",
    "layout_table",
    "local",
    "observation_bounds",
    "observation_columns",
]

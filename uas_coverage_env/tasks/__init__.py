"""Tasks with levels, their environments, and scores that can be compared."""

from uas_coverage_env.tasks.levels import LEVELS, level_named
from uas_coverage_env.tasks.make import parallel_env, swarm_env, vector_env
from uas_coverage_env.tasks.scoring import (
    Anchors,
    Score,
    anchors_of,
    mission_value,
    score,
    scored,
)
from uas_coverage_env.tasks.task import SPLITS, Task, gymnasium_id, seeds_of

__all__ = [
    "LEVELS",
    "SPLITS",
    "Anchors",
    "Score",
    "Task",
    "anchors_of",
    "gymnasium_id",
    "level_named",
    "mission_value",
    "parallel_env",
    "score",
    "scored",
    "seeds_of",
    "swarm_env",
    "vector_env",
]

"""Tasks with levels, their environments, and scores that can be compared."""

from uas_coverage_env.tasks.lessons import LESSONS, Lesson
from uas_coverage_env.tasks.levels import LEVELS, level_named
from uas_coverage_env.tasks.make import parallel_env
from uas_coverage_env.tasks.scoring import Score, score
from uas_coverage_env.tasks.task import SPLITS, Task, seeds_of

__all__ = [
    "LESSONS",
    "LEVELS",
    "SPLITS",
    "Lesson",
    "Score",
    "Task",
    "level_named",
    "parallel_env",
    "score",
    "seeds_of",
]

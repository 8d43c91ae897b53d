"""What is flown when no new plan comes: a backup trajectory of each UAS, verified together.

Its two guarantees, and what they do not cover: docs/safety.md.
"""

from uas_coverage_env.planning.backup.braking import brake
from uas_coverage_env.planning.backup.course import Course, apart_m, are_apart, braked
from uas_coverage_env.planning.backup.supervisor import Checks, ChecksOfCourses, Supervisor

__all__ = [
    "Checks",
    "ChecksOfCourses",
    "Course",
    "Supervisor",
    "apart_m",
    "are_apart",
    "brake",
    "braked",
]

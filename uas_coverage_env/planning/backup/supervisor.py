"""The supervisor: keeps a verified set of backup trajectories, so that there is always something.

Every UAS has one: the rest of a course that lands, or a course followed for some steps and braked
then to a hover. Two things hold of the set, and whatever replaces a part of it is verified with
the rest:

1. *comes home*: where a backup ends in a hover, the charge that is left there suffices for the way
   home;
2. *all apart*: all backups keep the distances of the rules from one another to their ends.

After a step of it what is left of the set is such a set again, so there is one at every later
decision, whatever a planner says (docs/safety.md has the argument, and what ends it). How a planner
knows what is clear is its own affair: `Checks`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.planning.backup.course import Course, braked

FloatArray = NDArray[np.float64]

_MOST_FOLLOWED = 30  # steps of a course that lands: what moves goes otherwise by then


class Checks(Protocol):
    """What a planner knows of a moment: what stands, what moves, what the way home takes."""

    def may_stop(self, uas: int, course: Course, followed: int) -> bool:
        """Whether a course, followed for some steps and braked then, is clear of everything.

        What stands and what moves, and the limits of the vehicle where braking may leave them; the
        other UAS and the way home are asked for separately.
        """

    def comes_home(self, uas: int, x: FloatArray) -> bool:
        """Whether the charge of a hover, a state (14,), suffices for the way home."""

    def apart(self, i: int, j: int, one: Course, other: Course) -> bool:
        """Whether the courses of two UAS keep their distance."""


class ChecksOfCourses(Checks, Protocol):
    """The same for courses that land, and for what is left of backups."""

    def is_clear(self, uas: int, course: Course) -> bool:
        """Whether a course that was verified before is clear of what moves as it goes now."""


class Supervisor:
    """Backup trajectories of a fleet.

    Args:
        vehicles: (U,) records of VEHICLE_DTYPE.
        dt_s: Length of a step.
        braking_s: In which each has braked from any speed [s].

    Attributes:
        backups: By UAS.
        braking_steps: After which every braked course hovers.
    """

    def __init__(
        self, vehicles: Sequence[NDArray[np.void]] | NDArray[np.void], dt_s: float, braking_s: float
    ) -> None:
        self._vehicles = vehicles
        self.braking_steps = int(np.ceil(braking_s / dt_s))
        self.backups: dict[int, Course] = {}

    def renew(
        self,
        checks: ChecksOfCourses,
        step: int,
        x: Mapping[int, FloatArray],
        wanted: Mapping[int, Course],
        landing: Mapping[int, Course],
    ) -> set[int]:
        """Replace backups by new courses, as far as all of them are verified together.

        Args:
            checks: Of this moment.
            step: The sample.
            x: (14,) states of the UAS that fly.
            wanted: Courses from this sample on and verified alone, of UAS that have one.
            landing: What UAS fly that land where they are.

        Returns:
            The UAS whose backup follows their new course. Others go on with what is left of the
            last one, or brake; one for which nothing is verified has no backup.
        """
        held: dict[int, Course] = {}
        for uas in x:
            if uas in landing:
                held[uas] = landing[uas]
            elif (left := self._left(checks, uas, step, x[uas])) is not None:
                held[uas] = left
            elif uas not in wanted and (stop := self._stop(checks, uas, step, x[uas])) is not None:
                held[uas] = stop
        continued = {uas: self._continued(checks, uas, course) for uas, course in wanted.items()}
        fresh = {uas: course for uas, course in continued.items() if course is not None}
        together = held | fresh
        if not _all_apart(checks, together):
            together, fresh = _one_by_one(checks, held, fresh)
        self.backups = together
        return set(fresh)

    def teams(
        self, checks: Checks, courses: Mapping[int, Course]
    ) -> Iterator[tuple[dict[int, int], dict[int, Course]]]:
        """Sets of backups that all come home, to be verified as a whole, the farthest first.

        One UAS after the other follows its course as long as it is clear of those before it; then,
        or where that leaves one without, all follow theirs equally long.

        Args:
            checks: Of this moment.
            courses: Of equal length, by UAS.

        Yields:
            For how many steps each follows its course, and the backups, of equal length.
        """
        most = max(len(course.u) for course in courses.values())
        equally = [dict.fromkeys(courses, n) for n in range(most, 0, -1)]
        first = self._one_after_the_other(checks, courses, most)
        for followed in equally if first is None else [first, *equally]:
            steps = max(followed.values()) + self.braking_steps
            team = {k: self._braked(k, courses[k], n, steps) for k, n in followed.items()}
            if all(checks.comes_home(uas, course.x[-1]) for uas, course in team.items()):
                yield followed, team

    def _one_after_the_other(
        self, checks: Checks, courses: Mapping[int, Course], most: int
    ) -> dict[int, int] | None:
        """For how many steps each follows its course; None where one cannot for a single one."""
        team: dict[int, Course] = {}
        result: dict[int, int] = {}
        for uas, course in courses.items():
            found = self._longest(checks, uas, course, most, team, most + self.braking_steps)
            if found is None:
                return None
            result[uas], team[uas] = found
        return result

    def _longest(
        self,
        checks: Checks,
        uas: int,
        course: Course,
        most: int,
        beside: Mapping[int, Course],
        steps: int | None,
    ) -> tuple[int, Course] | None:
        """For how long a course can be followed, and the backup; None where it cannot.

        Args:
            checks: Of this moment.
            uas: Index of the UAS.
            course: What is followed.
            most: Steps at most.
            beside: Backups of other UAS to keep apart from.
            steps: Of the backup, its hover included; None: until braking has ended.
        """
        for followed in range(min(most, len(course.u)), 0, -1):
            end = followed + self.braking_steps
            trial = self._braked(uas, course, followed, steps or end)
            if (
                checks.comes_home(uas, trial.x[end])
                and checks.may_stop(uas, trial, followed)
                and all(checks.apart(uas, k, trial, other) for k, other in beside.items())
            ):
                return followed, trial
        return None

    def _continued(self, checks: ChecksOfCourses, uas: int, course: Course) -> Course | None:
        """A backup that begins with a course; None where there is none."""
        if course.lands and len(course.u) and checks.is_clear(uas, course):
            return course
        found = self._longest(checks, uas, course, _MOST_FOLLOWED, {}, None)
        return None if found is None else found[1]

    def _left(self, checks: ChecksOfCourses, uas: int, step: int, x: FloatArray) -> Course | None:
        """What is left of a backup, where it begins here and is clear of what is seen."""
        if uas not in self.backups:
            return None
        left = self.backups[uas].rest(step)
        return left if left.begins_at(x) and checks.is_clear(uas, left) else None

    def _stop(self, checks: Checks, uas: int, step: int, x: FloatArray) -> Course | None:
        """To brake at once, where that is clear."""
        here = Course(step, np.ascontiguousarray(x[None]), np.zeros((0, 5)), False)
        stop = self._braked(uas, here, 0, self.braking_steps)
        return stop if checks.may_stop(uas, stop, 0) else None

    def _braked(self, uas: int, course: Course, followed: int, steps: int) -> Course:
        return braked(self._vehicles[uas], course, followed, steps - followed)


def _all_apart(checks: Checks, courses: Mapping[int, Course]) -> bool:
    names = list(courses)
    return all(
        checks.apart(i, j, courses[i], courses[j])
        for k, i in enumerate(names)
        for j in names[k + 1 :]
    )


def _one_by_one(
    checks: Checks, held: Mapping[int, Course], fresh: Mapping[int, Course]
) -> tuple[dict[int, Course], dict[int, Course]]:
    """New ones that are clear of all that is held or was taken before; all, and the new ones."""
    together, taken = dict(held), {}
    for _ in range(2):  # one that was in the way may have left it
        for uas, course in fresh.items():
            if uas not in taken and all(
                checks.apart(uas, k, course, other) for k, other in together.items() if k != uas
            ):
                together[uas] = taken[uas] = course
    return together, taken

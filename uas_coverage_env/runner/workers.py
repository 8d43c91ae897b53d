"""Many missions side by side: who does the jobs, and what becomes of one that is lost."""

import os
import pickle
from collections import Counter, deque
from collections.abc import Generator, Iterable
from typing import Any, Literal, Self

from uas_coverage_env.runner.jobs import Crew, Job, Lost

Backend = Literal["process", "ray"]

_MOST_LOSSES = 3


class WorkerLostError(Exception):
    """A job's process was lost again and again; all other jobs were done."""


class Workers:
    """Who does jobs: this process, processes beside it, or a Ray cluster.

    Processes are started when there is work for them, and wait for more until it is closed.

    Args:
        count: Jobs side by side; 1: in this process, unless Ray was asked for. None: as many as
            this machine has cores, or the Ray cluster.
        backend: `process`, or `ray`: the cluster of `RAY_ADDRESS`, or a local one.
    """

    def __init__(self, count: int | None = 1, backend: Backend = "process") -> None:
        self.backend: Backend = backend
        self.count = os.cpu_count() or 1 if count is None and backend == "process" else count
        self._crew: Crew | None = None

    def __str__(self) -> str:
        """For people."""
        if self.count is None:
            return "as many flights side by side as the cluster has cores"
        return f"{self.count} flight{'' if self.count == 1 else 's'} side by side"

    def run(self, jobs: Iterable[Job | None]) -> Generator[tuple[Job, Any], None, None]:
        """Do jobs; each result as soon as it is there, in no particular order.

        Jobs are taken as there is room for them; None in their place says that the next one comes
        of a result that is under way. One whose process was killed, or whose machine is
        gone, is done again by another one. What a job raises is raised here.

        Raises:
            InputError: Ray cannot be used.
            WorkerLostError: A job's process was lost each time; the other jobs were done first.
        """
        if self.backend == "process" and self.count == 1:
            for job in jobs:
                if job is not None:
                    yield job, job.call(*job.arguments)
            return
        coming, again, losses = iter(jobs), deque[Job](), Counter[str]()
        given_up: list[tuple[Job, Lost]] = []
        under_way = 0
        try:
            while True:
                while not under_way or under_way < self._started().size():
                    job = again.popleft() if again else next(coming, None)
                    if job is None:
                        break
                    self._started().begin(job, pickle.dumps((job.call, job.arguments)))
                    under_way += 1
                if not under_way:
                    break
                for job, result in self._started().finished():
                    under_way -= 1
                    if isinstance(result, Lost):
                        losses[job.key] += 1
                        if losses[job.key] < _MOST_LOSSES:
                            again.append(job)
                        else:
                            given_up.append((job, result))
                        continue
                    value, error = pickle.loads(result)
                    if error is not None:
                        raise error
                    yield job, value
        finally:
            if under_way and self._crew is not None:
                self._crew.abandon()
        if given_up:
            job, lost = given_up[0]
            raise WorkerLostError(
                f"{job.key}: {lost.reason}, {_MOST_LOSSES} times (out of memory?); "
                "what was flown is kept"
            )

    def close(self) -> None:
        """End the processes."""
        crew, self._crew = self._crew, None
        if crew is not None:
            crew.close()

    def __enter__(self) -> Self:
        """The same."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close it."""
        self.close()

    def _started(self) -> Crew:
        if self._crew is None:
            if self.backend == "ray":
                from uas_coverage_env.runner.cluster import Cluster

                self._crew = Cluster(self.count)
            else:
                from uas_coverage_env.runner.processes import Processes

                self._crew = Processes(self.count or 1)
        return self._crew

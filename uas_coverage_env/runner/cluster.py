"""The machines of a Ray cluster: what was flown on one that is gone is flown on another."""

import logging
import os
from typing import Any

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.plugins.users_code import described
from uas_coverage_env.runner.jobs import Job, Lost, done

_SECONDS_BETWEEN_LOOKS = 1.0
_AHEAD = 2  # jobs for each core: one is done, the next is on its way


class Cluster:
    """A crew on a Ray cluster, see `Crew`; a local one where there is none to join.

    Args:
        count: Jobs side by side; None: as many as there are cores at the moment.

    Raises:
        InputError: Ray is not installed, or the cluster cannot be reached.
    """

    def __init__(self, count: int | None) -> None:
        try:
            import ray
        except ImportError as error:
            raise InputError(
                f"--backend ray: Ray cannot be loaded ({error}); "
                "python -m pip install 'uas-coverage-env[cluster]'"
            ) from error
        if not ray.is_initialized():
            local: dict[str, Any] = {}
            if "RAY_ADDRESS" not in os.environ:
                local = {"address": "local", "num_cpus": count, "include_dashboard": False}
            try:
                ray.init(**local, log_to_driver=False, logging_level=logging.ERROR)
            except (ConnectionError, RuntimeError, ValueError) as error:
                where = os.environ.get("RAY_ADDRESS", "a local cluster")
                raise InputError(f"--backend ray: {where}: {described(error)}") from error
        self._ray, self._count = ray, count
        # what is lost is begun again by `Workers`, which counts
        self._done = ray.remote(num_cpus=1, max_retries=0)(done)
        self._under_way: dict[Any, Job] = {}

    def size(self) -> int:
        """See `Crew`; machines come and go."""
        if self._count is not None:
            return self._count
        return max(1, _AHEAD * int(self._ray.cluster_resources().get("CPU", 0)))

    def begin(self, job: Job, work: bytes) -> None:
        """See `Crew`."""
        self._under_way[self._done.remote(work)] = job

    def finished(self) -> list[tuple[Job, bytes | Lost]]:
        """See `Crew`."""
        from ray.exceptions import RayError, RayTaskError

        found: list[tuple[Job, bytes | Lost]] = []
        ready, _ = self._ray.wait(list(self._under_way), timeout=_SECONDS_BETWEEN_LOOKS)
        for reference in ready:
            job = self._under_way.pop(reference)
            try:
                found.append((job, self._ray.get(reference)))
            except RayTaskError as error:  # `done` itself cannot be loaded there
                reason = str(error).strip().rpartition("\n")[2]
                raise InputError(f"--backend ray: a node cannot fly: {reason}") from error
            except RayError as error:
                found.append((job, Lost(f"its worker or node was lost ({type(error).__name__})")))
        return found

    def abandon(self) -> None:
        """See `Crew`."""
        while self._under_way:
            self._ray.cancel(self._under_way.popitem()[0], force=True)

    def close(self) -> None:
        """See `Crew`; Ray itself ends with this process."""
        self.abandon()

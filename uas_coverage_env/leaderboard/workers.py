"""Flying a list of flights, side by side: joblib's processes, or the machines of a Ray cluster."""

import logging
import os
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal

from joblib import Parallel, cpu_count, delayed, parallel_config
from joblib.externals.loky.process_executor import TerminatedWorkerError

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import PlannerError, load_planner, rollout
from uas_coverage_env.leaderboard.row import Row
from uas_coverage_env.leaderboard.sweep import Entry
from uas_coverage_env.plugins.users_code import described

Backend = Literal["process", "ray"]

_SECONDS_BETWEEN_LOOKS = 1.0


class StoppedError(Exception):
    """A flight was ended by hand: there is nothing to keep of it."""


class WorkerLostError(Exception):
    """A process that flew was killed from outside, or crashed."""


def jobs_of(asked: int | None, backend: Backend) -> int:
    """How many flights are flown side by side; -1: as many as the Ray cluster has cores."""
    if asked is not None:
        return asked
    return -1 if backend == "ray" else cpu_count()


def fly_all(
    entries: Sequence[Entry],
    jobs: int,
    backend: Backend,
    source_sha256: str,
    keep: Path | None = None,
) -> Iterator[Row]:
    """Fly everything; each row as soon as its flight is over, in no particular order.

    Args:
        entries: What to fly.
        jobs: Flights side by side, see `jobs_of`.
        backend: `process`, or `ray`: the cluster of `RAY_ADDRESS`, or a local one.
        source_sha256: Hash of the source code that flies.
        keep: Folder that gets each flight's directory, see `kept_as`; None: only rows are kept.

    Raises:
        InputError: Ray is not installed.
        StoppedError: Ctrl-C ended a flight.
        WorkerLostError: A process that flew is gone.
    """
    if not entries:
        return
    if backend == "ray":
        _join_ray(jobs)
        chosen = {"backend": "uas-ray"}
    else:
        chosen = {"backend": "loky", "initializer": _end_with, "initargs": (os.getpid(),)}
    # a process that has flown before may be in another folder
    kept_in = keep and keep.resolve()
    try:
        with parallel_config(n_jobs=jobs, **chosen):
            # one flight per task: what is finished is kept at once
            parallel = Parallel(
                return_as="generator_unordered",
                batch_size=1,  # its default is a word
                max_nbytes=None,  # nothing large travels
            )
            for row in parallel(delayed(fly)(entry, source_sha256, kept_in) for entry in entries):
                if row is None:
                    raise StoppedError
                yield row
    except TerminatedWorkerError as error:
        raise WorkerLostError(
            "a process that flew was killed or crashed (out of memory?); finished flights are kept"
        ) from error


def kept_as(row: Row | Entry) -> str:
    """The name of a flight's directory where flights are kept."""
    if isinstance(row, Entry):
        return f"{row.scenario.name}-{row.spec.label}-{row.seed}"
    return f"{row.scenario}-{row.label}-{row.seed}"


def fly(entry: Entry, source_sha256: str, keep: Path | None = None) -> Row | None:
    """Fly one flight; None: it was stopped by hand."""
    spec = entry.spec
    try:
        planner = load_planner(spec.planner, spec.options)
        if getattr(planner, "fingerprint", "") != spec.fingerprint:
            raise InputError(f"{spec.label}: its files have changed since the sweep has begun")
        flight = rollout(
            entry.scenario,
            planner,
            seed=entry.seed,
            dynamics=entry.dynamics,
            safety_filter=True if entry.safety_filter else None,
        )
    except (InputError, PlannerError) as error:
        return Row.failed(entry, str(error), source_sha256)
    except Exception as error:  # an error in one flight must not end the sweep
        return Row.failed(entry, described(error), source_sha256)
    if flight.ended == "stopped":
        return None
    if keep is not None:
        flight.save(keep / kept_as(entry), overwrite=True)
    return Row.of(entry, flight, source_sha256)


def _end_with(owner: int) -> None:
    """Let this process end when its owner is gone: after a kill -9 it would wait for minutes."""

    def watch() -> None:
        while os.getppid() == owner:
            time.sleep(_SECONDS_BETWEEN_LOOKS)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _join_ray(jobs: int) -> None:
    """Make Ray known to joblib, and start a local cluster where there is none to join."""
    try:
        import ray
        from ray.util.joblib.ray_backend import RayBackend
    except ImportError as error:
        raise InputError(
            f"--backend ray: Ray cannot be loaded ({error}); "
            "python -m pip install 'uas-coverage-env[cluster]'"
        ) from error

    class Returning(RayBackend):
        # its pool does hand over each result as it comes; joblib declares this off for all pools,
        # because one that is not read to the end would block for ever: this one is read to the end
        supports_return_generator = True

    if not ray.is_initialized():
        local: dict[str, Any] = {}
        if "RAY_ADDRESS" not in os.environ:
            local = {"num_cpus": None if jobs < 0 else jobs, "include_dashboard": False}
        ray.init(**local, log_to_driver=False, logging_level=logging.ERROR)
    from joblib import register_parallel_backend

    register_parallel_backend("uas-ray", Returning)

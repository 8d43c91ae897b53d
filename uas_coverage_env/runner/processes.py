"""Processes beside this one, each with a pipe of its own: one that is killed harms no other."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from uas_coverage_env.runner.jobs import Job, Lost, done

_AT_LEAST_S = 1.0
"""Ctrl-C just before a wait begins does not end it: so none lasts longer [s]."""


@dataclass(frozen=True)
class _Worker:
    process: BaseProcess
    pipe: Connection

    def end(self) -> None:
        self.process.kill()
        self.process.join()
        self.pipe.close()


class Processes:
    """A crew on this machine, see `Crew`.

    Args:
        count: Processes at most.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._idle: list[_Worker] = []
        self._busy: dict[Connection, tuple[_Worker, Job]] = {}

    def size(self) -> int:
        """See `Crew`."""
        return self._count

    def begin(self, job: Job, work: bytes) -> None:
        """See `Crew`."""
        while True:
            worker = self._idle.pop() if self._idle else _started()
            try:
                worker.pipe.send_bytes(work)
            except OSError:  # it was killed while it waited
                worker.end()
                continue
            self._busy[worker.pipe] = worker, job
            return

    def finished(self) -> list[tuple[Job, bytes | Lost]]:
        """See `Crew`."""
        found: list[tuple[Job, bytes | Lost]] = []
        for pipe in wait(list(self._busy), _AT_LEAST_S):
            assert isinstance(pipe, Connection)
            worker, job = self._busy[pipe]
            try:
                result: bytes | Lost = pipe.recv_bytes()
            except (EOFError, OSError):
                worker.end()
                result = Lost(f"its process ended ({_why(worker.process.exitcode)})")
            else:
                self._idle.append(worker)
            del self._busy[pipe]
            found.append((job, result))
        return found

    def abandon(self) -> None:
        """See `Crew`."""
        while self._busy:
            _, (worker, _) = self._busy.popitem()
            worker.end()

    def close(self) -> None:
        """See `Crew`."""
        self.abandon()
        while self._idle:
            self._idle.pop().end()


def _started() -> _Worker:
    # threads and compiled code do not survive a fork
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(theirs,), daemon=True)
    with _deaf_to_ctrl_c():
        process.start()
    theirs.close()  # so that the pipe ends with the process
    return _Worker(process, ours)


@contextmanager
def _deaf_to_ctrl_c() -> Iterator[None]:
    """What is started here does not hear Ctrl-C, which a terminal sends to all: its owner does."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    resource_tracker.ensure_running()  # to start it would undo what follows
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work(pipe: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_owner, daemon=True).start()
    while True:
        try:
            work = pipe.recv_bytes()
        except EOFError:
            return
        pipe.send_bytes(done(work))


def _end_with_owner() -> None:
    """After a kill -9 of the owner this process would fly on."""
    owner = multiprocessing.parent_process()
    if owner is not None:
        owner.join()
    os._exit(1)


def _why(exitcode: int | None) -> str:
    if exitcode is None or exitcode >= 0:
        return f"exit code {exitcode}"
    try:
        return f"by {signal.Signals(-exitcode).name}"
    except ValueError:
        return f"by signal {-exitcode}"

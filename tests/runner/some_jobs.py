"""Jobs that real processes do."""

import os
import signal
import sys
import time
from pathlib import Path

LONG_S = 60.0


def twice(number: int) -> int:
    """A quick one."""
    return 2 * number


def pid_after(seconds: float) -> int:
    """Of the process that does it."""
    time.sleep(seconds)
    return os.getpid()


def held() -> bool:
    """Whether Ctrl-C is held back from its process since it began."""
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, set())


def raises(what: str) -> None:
    """One that goes wrong."""
    raise ZeroDivisionError(what)


class OddError(Exception):
    """Cannot be made from its arguments."""

    def __init__(self, one: str, other: str) -> None:
        super().__init__(f"{one} and {other}")


def raises_oddly() -> None:
    """One whose exception cannot travel."""
    raise OddError("this", "that")


def not_picklable() -> object:
    """One whose result cannot travel."""
    return lambda: None


def killed_at_first(folder: str, times: int, number: int) -> int:
    """Kills its own process the first times that it is done."""
    for k in range(times):
        mark = Path(folder) / f"{number}-{k}"
        if not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
    return number


def noted(folder: str, number: int) -> int:
    """Notes that it was begun, and takes a while."""
    (Path(folder) / f"{number}-{os.getpid()}").touch()
    time.sleep(0.2)
    return number


def many(folder: str) -> None:
    """What a program does that is killed: jobs of ten seconds, side by side."""
    from uas_coverage_env.runner.jobs import Job
    from uas_coverage_env.runner.workers import Workers

    with Workers(2) as workers:
        jobs = [Job(str(k), long, (folder, k)) for k in range(4)]
        try:
            for _ in workers.run(jobs):
                pass
        except KeyboardInterrupt:
            workers.close()
            sys.exit(130)


def long(folder: str, number: int) -> None:
    """Notes its process, and takes long."""
    (Path(folder) / f"{number}-{os.getpid()}").touch()
    time.sleep(LONG_S)

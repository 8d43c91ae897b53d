"""kill -9 at random moments: nothing lost, nothing twice, the same result."""

import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from leaderboard_rows import flights_in

from uas_coverage_env.runner.store import STORE

KILLS = 5
PLANNERS = "hover,nearest-waypoint,random-walk"
SEEDS = 6
DEADLINE_S = 120.0

# imports and compiles once, then forks: a line of input is a command line, the answer a process
NURSERY = """
import os, shlex, sys
from uas_coverage_env import rollout
from uas_coverage_env.cli import main
for planner in ("hover", "nearest-waypoint", "random-walk"):
    rollout("open_field", planner, max_steps=2)
for line in sys.stdin:
    child = os.fork()
    if child == 0:
        with open(os.devnull, "w") as nothing:
            os.dup2(nothing.fileno(), 1)
        os._exit(main(shlex.split(line)))
    print(child, flush=True)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


@pytest.fixture
def nursery() -> Iterator[subprocess.Popen]:
    process = subprocess.Popen(
        [sys.executable, "-c", NURSERY], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    with process:
        yield process
        process.stdin.close()


def started(nursery: subprocess.Popen, scenarios: str, out: Path, jobs: int) -> int:
    """Begin a sweep; returns its process."""
    command = f"compare --scenarios '{scenarios}' --planners {PLANNERS} --seeds 0:{SEEDS}"
    return begun(nursery, command, out, jobs)


def begun(nursery: subprocess.Popen, command: str, out: Path, jobs: int) -> int:
    """Begin a command; returns its process."""
    nursery.stdin.write(f"{command} --jobs {jobs} --out '{out}'\n")
    nursery.stdin.flush()
    return int(nursery.stdout.readline())


def ended(nursery: subprocess.Popen) -> int:
    """Wait for the sweep; its exit code, or minus the signal that ended it."""
    return int(nursery.stdout.readline())


def count(out: Path) -> int:
    """Flights that a store holds, read while it is written."""
    try:
        with closing(sqlite3.connect(f"file:{out / STORE}?mode=ro", uri=True)) as reader:
            return reader.execute("SELECT count(*) FROM flights").fetchone()[0]
    except sqlite3.OperationalError:  # not made yet
        return 0


def children(process: int) -> set[int]:
    """The processes that a process has begun; none where there is no /proc."""
    return {int(path.parent.name) for path in _stats() if _stat(path)[1:2] == [str(process)]}


def workers(process: int) -> set[int]:
    """Those of them that fly."""
    found = set()
    for child in children(process):
        try:
            if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes():
                found.add(child)
        except OSError:
            pass
    return found


def alive(processes: set[int]) -> set[int]:
    """Which of them still run; a zombie does not."""
    return {n for n in processes if _stat(Path(f"/proc/{n}/stat"))[:1] not in ([], ["Z"], ["X"])}


def _stats() -> list[Path]:
    return list(Path("/proc").glob("[0-9]*/stat"))


def _stat(path: Path) -> list[str]:
    """State, parent, ... of a process; empty where it is gone."""
    try:
        return path.read_text().rpartition(")")[2].split()
    except OSError:
        return []


def soon(condition: Callable[[], bool]) -> bool:
    """Wait until it is so, or until it has taken too long."""
    until = time.monotonic() + DEADLINE_S
    while not condition() and time.monotonic() < until:
        time.sleep(0.001)
    return condition()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="os.fork is of POSIX systems")
def test_five_kills_at_random_moments_change_nothing(nursery, two_yards, tmp_path):
    total = 2 * len(PLANNERS.split(",")) * SEEDS
    rng = random.Random(0)
    killed, counts = tmp_path / "killed", [0]
    # right at the start, and in the middle; once with processes side by side
    targets = [0, 0, *sorted(rng.sample(range(total - 4), KILLS - 2))]
    for n, target in enumerate(targets):
        jobs = 2 if n == KILLS // 2 else 1
        child = started(nursery, two_yards, killed, jobs)
        least = target if jobs == 1 else max(target, counts[-1] + 1)
        assert soon(lambda least=least: count(killed) >= least)
        time.sleep(rng.uniform(0.0, 0.03))
        helpers = children(child)
        assert jobs == 1 or helpers or not _stats()
        os.kill(child, signal.SIGKILL)
        assert ended(nursery) == -signal.SIGKILL, "it was over before it was killed"
        assert soon(lambda helpers=helpers: not alive(helpers)), "they outlive their owner"
        counts.append(count(killed))
        assert least <= counts[-1] < total
    assert counts == sorted(counts), "something was lost"
    assert not (killed / "table.md").exists()

    started(nursery, two_yards, killed, jobs=1)
    assert ended(nursery) == 0
    started(nursery, two_yards, tmp_path / "calm", jobs=1)
    assert ended(nursery) == 0
    assert count(killed) == total
    assert flights_in(killed) == flights_in(tmp_path / "calm")
    with closing(sqlite3.connect(killed / STORE)) as store:
        assert store.execute("PRAGMA integrity_check").fetchall() == [("ok",)]


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="/proc is of Linux")
@pytest.mark.parametrize(
    ("command", "total"),
    [
        ("compare --scenarios {yards} --planners hover,random-walk --seeds 0:8 --no-bounds", 32),
        ("score --level hard --planners hover,nearest-waypoint --missions 6", 12),
        ("planner demonstrate generated:900000:900008 --planner nearest-waypoint", 8),
    ],
)
def test_a_worker_that_is_killed_costs_no_flight_of_any_command(
    nursery, two_yards, tmp_path, command, total
):
    asked = command.format(yards=f"'{two_yards}'")
    killed = tmp_path / "killed"
    owner = begun(nursery, asked, killed, jobs=2)
    assert soon(lambda: count(killed) >= 1)
    os.kill(workers(owner).pop(), signal.SIGKILL)
    assert count(killed) < total, "it was over before"
    assert ended(nursery) == 0
    assert count(killed) == total
    begun(nursery, asked, tmp_path / "calm", jobs=1)
    assert ended(nursery) == 0
    assert flights_in(killed) == flights_in(tmp_path / "calm")
    shown = sorted(path.name for path in killed.glob("*.npz"))
    assert shown == sorted(path.name for path in (tmp_path / "calm").glob("*.npz"))
    for name in shown:
        assert (killed / name).read_bytes() == (tmp_path / "calm" / name).read_bytes()

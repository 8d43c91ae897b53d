"""The runner with real processes: nothing lost, nothing twice, whatever is killed."""

import _thread
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import some_jobs

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.runner.jobs import Job
from uas_coverage_env.runner.workers import WorkerLostError, Workers

HERE = Path(__file__).parent
DEADLINE_S = 60.0


def run(workers, *work):
    return {job.key: result for job, result in workers.run(work)}


def soon(condition):
    until = time.monotonic() + DEADLINE_S
    while not condition() and time.monotonic() < until:
        time.sleep(0.01)
    return condition()


@pytest.fixture(scope="module")
def pair():
    with Workers(2) as workers:
        yield workers


@pytest.mark.parametrize("count", [1, 2])
def test_every_job_is_done_once(count):
    work = [Job(str(k), some_jobs.twice, (k,)) for k in range(20)]
    with Workers(count) as workers:
        found = list(workers.run(work))
    assert sorted((int(job.key), result) for job, result in found) == [
        (k, 2 * k) for k in range(20)
    ]


def test_one_at_a_time_is_done_in_this_process_and_more_are_not(pair):
    work = [Job(str(k), some_jobs.pid_after, (0.1,)) for k in range(4)]
    assert set(run(Workers(1), *work).values()) == {os.getpid()}
    first = set(run(pair, *work).values())
    assert len(first) == 2
    assert os.getpid() not in first
    assert set(run(pair, *work).values()) == first, "they wait for more"


def test_a_process_that_is_killed_loses_no_job_and_does_none_twice(pair, tmp_path):
    before = set(
        run(
            pair, Job("a", some_jobs.pid_after, (0.1,)), Job("b", some_jobs.pid_after, (0.1,))
        ).values()
    )
    work = [Job(str(k), some_jobs.killed_at_first, (str(tmp_path), 2, k)) for k in range(3)]
    work += [Job(str(k), some_jobs.noted, (str(tmp_path), k)) for k in range(3, 9)]
    found = list(pair.run(work))
    assert sorted(result for _, result in found) == list(range(9))
    after = set(
        run(
            pair, Job("a", some_jobs.pid_after, (0.1,)), Job("b", some_jobs.pid_after, (0.1,))
        ).values()
    )
    assert not before & after


def test_a_process_that_is_killed_from_outside_is_replaced(pair, tmp_path):
    def kill():
        assert soon(lambda: any(tmp_path.iterdir()))
        os.kill(int(next(tmp_path.iterdir()).name.partition("-")[2]), signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    work = [Job(str(k), some_jobs.noted, (str(tmp_path), k)) for k in range(8)]
    found = [result for _, result in pair.run(work)]
    killer.join()
    assert sorted(found) == list(range(8))
    assert len(list(tmp_path.iterdir())) == 9, "one was begun twice"


def test_a_process_that_is_killed_while_it_waits_is_replaced(pair):
    (pid,) = run(pair, Job("a", some_jobs.pid_after, (0.0,))).values()
    os.kill(pid, signal.SIGKILL)
    time.sleep(0.1)
    assert run(pair, Job("a", some_jobs.twice, (4,))) == {"a": 8}


def test_a_job_that_kills_whatever_does_it_is_given_up_and_the_others_are_done(pair, tmp_path):
    work = [Job("village hover 0", some_jobs.killed_at_first, (str(tmp_path), 99, 0))]
    work += [Job(str(k), some_jobs.twice, (k,)) for k in range(1, 6)]
    found = []
    with pytest.raises(WorkerLostError, match=r"village hover 0: .*SIGKILL.*3 times"):
        found.extend(result for _, result in pair.run(work))
    assert sorted(found) == [2, 4, 6, 8, 10]
    assert len(list(tmp_path.iterdir())) == 3


def test_what_a_job_raises_is_raised_here_and_the_next_ones_can_be_done(pair):
    with pytest.raises(ZeroDivisionError, match="of the plan"):
        run(pair, Job("a", some_jobs.raises, ("of the plan",)))
    with pytest.raises(InputError, match="OddError: this and that"):
        run(pair, Job("a", some_jobs.raises_oddly))
    with pytest.raises(Exception, match="pickle"):
        run(pair, Job("a", some_jobs.not_picklable))
    assert run(pair, Job("a", some_jobs.twice, (1,))) == {"a": 2}


def test_what_is_under_way_ends_where_nobody_wants_the_rest(pair, tmp_path):
    work = [Job("quick", some_jobs.twice, (1,)), Job("long", some_jobs.long, (str(tmp_path), 0))]
    results = pair.run(work)
    assert next(results)[1] == 2
    assert soon(lambda: any(tmp_path.iterdir()))
    pid = int(next(tmp_path.iterdir()).name.partition("-")[2])
    results.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
    assert run(pair, Job("a", some_jobs.twice, (3,))) == {"a": 6}


@pytest.mark.skipif(os.name != "posix", reason="POSIX")
def test_ctrl_c_is_for_the_owner_alone_from_the_start_of_a_process_on(pair):
    assert run(pair, Job("a", some_jobs.held)) == {"a": True}
    assert not some_jobs.held()


@pytest.fixture
def heeding_ctrl_c():
    """Shells start what runs in the background so that it ignores Ctrl-C; it would be no signal."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heeding_ctrl_c")
def test_ctrl_c_just_before_it_waits_ends_the_wait_before_the_jobs_do(pair, tmp_path):
    # this says that a signal has come, and interrupts no call of the system
    threading.Timer(0.5, _thread.interrupt_main).start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        run(pair, Job("long", some_jobs.long, (str(tmp_path), 0)))
    assert time.monotonic() - began < some_jobs.LONG_S


@pytest.mark.skipif(os.name != "posix", reason="POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_the_processes_end_with_their_owner(tmp_path, number):
    code = f"import sys; sys.path.insert(0, {str(HERE)!r})\n"
    code += f"import some_jobs; some_jobs.many({str(tmp_path)!r})"
    owner = subprocess.Popen(
        [sys.executable, "-c", code], start_new_session=True, stderr=subprocess.PIPE, text=True
    )
    assert soon(lambda: len(list(tmp_path.iterdir())) == 2)
    if number == signal.SIGINT:  # as a terminal does it: to all of them
        os.killpg(owner.pid, number)
    else:
        os.kill(owner.pid, number)
    _, said = owner.communicate(timeout=DEADLINE_S)
    assert owner.returncode == (130 if number == signal.SIGINT else -number)
    assert "Traceback" not in said
    pids = [int(path.name.partition("-")[2]) for path in tmp_path.iterdir()]

    def gone(pid):
        try:
            return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
        except OSError:
            return True

    assert soon(lambda: all(map(gone, pids)))


def test_how_many_there_are_is_what_was_asked_for_or_the_cores(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 6)
    assert [Workers(count).count for count in (None, 1, 3)] == [6, 1, 3]
    assert str(Workers(3)) == "3 flights side by side"
    assert str(Workers(None, "ray")) == "as many flights side by side as the cluster has cores"

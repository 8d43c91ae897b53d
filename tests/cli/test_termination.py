"""Ctrl-C, SIGTERM and SIGHUP: one line, and what was flown is kept."""

import errno
import io
import json
import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from functools import partial

import pytest
from leaderboard_rows import flights_in
from rich.console import Console

from uas_coverage_env import Flight, load_scenario
from uas_coverage_env.cli import app, main, progress, run

pytestmark = pytest.mark.usefixtures("elsewhere")


@contextmanager
def ending(number):
    """In place of what is shown: a signal that comes at the fourth step."""

    def on_step(progress):
        if progress.swarm.step == 4:
            os.kill(os.getpid(), number)

    yield on_step


@pytest.mark.parametrize(
    "name",
    [
        "SIGTERM",
        pytest.param("SIGHUP", marks=pytest.mark.skipif(os.name != "posix", reason="POSIX")),
    ],
)
def test_a_scheduler_or_a_lost_terminal_ends_a_flight_as_ctrl_c_does_and_what_was_flown_is_kept(
    elsewhere, monkeypatch, name
):
    number = getattr(signal, name)
    before = signal.signal(number, signal.SIG_DFL)  # tests may run under nohup themselves
    monkeypatch.setattr(run, "shown", lambda *_, **__: ending(number))
    try:
        assert main(["run", "open_field", "--planner", "hover", "--out", "mine"]) == 128 + number
    finally:
        after = signal.signal(number, before)
    flight = Flight.load("mine")
    assert flight.ended == "stopped"
    assert 4 <= flight.steps <= 5
    assert after is signal.SIG_DFL


@pytest.mark.skipif(os.name != "posix", reason="POSIX")
def test_nohup_flies_on_when_the_terminal_is_lost(elsewhere, monkeypatch):
    handler = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    monkeypatch.setattr(run, "shown", lambda *_, **__: ending(signal.SIGHUP))
    try:
        main(["run", "open_field", "--planner", "hover", "--steps", "6", "--out", "mine"])
    finally:
        signal.signal(signal.SIGHUP, handler)
    assert Flight.load("mine").steps == 6


class _Gone(io.StringIO):
    """A terminal or a pipe whose other end goes away once something has been written."""

    def __init__(self, reason, *, terminal):
        super().__init__()
        self.reason, self.terminal = reason, terminal

    def isatty(self):
        return self.terminal

    def write(self, text):
        if self.tell():
            raise OSError(self.reason, os.strerror(self.reason))
        return super().write(text)


@pytest.mark.parametrize("terminal", [False, True])
def test_a_terminal_that_is_gone_takes_no_flight_with_it(elsewhere, monkeypatch, terminal):
    monkeypatch.setattr(progress, "_SECONDS_BETWEEN_LINES", 0.0)
    with monkeypatch.context() as gone:
        gone.setattr(sys, "stdout", _Gone(errno.EIO, terminal=terminal))
        main(["run", "open_field", "--planner", "hover", "--steps", "6", "--out", "mine"])
    assert Flight.load("mine").steps == 6


@pytest.mark.parametrize("error", [OSError, SystemExit])
def test_other_errors_than_those_of_the_terminal_are_not_hidden(error):
    def fails():
        raise error

    out = Console(file=_Gone(errno.EIO, terminal=True), force_terminal=True)
    with pytest.raises(error), progress.shown(out, load_scenario("open_field")):
        fails()


@pytest.mark.usefixtures("python_handles_interrupts")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_a_flight_is_written_does_not_lose_it(elsewhere, monkeypatch, number):
    save = Flight.save

    def interrupted(*args, **kwargs):
        signal.raise_signal(number)
        save(*args, **kwargs)

    monkeypatch.setattr(Flight, "save", interrupted)
    main(["run", "open_field", "--planner", "hover", "--steps", "2", "--out", "mine"])
    assert Flight.load("mine").steps == 2


@pytest.mark.usefixtures("python_handles_interrupts")
def test_ctrl_c_during_the_report_does_not_say_that_nothing_was_kept(
    elsewhere, monkeypatch, capsys
):
    monkeypatch.setattr(run, "report_flight", lambda *_: signal.raise_signal(signal.SIGINT))
    assert main(["run", "open_field", "--planner", "hover", "--steps", "2", "--out", "mine"]) == 130
    assert Flight.load("mine").steps == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert said == "error: stopped by hand; what was finished before is kept"


@pytest.mark.usefixtures("python_handles_interrupts")
@pytest.mark.parametrize("when", ["command_group", "_never_stop_at_a_letter"])
def test_ctrl_c_before_a_command_begins_is_one_line(monkeypatch, capsys, when):
    monkeypatch.setattr(app, when, lambda: signal.raise_signal(signal.SIGINT))
    assert main(["planner", "list"]) == 130
    said = capsys.readouterr().err
    assert said == "error: stopped by hand; what was finished before is kept\n"


def test_an_error_without_an_interruption_is_none_of_these(monkeypatch):
    monkeypatch.setattr(app, "command_group", partial(json.loads, "a mistake of ours"))
    with pytest.raises(json.JSONDecodeError):
        main(["planner", "list"])


@pytest.mark.usefixtures("python_handles_interrupts")
def test_an_interruption_that_a_library_turns_into_an_error_is_one_line(monkeypatch, capsys):
    def compare():  # as numpy does while it compares structured arrays
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt as interruption:
            raise TypeError("cannot compare") from interruption

    monkeypatch.setattr(app, "command_group", compare)
    assert main(["planner", "list"]) == 130
    assert capsys.readouterr().err == "error: stopped by hand (TypeError)\n"


STOPPED = """
import signal
import subprocess

from uas_coverage_env.flight import load_planner


class Stopped:
    def __init__(self):
        self._hovers = load_planner("hover")

    def reset(self, brief, seed):
        self._hovers.reset(brief, seed)

    def act(self, swarm):
        signal.raise_signal(signal.SIGTERM)
        return self._hovers.act(swarm)
"""


def test_a_mission_that_is_stopped_by_hand_is_not_scored(elsewhere, monkeypatch, capsys):
    (elsewhere / "stopped_planner.py").write_text(STOPPED)
    monkeypatch.syspath_prepend(elsewhere)
    asked = ["score", "--planners", "stopped_planner:Stopped", "--jobs", "1", "--out", "kept"]
    assert main(asked) == main(asked) == 143
    assert flights_in("kept") == []
    said = capsys.readouterr().err.splitlines()[-1]
    assert said == "error: stopped by hand; what was finished before is kept"


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_process_that_is_stopped_keeps_the_flight_and_tells_the_signal(elsewhere, name):
    number = getattr(signal, name)
    command = ["run", "open_field", "--planner", "hover", "--out", "mine"]
    started = subprocess.Popen(
        [sys.executable, "-m", "uas_coverage_env", *command],
        # as a shell starts it, also where the tests run in the background or under nohup
        preexec_fn=lambda: (
            signal.signal(signal.SIGINT, signal.default_int_handler),
            signal.signal(signal.SIGHUP, signal.SIG_DFL),
        ),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert started.stdout is not None
    assert started.stdout.readline().startswith("step 0/")
    started.send_signal(number)
    _, said = started.communicate()
    assert started.returncode == 128 + number
    assert said.splitlines()[-1] == "error: stopped by hand; what was finished before is kept"
    assert Flight.load("mine").ended == "stopped"

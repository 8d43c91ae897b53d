"""Code of a user that fails is one line with the place in it, wherever it is flown."""

import json
import signal
import sys

import pytest
from leaderboard_rows import flights_in
from small_worlds import meadow
from uas_coverage_baselines.hover import Hover

from uas_coverage_env import Flight
from uas_coverage_env.cli import main
from uas_coverage_env.flight import PlannerError, load_planner, rollout

OWN = """\
import numpy as np

from uas_coverage_env import GoTo


class Fails:
    when = 3

    def reset(self, brief, seed):
        if self.when is None:
            return brief.no_such_field
        if self.when < 0:
            np.zeros(2) + np.zeros(3)

    def act(self, swarm):
        if swarm.step == self.when:
            invert()
        return {name: GoTo(0) for name in swarm.active}


def invert():
    np.linalg.inv(np.zeros((2, 2)))


class FailsAtOnce(Fails):
    when = 0


class NeverBegins(Fails):
    when = None


class Refuses(Fails):
    when = -1


class Tells(Fails):
    when = 99

    @property
    def last_decision(self):
        return 1 / 0


class Ceiling:
    def add_to(self, milp, v, problem):
        milp.subject_to("low", (1.0, v.no_such_variable), lower=-9.0)
"""


def line_of(text):
    """Where OWN has a text."""
    (number,) = [n for n, line in enumerate(OWN.splitlines(), start=1) if text in line]
    return f"(failing_code.py:{number})"


SINGULAR = f"LinAlgError: Singular matrix {line_of('np.linalg.inv')}"


@pytest.fixture(autouse=True)
def folder(elsewhere, monkeypatch):
    """A folder with a user's module and a small mission."""
    (elsewhere / "failing_code.py").write_text(OWN)
    monkeypatch.syspath_prepend(elsewhere)
    monkeypatch.delitem(sys.modules, "failing_code", raising=False)
    meadow(((100.0, 100.0, -25.0),)).to_file(elsewhere / "field.toml")
    return elsewhere


def said_of(capsys, *words, code=2):
    """What a command that ends with this code says last on stderr."""
    assert main(list(words)) == code
    err = capsys.readouterr().err
    assert "Traceback" not in err
    return err.splitlines()[-1]


def run(planner, *words):
    return ("run", "field.toml", "--planner", planner, "--out", "mine", *words)


def test_an_exception_in_a_planner_names_planner_step_and_place_and_keeps_the_flight(capsys):
    said = said_of(capsys, *run("failing_code:Fails"))
    assert said == (
        f"error: planner 'Fails' at step 3 (t = 3 s): {SINGULAR}; what was flown before is in mine"
    )
    flight = Flight.load("mine")
    assert (flight.steps, flight.ended) == (3, "stopped")


@pytest.mark.parametrize(
    ("planner", "said"),
    [
        ("FailsAtOnce", f"at step 0 (t = 0 s): {SINGULAR}"),
        ("NeverBegins", f"cannot begin scenario 'meadow': {{}} {line_of('no_such_field')}"),
        ("Refuses", f"refuses scenario 'meadow': {{}} {line_of('np.zeros(2) +')}"),
        ("Tells", f"at step 0 (t = 0 s): ZeroDivisionError: {{}} {line_of('1 / 0')}"),
    ],
)
def test_where_nothing_was_flown_no_folder_is_left(capsys, folder, planner, said):
    line = said_of(capsys, *run(f"failing_code:{planner}"))
    begin, _, end = said.partition("{}")
    assert line.startswith(f"error: planner '{planner}' {begin}")
    assert line.endswith(end)
    assert not (folder / "mine").exists()


def test_sorties_that_were_flown_before_are_kept(capsys, folder):
    said = said_of(capsys, *run("failing_code:Fails", "--sorties", "2"))
    assert said.endswith(f"{SINGULAR}; what was flown before is in mine")
    assert json.loads((folder / "mine" / "sorties.json").read_text())["ended"] == "stopped"


def test_a_score_says_the_same(capsys):
    asked = ("score", "--planners", "failing_code:Fails", "--missions", "1", "--jobs", "1")
    said = said_of(capsys, *asked, code=1)
    assert said.endswith(f"planner 'Fails' at step 3 (t = 3 s): {SINGULAR}")


def test_a_comparison_goes_on_and_says_the_same(capsys):
    where = ("--scenarios", "field.toml", "--seeds", "0:1", "--out", "sweep", "--jobs", "1")
    planners = ("--planners", "failing_code:Fails,hover")
    said = said_of(capsys, "compare", *where, *planners, "--no-bounds", code=1)
    assert said.endswith(f"planner 'Fails' at step 3 (t = 3 s): {SINGULAR}")
    assert [row.status for row in flights_in("sweep")] == ["failed", "flown"]


def test_an_exception_in_a_block_of_the_program_names_the_place(capsys):
    option = ("--option", "blocks=failing_code:Ceiling")
    said = said_of(capsys, *run("milp-mpc", "--steps", "2", *option))
    assert said.startswith("error: planner 'milp-mpc' cannot begin scenario 'meadow': Attribute")
    assert said.endswith(line_of("no_such_variable"))


def test_the_traceback_is_shown_to_who_asks_for_it(capsys, monkeypatch):
    monkeypatch.setenv("UAS_COVERAGE_TRACEBACK", "1")
    assert main(list(run("failing_code:FailsAtOnce"))) == 2
    err = capsys.readouterr().err
    assert "in invert\n" in err
    assert err.splitlines()[-1] == f"error: planner 'FailsAtOnce' at step 0 (t = 0 s): {SINGULAR}"


def test_in_python_the_exception_is_the_cause_and_the_flight_is_at_hand():
    with pytest.raises(PlannerError) as caught:
        rollout("field.toml", load_planner("failing_code:Fails"))
    assert type(caught.value.__cause__).__name__ == "LinAlgError"
    assert caught.value.flight.steps == 3


@pytest.mark.usefixtures("python_handles_interrupts")
def test_a_second_ctrl_c_that_comes_out_of_a_planner_as_an_error_is_no_error_of_it(
    capsys, monkeypatch
):
    def swallows(planner, swarm):
        try:
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt as interruption:
            raise TypeError("cannot compare") from interruption

    monkeypatch.setattr(Hover, "act", swallows)
    said = said_of(capsys, *run("hover"), code=130)
    assert said == "error: stopped by hand (PlannerError)"

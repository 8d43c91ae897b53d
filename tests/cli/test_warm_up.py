"""What the command line shows of compilations, and the command that brings them forward."""

import io
import subprocess
import sys

import numpy as np
import pytest
from rich.console import Console
from uas_coverage_baselines.hover import Hover

from uas_coverage_env.cli import main
from uas_coverage_env.cli import run as cli_run
from uas_coverage_env.cli.compilation import compilation_shown
from uas_coverage_env.compiled import progress
from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.compiled.progress import COMPILATIONS
from uas_coverage_env.compiled.purpose import compiling_for
from uas_coverage_env.flight import load_planner, planner_names


def test_a_terminal_shows_a_bar_while_kernels_are_compiled():
    shown = io.StringIO()
    screen = Console(file=shown, force_terminal=True, width=100)
    before = COMPILATIONS.listener
    with compilation_shown(screen):
        assert shown.getvalue() == ""
        with compiling_for("planner tour"):
            COMPILATIONS.listener(0.5)
        COMPILATIONS.listener(None)
    assert "compiling for planner tour" in shown.getvalue()
    assert "50%" in shown.getvalue()
    assert COMPILATIONS.listener is before


def test_a_log_keeps_the_line_of_the_library():
    before = COMPILATIONS.listener
    with compilation_shown(Console(file=io.StringIO())):
        assert COMPILATIONS.listener is before


def test_after_a_warm_up_a_run_compiles_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["planner", "warm-up", "--planner", "nearest-waypoint"]) == 0
    capsys.readouterr()
    n_compiled = COMPILATIONS.n_compiled
    assert main(["run", "open_field", "--planner", "nearest-waypoint", "--steps", "2"]) == 0
    assert main(["planner", "warm-up", "--planner", "nearest-waypoint"]) == 0
    assert COMPILATIONS.n_compiled == n_compiled
    assert "everything is compiled already: nearest-waypoint\n" in capsys.readouterr().out


FIRST_STEPS = """
from uas_coverage_env import uas_coverage_v0
from uas_coverage_env.compiled.progress import COMPILATIONS
for action in ("velocity", "waypoint"):
    env = uas_coverage_v0.parallel_env(action=action)
    env.reset(seed=0)
    env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    env = uas_coverage_v0.vector_env(2, action=action)
    env.reset(seed=0)
    env.step(env.action_space.sample())
print(COMPILATIONS.n_compiled)
"""


def test_after_a_warm_up_of_the_environments_no_process_compiles_for_them(monkeypatch, capsys):
    monkeypatch.setattr(progress, "PATIENCE_S", 1e9)
    assert main(["planner", "warm-up", "--planner", "hover", "--environments"]) == 0
    command = [sys.executable, "-c", FIRST_STEPS]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    assert done.stdout == "0\n"


@pytest.mark.slow
def test_a_warm_up_without_options_serves_the_first_commands_and_says_what_it_did(capsys):
    assert main(["planner", "warm-up"]) == 0
    done, others = capsys.readouterr().out.splitlines()
    assert done.endswith(": nearest-waypoint, trajectory, milp-mpc, environments")
    assert "--planner NAME" in others
    n_compiled = COMPILATIONS.n_compiled
    assert main(["planner", "warm-up", "--planner", "trajectory", "--environments"]) == 0
    assert COMPILATIONS.n_compiled == n_compiled


class Compiles(Hover):
    """A planner with a kernel that is on no disk yet."""

    def warm_up(self, brief):
        offset = float(np.random.default_rng().uniform())
        kernel(lambda x: x + offset)(1.0)


@pytest.mark.parametrize(("words", "lines"), [([], 1), (["--quiet"], 0), (["--json"], 0)])
def test_a_run_says_once_for_what_it_compiles_and_a_quiet_one_nothing(
    words, lines, elsewhere, monkeypatch, capfd
):
    monkeypatch.setattr(progress, "PATIENCE_S", 0.0)
    monkeypatch.setattr(COMPILATIONS, "told", set())
    monkeypatch.setattr(cli_run, "load_planner", lambda name, options: Compiles())
    assert main(["run", "open_field", "--planner", "hover", "--steps", "2", *words]) == 0
    err = capfd.readouterr().err
    assert err.count("compiling for planner ") == err.count("\n") == lines


def test_a_planner_that_is_not_known_is_refused(capsys):
    assert main(["planner", "warm-up", "--planner", "nobody"]) == 2
    assert capsys.readouterr().err.startswith("error: ")


@pytest.mark.slow
@pytest.mark.parametrize("name", planner_names())
def test_every_planner_can_be_warmed_up(name):
    assert load_planner(name)
    assert main(["planner", "warm-up", "--planner", name]) == 0

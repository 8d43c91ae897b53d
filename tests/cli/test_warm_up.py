"""What the command line shows of compilations, and the command that brings them forward."""

import io

import pytest
from rich.console import Console

from uas_coverage_env.cli import main
from uas_coverage_env.cli.compilation import compilation_shown
from uas_coverage_env.compiled import progress
from uas_coverage_env.compiled.progress import COMPILATIONS
from uas_coverage_env.flight import load_planner, planner_names


def test_a_terminal_shows_a_bar_while_kernels_are_compiled():
    shown = io.StringIO()
    screen = Console(file=shown, force_terminal=True, width=100)
    before = COMPILATIONS.listener
    with compilation_shown(screen):
        assert shown.getvalue() == ""
        COMPILATIONS.listener(0.5)
        COMPILATIONS.listener(None)
    assert "compiling for this machine, once" in shown.getvalue()
    assert "50%" in shown.getvalue()
    assert COMPILATIONS.listener is before


def test_a_log_keeps_the_line_of_the_library():
    before = COMPILATIONS.listener
    with compilation_shown(Console(file=io.StringIO())):
        assert COMPILATIONS.listener is before


def test_after_a_warm_up_a_run_compiles_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["warm-up", "--planner", "nearest-waypoint"]) == 0
    capsys.readouterr()
    n_compiled = COMPILATIONS.n_compiled
    assert main(["run", "open_field", "--planner", "nearest-waypoint", "--steps", "2"]) == 0
    assert main(["warm-up", "--planner", "nearest-waypoint"]) == 0
    assert COMPILATIONS.n_compiled == n_compiled
    assert "everything is compiled already" in capsys.readouterr().out


def test_a_warm_up_of_the_environments_leaves_them_nothing_to_compile(monkeypatch, capsys):
    monkeypatch.setattr(progress, "PATIENCE_S", 1e9)
    assert main(["warm-up", "--planner", "hover", "--environments"]) == 0
    n_compiled = COMPILATIONS.n_compiled
    from uas_coverage_env import uas_coverage_v0

    for action in ("velocity", "waypoint"):
        env = uas_coverage_v0.parallel_env(action=action)
        env.reset(seed=0)
        env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    assert COMPILATIONS.n_compiled == n_compiled


def test_a_planner_that_is_not_known_is_refused(capsys):
    assert main(["warm-up", "--planner", "nobody"]) == 2
    assert capsys.readouterr().err.startswith("error: ")


@pytest.mark.slow
@pytest.mark.parametrize("name", planner_names())
def test_every_planner_can_be_warmed_up(name):
    assert load_planner(name)
    assert main(["warm-up", "--planner", name]) == 0

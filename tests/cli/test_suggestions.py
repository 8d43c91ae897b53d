"""What is misspelt is answered with what was meant, and a shell completes it before."""

import os
import shutil
import subprocess
import sys

import pytest

from uas_coverage_env.cli import main
from uas_coverage_env.files.suggestions import did_you_mean
from uas_coverage_env.tasks import LEVELS

pytestmark = pytest.mark.usefixtures("elsewhere")


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (["run", "vilage"], "unknown scenario 'vilage'; did you mean village?"),
        (["scenario", "check", "Village"], "did you mean village?"),
        (["run", "generatd:5"], "did you mean generated:5?"),
        (["run", "twon:5"], "did you mean town:5?"),
        (["figure", ".", "--kind", "maps"], "--kind 'maps': did you mean map?"),
        (
            ["run", "village", "--seed", "-1"],
            "Invalid value for '--seed': '-1' should be greater than or equal to 0",
        ),
        (["run", "generated"], "did you mean generated:SEED?"),
        (["compare", "--scenarios", "dve", "--planners", "tour", "--out", "o"], "mean dev?"),
        (["compare", "--scenarios", "tets", "--planners", "tour", "--out", "o"], "mean test?"),
        (["score", "--level", "eays", "--out", "o"], "--level 'eays': did you mean easy?"),
        (["run", "village", "--planner", "nearst-waypoint"], "did you mean nearest-waypoint?"),
        (["run", "village", "--planner", "polisy:mine"], "did you mean policy:mine?"),
        (["planner", "list", "lawn-mower"], "did you mean lawnmower?"),
        (["run", "village", "--planner", "tour", "--option", "move=3"], "did you mean moves?"),
        (["run", "village", "--planer", "tour"], "Did you mean '--planner'?"),
        (["vehicle", "check", "S500V2"], "did you mean s500_v2?"),
        (["scenario", "chek", "village"], "Did you mean 'check'?"),
        (["scenario", "show", "village"], "No such command 'show'. Take list, check, new, resume."),
        (["fly", "village"], "No such command 'fly'. See `uas-coverage --help`."),
    ],
)
def test_a_misspelt_name_is_answered_with_the_one_that_was_meant(words, answer, capsys):
    assert main(words) == 2
    line = capsys.readouterr().err
    assert answer in line
    assert line.count("\n") == 1


def test_a_name_that_is_like_none_is_answered_with_them_all(capsys):
    assert main(["run", "atlantis"]) == 2
    err = capsys.readouterr().err
    assert (
        "take air_taxi, corridor, gasche2025, indoor, karhula, mixed_fleet, open_field, village,"
        in err
    )
    assert did_you_mean("", ["village"], "take village") == "take village"
    assert did_you_mean("a3c", ["ppo", "sac"], "take ppo or sac") == "take ppo or sac"


@pytest.mark.parametrize("seed", ["x", "-1", "1.5", "0:3", "9" * 5000, ""])
def test_a_seed_that_is_none_is_refused_with_an_example(seed, capsys):
    assert main(["run", f"generated:{seed}", "--planner", "hover"]) == 2
    err = capsys.readouterr().err
    assert "should be generated:SEED with one whole number" in err
    assert len(err) < 300


def test_a_generated_scenario_is_checked_and_flown_by_its_name(elsewhere, capsys):
    from uas_coverage_env.flight import Flight
    from uas_coverage_env.scenario import sample_scenario

    words = ["run", "generated:3", "--planner", "hover", "--steps", "1", "--out", "mine"]
    assert main(words) == 0
    assert Flight.load("mine").scenario == sample_scenario(3)
    assert main(["scenario", "check", "generated:3"]) == 0
    assert (elsewhere / f"{sample_scenario(3).name}.png").exists()


@pytest.mark.parametrize("words", [[], ["run"], ["scenario", "list"], ["vehicle", "new"]])
def test_a_flag_takes_no_value_and_is_shown_with_none(words, capsys):
    assert main([*words, "--help"]) == 0
    out = capsys.readouterr().out
    assert "--help" in out
    assert "<bool>" not in out


def completed(*words, index):
    """What a shell is offered."""
    ended = subprocess.run(
        [sys.executable, "-m", "uas_coverage_env"],
        env={
            **os.environ,
            "_UAS_COVERAGE_COMPLETE": "complete_bash",
            "COMP_WORDS": " ".join(["uas-coverage", *words]),
            "COMP_CWORD": str(index),
        },
        capture_output=True,
        text=True,
    )
    assert ended.stderr == ""
    return ended.stdout.split()


def test_a_shell_completes_commands_options_scenarios_and_planners():
    assert {"run", "replay"} <= set(completed("r", index=1))
    assert completed("run", "--pl", index=2) == ["--planner"]
    assert completed("run", "vil", index=2) == ["village"]
    assert "nearest-waypoint" in completed("run", "village", "--planner", "n", index=4)


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_the_script_for_a_shell_is_printed():
    # it is the shell that asks
    asked = f"{sys.executable} -m uas_coverage_env --show-completion; true"
    ended = subprocess.run(["bash", "-c", asked], capture_output=True, text=True)
    assert "_UAS_COVERAGE_COMPLETE=complete_bash" in ended.stdout


def test_one_planner_is_described_at_length(capsys):
    assert main(["planner", "list", "tour"]) == 0
    out = capsys.readouterr().out
    assert "Before take-off" in out, "more than the line of the list"
    assert "moves" in out
    assert "2000000" in out
    assert "changes tried by the order search" in out
    assert "nearest-waypoint" not in out
    assert main(["planner", "list", "policy"]) == 0
    assert "policy:DIR" in capsys.readouterr().out


def test_scenarios_are_listed_with_what_draws_others_and_the_levels(capsys):
    assert main(["scenario", "list"]) == 0
    listed = capsys.readouterr().out
    assert "village" in listed
    assert "generated:SEED" in listed
    assert all(f"level {level}: {task.meaning}" in listed for level, task in LEVELS.items())

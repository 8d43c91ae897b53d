"""`uas-coverage train`: what it leaves, how it goes on, and what it refuses in a line."""

import csv
import shutil
import signal
import subprocess
import sys
import time

import pytest
from leaderboard_rows import flights_in
from tiny_trainings import ON_POLICY
from uas_coverage_agents import training
from uas_coverage_agents.policy import load_policy
from uas_coverage_agents.training import command, curve
from uas_coverage_agents.training.checkpoint import CHECKPOINT
from uas_coverage_agents.training.settings import settings_of

from uas_coverage_env.cli import main
from uas_coverage_env.flight import evaluate
from uas_coverage_env.leaderboard import Row
from uas_coverage_env.runner.store import opened, rows_in
from uas_coverage_env.runner.workers import WorkerLostError, Workers

CHANGES = [word for change in (*ON_POLICY, "num_envs=1") for word in ("--set", change)]
USUAL = ["--missions", "1", "--jobs", "1", *CHANGES]


def train(directory, *arguments: str) -> int:
    beside = [] if "--baselines" in arguments else ["--baselines", "nearest-waypoint"]
    return main(["train", "ppo", *USUAL, *beside, "--out", str(directory), *arguments])


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A training that nothing disturbed."""
    directory = tmp_path_factory.mktemp("trained") / "run"
    assert train(directory) == 0
    return directory


@pytest.fixture
def curve_without_picture(monkeypatch):
    """To draw the curve takes longer than to learn."""
    monkeypatch.setattr(curve, "write", curve.write_table)


def refusal(capsys, *arguments: str) -> str:
    assert main(["train", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    return err


def read_curve(directory) -> list[dict[str, str]]:
    return list(csv.DictReader((directory / "learning_curve.csv").read_text().splitlines()))


def test_a_training_leaves_a_policy_a_curve_and_its_logs(trained):
    policy = load_policy(trained / "policy")
    assert policy.description.interface == "environment"
    assert policy.description.training.algorithm == "ppo"
    assert policy.description.training.steps >= 64
    assert policy.description.score.missions == 1
    rows = read_curve(trained)
    assert [int(row["steps"]) for row in rows] == [0, 32, 64]
    assert (trained / "learning_curve.png").read_bytes().startswith(b"\x89PNG")
    assert list((trained / "tensorboard").iterdir())
    assert (trained / CHECKPOINT).is_file()
    assert not [*trained.rglob("*.zip"), *trained.rglob("*.pkl"), *trained.rglob("*.pth")]


def test_the_curve_has_the_default_return_and_stands_beside_planners_that_do_not_learn(trained):
    (beside,) = read_curve(trained / "baselines" / "nearest-waypoint")
    rows = {row.label: row for row in rows_in(trained, Row)}
    assert float(beside["return"]) == rows["nearest-waypoint"].episode_return
    returns = [float(row["return"]) for row in read_curve(trained)]
    for steps, expected in zip((0, 32, 64), returns, strict=True):
        assert rows[f"policy of seed 0 after {steps} steps"].episode_return == expected
    assert len(rows) == 4, "the score is of a mission that the curve has"
    score = load_policy(trained / "policy").description.score
    assert score.measures["episode_return"].mean == returns[-1]


@pytest.mark.usefixtures("curve_without_picture")
def test_a_policy_of_a_scenario_flies_there_as_it_was_scored(tmp_path):
    more = ["--scenario", "open_field", "--baselines", "none"]
    assert train(tmp_path / "run", *more) == 0
    policy = load_policy(tmp_path / "run" / "policy")
    assert policy.description.scenarios.name == "open_field"
    rules = {"return_mode": True, "safety_filter": True}
    flown = evaluate(f"policy:{tmp_path / 'run' / 'policy'}", "open_field", seeds=[0], **rules)
    scored = policy.description.score.measures["episode_return"].mean
    assert flown.mean("episode_return") == scored


def test_a_killed_training_goes_on_to_the_same_weights(trained, tmp_path, capsys):
    script = "import sys; from uas_coverage_env.cli import main; sys.exit(main())"
    words = [sys.executable, "-c", script, "train", "ppo", *USUAL, "--baselines", "none"]
    directory = tmp_path / "killed"
    process = subprocess.Popen(
        [*words, "--out", str(directory)], stdout=subprocess.DEVNULL, cwd=tmp_path
    )
    while not (directory / CHECKPOINT).exists():
        assert process.poll() is None, "it should be at work still"
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert train(directory) == 0
    assert "going on with the training there" in capsys.readouterr().out
    killed, undisturbed = load_policy(directory / "policy"), load_policy(trained / "policy")
    assert killed.description.weights_sha256 == undisturbed.description.weights_sha256
    steps = [[row["steps"] for row in read_curve(run)] for run in (directory, trained)]
    assert steps[0] == steps[1]
    kept = [
        [row for row in flights_in(run) if "policy" in row.label] for run in (directory, trained)
    ]
    assert kept[0] == kept[1], "no flight is lost, and none is there twice"


def test_the_same_command_again_says_the_same_without_training(trained, capsys):
    before = (trained / "policy" / "policy.safetensors").read_bytes()
    rows = read_curve(trained)
    assert train(trained) == 0
    assert "going on" in capsys.readouterr().out
    assert (trained / "policy" / "policy.safetensors").read_bytes() == before
    assert read_curve(trained) == rows


@pytest.mark.usefixtures("curve_without_picture")
def test_several_seeds_are_trained_in_processes_to_what_each_comes_to_by_itself(trained, tmp_path):
    more = ["--seed", "0:2", "--jobs", "2", "--baselines", "none"]
    assert train(tmp_path / "both", *more) == 0
    folders = sorted(path.name for path in (tmp_path / "both").glob("seed-*"))
    assert folders == ["seed-0", "seed-1"]
    first, second = (load_policy(tmp_path / "both" / name / "policy") for name in folders)
    alone = load_policy(trained / "policy").description.weights_sha256
    assert first.description.weights_sha256 == alone != second.description.weights_sha256
    assert {row.label for row in rows_in(tmp_path / "both", Row)} == {
        f"policy of seed {seed} after {steps} steps" for seed in (0, 1) for steps in (0, 32, 64)
    }


def test_a_job_that_kills_every_process_ends_a_training_in_a_line(tmp_path, monkeypatch, capsys):
    def lost(self, jobs):
        raise WorkerLostError("run: its process ended (by SIGKILL), 3 times")

    monkeypatch.setattr(Workers, "run", lost)
    assert train(tmp_path / "run", "--baselines", "none") == 1
    assert "3 times; the same command goes on" in capsys.readouterr().err


def test_ctrl_c_says_that_the_same_command_goes_on(tmp_path, monkeypatch, capsys):
    def stopped(self, jobs):
        raise KeyboardInterrupt

    monkeypatch.setattr(Workers, "run", stopped)
    assert train(tmp_path / "run", "--baselines", "none") == 130
    assert "the same command goes on from the last checkpoint" in capsys.readouterr().out


def test_other_settings_are_not_mixed_into_a_training(trained, capsys):
    for arguments in (["--seed", "1"], ["--set", "learning.gamma=0.5"], ["--steps", "32"]):
        line = refusal(capsys, "ppo", *USUAL, "--out", str(trained), *arguments)
        assert "holds the flights of another command: " in line


@pytest.mark.usefixtures("curve_without_picture")
def test_overwrite_starts_anew_and_removes_only_what_is_ours(trained, tmp_path):
    directory = shutil.copytree(trained, tmp_path / "run")
    (directory / "notes.txt").write_text("mine")
    assert train(directory, "--steps", "16", "--overwrite") == 0
    assert load_policy(directory / "policy").description.training.steps == 16
    assert (directory / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["a3c"], "unknown learner 'a3c'"),
        (["ppo", "--set", "speed=9"], "speed: unknown key"),
        (["ppo", "--scenario", "atlantis"], "atlantis"),
        (["ppo", "--steps", "0"], "--steps"),
        (["ppo", "--seed", "-1"], "--seed"),
        (["ppo", "--seed", "3:3"], "--seed '3:3'"),
        (["ppo", "--baselines", "nearest-waypiont"], "unknown planner"),
        (["td3", "--scenario", "easy"], "environment.action"),
        (["ppo", "--set", "learning.gama=1.0"], "gama"),
        (["learned-route", "--set", "num_envs=3"], "num_envs = 3: route-imitation reads none"),
        (["learned-route", "--set", "rounds=6"], "rounds is 6; give 7 or more"),
        (["learned-velocity", "--set", "learning.towns=6"], "[learning]: towns: unknown key"),
        (["nowhere:Learner"], "no module 'nowhere'"),
    ],
)
def test_mistakes_are_answered_in_a_line_and_leave_nothing(
    arguments, words, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    assert words in refusal(capsys, *arguments)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_with_something_else_is_left_alone(tmp_path, capsys):
    (tmp_path / "thesis.tex").write_text("years of work")
    for more in ([], ["--overwrite"]):
        line = refusal(capsys, "ppo", *USUAL, "--out", str(tmp_path), *more)
        assert "is not empty and holds no training" in line
    assert "is a file" in refusal(capsys, "ppo", "--out", str(tmp_path / "thesis.tex"))
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_two_trainings_do_not_work_in_one_folder(trained, capsys):
    changes = [*ON_POLICY, "num_envs=1"]
    record = command._record("ppo", settings_of("ppo", changes=changes), "0", 1)
    with opened(trained, record, Row):
        line = refusal(capsys, "ppo", *USUAL, "--out", str(trained))
    assert "another command is at work there" in line


def test_without_the_extra_the_line_says_what_to_install(monkeypatch, capsys, tmp_path):
    monkeypatch.setitem(sys.modules, "torch", None)
    monkeypatch.delattr(training, "rounds")
    for name in [name for name in sys.modules if name.startswith("uas_coverage_agents.training.")]:
        if not name.endswith((".command", ".settings")):
            monkeypatch.delitem(sys.modules, name)
    line = refusal(capsys, "ppo", "--out", str(tmp_path / "run"))
    assert "pip install 'uas-coverage-env[learn]'" in line
    assert not (tmp_path / "run").exists()


def test_a_checkpoint_that_was_put_there_by_another_is_refused(trained, tmp_path, capsys):
    directory = shutil.copytree(trained, tmp_path / "run")
    (directory / CHECKPOINT).write_bytes(b"none")
    assert train(directory) == 2
    err = capsys.readouterr().err
    assert "cannot be read" in err
    assert err.count("\n") == 1


def test_a_training_does_not_go_on_with_a_class_that_was_edited(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(curve, "write", curve.write_table)
    own = tmp_path / "my_own_ppo.py"
    own.write_text("from stable_baselines3 import PPO\n\n\nclass Mine(PPO):\n    pass\n")
    again = ["train", "my_own_ppo:Mine", "--scenario", "easy", *USUAL, "--baselines", "none"]
    again += ["--out", "run"]
    assert main(again) == 0
    assert main(again) == 0  # nothing has changed
    own.write_text(own.read_text() + "\n    learning_rate = 1.0\n")
    capsys.readouterr()
    assert main(again) == 2
    assert "holds another training: modules: my_own_ppo is" in capsys.readouterr().err

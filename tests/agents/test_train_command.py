import csv
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from leaderboard_rows import flights_in
from stable_baselines3 import PPO
from uas_coverage_agents import training
from uas_coverage_agents.policy import load_policy
from uas_coverage_agents.training import command, curve, loop
from uas_coverage_agents.training.config import load_config
from uas_coverage_agents.training.loop import curve_scenarios
from uas_coverage_agents.training.model_arrays import from_arrays, to_arrays
from uas_coverage_agents.training.training_run import TrainingJob, TrainingRun

from uas_coverage_env.cli import main
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import evaluate
from uas_coverage_env.leaderboard import Row
from uas_coverage_env.runner.store import opened, rows_in
from uas_coverage_env.runner.workers import WorkerLostError, Workers

TINY = str(Path(__file__).with_name("tiny.toml"))
ASSISTED = {"return_mode": True, "safety_filter": True}


def train(directory, *arguments: str) -> int:
    usual = ["--missions", "1", "--baselines", "nearest-waypoint", "--jobs", "1"]
    return main(["train", TINY, *usual, "--out", str(directory), *arguments])


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A training that nobody disturbed."""
    directory = tmp_path_factory.mktemp("trained") / "run"
    assert train(directory) == 0
    return directory


@pytest.fixture
def curve_without_picture(monkeypatch):
    """A dozen times in a training, to draw the curve takes longer than to learn until then."""
    monkeypatch.setattr(curve, "write", curve.write_table)


def refusal(capsys, *arguments: str) -> str:
    assert main(["train", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    return err


def test_a_training_leaves_a_policy_a_curve_and_its_logs(trained):
    policy = load_policy(trained / "policy")
    assert policy.description.interface == "velocity"
    assert policy.description.training.algorithm == "tiny"
    assert policy.description.training.steps >= 1024
    assert policy.description.score.missions == 1
    rows = read_curve(trained)
    assert len(rows) >= 5
    assert int(rows[0]["steps"]) == 0
    assert int(rows[-1]["steps"]) == policy.description.training.steps
    assert (trained / "learning_curve.png").read_bytes().startswith(b"\x89PNG")
    assert list((trained / "tensorboard").iterdir())
    assert len(list((trained / "checkpoints").glob("*.json"))) <= 2
    assert not list(trained.rglob("*.zip"))
    assert not list(trained.rglob("*.pkl"))


def test_the_curve_has_the_default_return_and_stands_beside_planners_that_do_not_learn(trained):
    job = TrainingJob("tiny", load_config(TINY), seed=0, missions=1)
    town = curve_scenarios(job)[0]
    (beside,) = read_curve(trained / "baselines" / "nearest-waypoint")
    flown = evaluate("nearest-waypoint", town, seeds=[0])
    assert float(beside["return"]) == flown.mean("episode_return")
    returns = [float(row["return"]) for row in read_curve(trained)]
    last = evaluate(f"policy:{trained / 'policy'}", town, seeds=[0], **ASSISTED)
    assert returns[-1] == last.mean("episode_return")
    score = load_policy(trained / "policy").description.score
    assert score.measures["episode_return"].mean == returns[-1]


def test_a_training_that_an_older_version_began_is_refused_in_a_line(trained, tmp_path, capsys):
    begun = shutil.copytree(trained, tmp_path / "run")
    (begun / "flights.sqlite").rename(begun / "order.json")
    for more in ([], ["--overwrite"]):
        line = refusal(capsys, TINY, "--missions", "1", "--out", str(begun), *more)
        assert "holds no training that this version goes on with; give another --out" in line


def test_every_flight_of_the_curve_and_of_the_score_is_kept_once(trained):
    rows = rows_in(trained, Row)
    labels = [row.label for row in rows]
    assert len(set(labels)) == len(labels), "one mission each"
    last = f"policy after {read_curve(trained)[-1]['steps']} steps"
    assert {"nearest-waypoint", "policy after 0 steps", last} <= set(labels)
    returns = {row.label: row.episode_return for row in rows}
    assert returns[last] == float(read_curve(trained)[-1]["return"])
    assert len(rows) == len(read_curve(trained)) + 1


def test_a_baseline_that_is_no_planner_is_refused_before_anything_is_begun(tmp_path, capsys):
    out = ["--out", str(tmp_path / "run")]
    assert "unknown planner" in refusal(capsys, TINY, *out, "--baselines", "nearest-waypiont")
    assert not (tmp_path / "run").exists()


def test_a_flight_that_kills_every_process_ends_a_training_in_a_line(tmp_path, monkeypatch, capsys):
    def lost(self, jobs):
        raise WorkerLostError("town policy 0: its process ended (by SIGKILL), 3 times")

    with monkeypatch.context() as patch:
        patch.setattr(Workers, "run", lost)
        assert train(tmp_path / "run", "--steps", "64") == 1
    assert "3 times; the same command goes on" in capsys.readouterr().err
    assert train(tmp_path / "run", "--steps", "64") == 0


@pytest.mark.usefixtures("curve_without_picture")
def test_a_killed_training_goes_on_to_the_same_weights(trained, tmp_path, capsys):
    script = "import sys; from uas_coverage_env.cli import main; sys.exit(main())"
    command_line = [sys.executable, "-c", script, "train", TINY]
    usual = ["--missions", "1", "--baselines", "none", "--checkpoint-s", "0", "--jobs", "1"]
    directory = tmp_path / "killed"
    process = subprocess.Popen(
        [*command_line, *usual, "--out", str(directory)],
        stdout=subprocess.DEVNULL,
    )
    while not (directory / "checkpoints" / "000003.json").exists():
        assert process.poll() is None, "it should be at work still"
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert not (directory / "policy").exists()
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


def read_curve(directory) -> list[dict[str, str]]:
    return list(csv.DictReader((directory / "learning_curve.csv").read_text().splitlines()))


def test_the_same_command_again_says_the_same_without_training(trained, capsys):
    before = (trained / "policy" / "policy.safetensors").read_bytes()
    curve = read_curve(trained)
    assert train(trained) == 0
    assert "going on" in capsys.readouterr().out
    assert (trained / "policy" / "policy.safetensors").read_bytes() == before
    assert read_curve(trained) == curve


@pytest.mark.usefixtures("curve_without_picture")
def test_another_seed_gives_other_weights(trained, tmp_path):
    assert train(tmp_path / "other", "--seed", "1", "--steps", "128") == 0
    other = load_policy(tmp_path / "other" / "policy")
    first = load_policy(trained / "policy")
    assert other.description.weights_sha256 != first.description.weights_sha256


@pytest.mark.usefixtures("curve_without_picture")
def test_the_minutes_of_a_training_begin_with_its_first_step(tmp_path, monkeypatch):
    now_s, fly = [0.0], TrainingRun.flights

    def monotonic() -> float:
        now_s[0] += 0.1
        return now_s[0]

    def slowly_at_first(self, scenarios):
        now_s[0] += 0.0 if self.model.num_timesteps else 3600.0
        return fly(self, scenarios)

    clock = SimpleNamespace(monotonic=monotonic, process_time=monotonic)
    monkeypatch.setattr(loop, "time", clock)
    monkeypatch.setattr(TrainingRun, "flights", slowly_at_first)
    assert train(tmp_path / "run", "--minutes", "0.05") == 0
    training = load_policy(tmp_path / "run" / "policy").description.training
    assert training.steps > 4 * 128  # a rollout: two missions of up to two UAS, 32 steps
    assert 3.0 <= training.wall_s < 60.0


def test_other_settings_are_not_mixed_into_a_training(trained, capsys):
    for arguments in (["--seed", "1"], ["--set", "learning.gamma=0.5"], ["--minutes", "1"]):
        line = refusal(capsys, TINY, "--missions", "1", "--out", str(trained), *arguments)
        assert "holds the flights of another command: " in line


@pytest.mark.usefixtures("curve_without_picture")
def test_overwrite_starts_anew_and_removes_only_what_is_ours(tmp_path):
    directory = tmp_path / "run"
    assert train(directory, "--steps", "64") == 0
    (directory / "notes.txt").write_text("mine")
    assert train(directory, "--steps", "128", "--overwrite") == 0
    assert load_policy(directory / "policy").description.training.steps == 128
    assert (directory / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["a3c"], "unknown algorithm 'a3c'"),
        ([TINY, "--steps", "3", "--minutes", "1"], "give one of them"),
        ([TINY, "--minutes", "inf"], "--minutes inf"),
        ([TINY, "--set", "speed=9"], "no 'speed'"),
        ([TINY, "--scenario", "atlantis"], "atlantis"),
        ([TINY, "--steps", "0"], "--steps"),
        ([TINY, "--seed", "-1"], "--seed"),
    ],
)
def test_mistakes_are_answered_in_a_line(arguments, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert words in refusal(capsys, *arguments)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_with_something_else_is_left_alone(tmp_path, capsys):
    (tmp_path / "thesis.tex").write_text("years of work")
    for more in ([], ["--overwrite"]):
        line = refusal(capsys, TINY, "--out", str(tmp_path), *more)
        assert "is not empty and holds no training" in line
    assert "is a file" in refusal(capsys, TINY, "--out", str(tmp_path / "thesis.tex"))
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_two_trainings_do_not_work_in_one_folder(trained, capsys):
    description = command._record(TrainingJob("tiny", load_config(TINY), 0, missions=1))
    with opened(trained, description, Row):
        assert main(["train", TINY, "--missions", "1", "--out", str(trained)]) == 2
    assert "another command is at work there" in capsys.readouterr().err


def test_without_the_extra_one_line_names_it(monkeypatch, tmp_path, capsys):
    # a module that is None is one that cannot be imported
    monkeypatch.setitem(sys.modules, "stable_baselines3.common.logger", None)
    monkeypatch.delitem(sys.modules, loop.__name__)
    monkeypatch.delattr(training, "loop")
    line = refusal(capsys, TINY, "--out", str(tmp_path / "run"))
    assert "python -m pip install 'uas-coverage-env[learn]'" in line
    assert not (tmp_path / "run").exists()


SAC = [
    "scenarios.pool=1",
    "num_envs=1",
    "learning.first_samples=10",
    "learning.buffer_size=1000",
    "learning.batch_size=16",
    "learning.updates_per_step=1",
]


@pytest.mark.parametrize("name", [TINY, "sac"])
def test_a_model_that_is_taken_up_again_learns_on_bit_for_bit(name):
    config = load_config(name, changes=["policy.hidden=[8]", *(SAC if name == "sac" else ())])
    job = TrainingJob("tiny", config, seed=0)
    first, second = TrainingRun.untrained(job), TrainingRun.untrained(job)
    first.model.learn(256)
    arrays = to_arrays(first.model, first.lanes)
    from_arrays(arrays, second.model, second.lanes)
    assert same(to_arrays(second.model, second.lanes), arrays)
    first.model.learn(128, reset_num_timesteps=False)
    # both draw from the same global generators: back to where they were
    undisturbed = to_arrays(first.model, first.lanes)
    from_arrays(arrays, second.model, second.lanes)
    second.model.learn(128, reset_num_timesteps=False)
    assert same(to_arrays(second.model, second.lanes), undisturbed)
    assert not same(arrays, undisturbed)


def same(some: dict[str, np.ndarray], others: dict[str, np.ndarray]) -> bool:
    return set(some) == set(others) and all(np.array_equal(some[k], others[k]) for k in some)


def test_a_checkpoint_of_another_network_is_refused():
    job = TrainingJob("tiny", load_config(TINY), seed=0)
    other = TrainingJob("tiny", load_config(TINY, changes=["policy.hidden=[4]"]), seed=0)
    first, second = TrainingRun.untrained(job), TrainingRun.untrained(other)
    first.model.learn(64)
    with pytest.raises(InputError, match="does not fit this version"):
        from_arrays(to_arrays(first.model, first.lanes), second.model, second.lanes)


@pytest.mark.parametrize(
    ("name", "array"),
    [
        ("last/counters", np.zeros((3, 3), np.int64)),
        ("last/counters", np.zeros(3, np.float16)),
        ("last/observation", np.zeros((3, 3), np.float32)),
        ("last/episode_starts", np.zeros(1, np.bool_)),
        ("last/counters", np.array([64, -1, 0])),
        ("random/numpy", np.full(624, np.inf, np.float16)),
        ("random/numpy.place", np.array([10**9, 0])),
        ("optimiser/policy/1/exp_avg", np.zeros((3, 3), np.float32)),
    ],
)
def test_a_checkpoint_with_an_array_of_another_kind_is_refused(name, array):
    job = TrainingJob("tiny", load_config(TINY), seed=0)
    first, second = TrainingRun.untrained(job), TrainingRun.untrained(job)
    first.model.learn(64)
    arrays = to_arrays(first.model, first.lanes)
    assert name in arrays
    with pytest.raises(InputError, match=name):
        from_arrays({**arrays, name: array}, second.model, second.lanes)


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("memory/place", lambda place: place + 10**6, r"memory/place\[0\] is"),
        ("memory/place", lambda place: place - 10**6, r"memory/place\[0\] is -"),
        ("memory/place", lambda place: place + 1, "memory/observations has shape"),
        ("memory/rewards", lambda rewards: rewards[:1], "memory/rewards has shape"),
        ("memory/actions", lambda actions: actions * np.nan, r"memory/actions\[0, 0, 0\] is nan"),
    ],
)
def test_a_memory_that_points_elsewhere_is_refused(remembering, name, change, words):
    job, arrays = remembering
    model = TrainingRun.untrained(job)
    with pytest.raises(InputError, match=words):
        from_arrays({**arrays, name: change(arrays[name])}, model.model, model.lanes)


@pytest.fixture(scope="module")
def remembering():
    """A training off-policy, as arrays."""
    job = TrainingJob("tiny", load_config("sac", changes=["policy.hidden=[8]", *SAC]), seed=0)
    training_run = TrainingRun.untrained(job)
    training_run.model.learn(64)
    return job, to_arrays(training_run.model, training_run.lanes)


class Payload:
    """Pickled, it runs code when it is read."""

    def __reduce__(self):
        return os.system, (f"{sys.executable} -c \"open('ran', 'w')\"",)


@pytest.fixture
def zipped(tmp_path, trained):
    """A model as Stable-Baselines3 saves it."""
    training_run = TrainingRun.untrained(TrainingJob("tiny", load_config(TINY), seed=5))
    training_run.model.save(tmp_path / "model.zip")
    return tmp_path / "model.zip"


def test_a_zip_is_not_even_opened_without_trust(zipped, tmp_path, capsys):
    line = refusal(capsys, TINY, "--from", str(zipped), "--out", str(tmp_path / "run"))
    assert "--trust-pickle" in line
    assert not (tmp_path / "run").exists()


def test_a_trusted_zip_becomes_a_policy(zipped, tmp_path):
    directory = tmp_path / "run"
    assert train(directory, "--from", str(zipped), "--trust-pickle") == 0
    policy = load_policy(directory / "policy")
    model = PPO.load(zipped, device="cpu")
    x = np.random.default_rng(0).uniform(-1, 1, (4, policy.description.network.inputs))
    expected = model.policy.get_distribution(torch.as_tensor(x, dtype=torch.float32)).mode()
    assert np.allclose(policy.forward(x), expected.detach().numpy(), atol=1e-6)


@pytest.mark.parametrize("where", ["data", "policy.pth"])
def test_even_a_trusted_zip_runs_no_code(zipped, tmp_path, monkeypatch, capsys, where):
    monkeypatch.chdir(tmp_path)
    with zipfile.ZipFile(zipped) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    if where == "data":
        bomb = json.dumps({"policy_class": {":serialized:": ""}}).encode()
    else:
        bomb = pickle.dumps(Payload())
    with zipfile.ZipFile("crafted.zip", "w") as archive:
        for name, content in (parts | {where: bomb}).items():
            archive.writestr(name, content)
    code = train(tmp_path / "run", "--from", "crafted.zip", "--trust-pickle")
    assert code == (0 if where == "data" else 2)
    assert not Path("ran").exists()


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"no zip at all"])
def test_what_is_no_zip_is_refused(tmp_path, content, capsys):
    path = tmp_path / "model.zip"
    path.write_bytes(content)
    assert train(tmp_path / "run", "--from", str(path), "--trust-pickle") == 2
    assert "model.zip: no model of this configuration" in capsys.readouterr().err


def test_the_module_of_the_command_needs_no_learning_packages():
    heavy = "torch", "stable_baselines3", "sb3_contrib", "tensorboard", "matplotlib"
    script = (
        f"import sys, {command.__name__}; "
        f"sys.stdout.write(' '.join(n for n in {heavy!r} if n in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "")

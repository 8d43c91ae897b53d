"""Training on a GPU, by numba's simulator, and what is said where there is none."""

import json
import os
import subprocess
import sys

import numba
import pytest
import torch
import trained_on_gpu
from uas_coverage_agents.training import flown
from uas_coverage_agents.training.checkpoint import Checkpoint, TrainingState
from uas_coverage_agents.training.rounds import TrainingJob, train
from uas_coverage_agents.training.settings import settings_of

from uas_coverage_env.cli import main
from uas_coverage_env.files.strict_toml import InputError

ON_GPU = ("--device", "cuda", "--baselines", "none")


def refusal(capsys, tmp_path, *arguments: str) -> str:
    """What is said of a training, which leaves nothing."""
    out = tmp_path / "training"
    assert main(["train", *arguments, "--out", str(out)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert not out.exists()
    return said.err


def test_the_same_seed_learns_the_same_weights_on_a_simulated_gpu():
    done = subprocess.run(
        [sys.executable, trained_on_gpu.__file__],
        env={**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    for result in json.loads(done.stdout).values():
        assert result["different"] == []
        assert result["policies"]
        assert result["told"]
        assert result["updates"] >= 3
        assert result["flights"] >= 8
        assert result["learned"] > 0.0


@pytest.mark.skipif(numba.cuda.is_available(), reason="there is a GPU")
def test_without_a_gpu_a_training_there_is_refused_before_anything_is_made(
    capsys, tmp_path, monkeypatch
):
    monkeypatch.setattr(flown, "tensor_of", None)
    said = refusal(capsys, tmp_path, "ppo-waypoint", *ON_GPU)
    assert said.startswith("error: training on a GPU: ")
    assert "numba-cuda" in said or "NVIDIA GPU" in said


def test_a_torch_that_finds_no_gpu_is_refused_in_a_line(monkeypatch):
    from uas_coverage_env.env.gpu import device

    monkeypatch.setattr(device, "check_gpu", lambda: None)
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(InputError, match=r"PyTorch .* finds none; install .* for CUDA"):
        flown.device_of("cuda")


@pytest.mark.parametrize(
    ("learner", "class_"), [("ppo", "ppo"), ("sac", "sac"), ("learned-route", "route-imitation")]
)
def test_learners_that_cannot_say_so_in_a_line(capsys, tmp_path, learner, class_):
    said = refusal(capsys, tmp_path, learner, *ON_GPU)
    assert f"device = 'cuda': {class_} learns on the processor; ppo-waypoint" in said


def test_what_does_not_fly_on_a_gpu_is_refused_before_anything_is_made(capsys, tmp_path):
    where = ("--scenario", "generated", *ON_GPU)
    said = refusal(capsys, tmp_path, "ppo-waypoint", *where)
    assert "not on a GPU: safety_filter; leave it out" in said
    said = refusal(capsys, tmp_path, "ppo-waypoint", "--scenario", "hard", "--device", "gpu")
    assert "device" in said
    assert "'cuda'" in said


def test_a_training_goes_on_where_it_began_and_on_no_other_device(tmp_path):
    here, there = (
        TrainingJob("tiny", settings_of("ppo-waypoint", changes=[f"device={device}"]))
        for device in ("cpu", "cuda")
    )
    assert here.plain()["settings"]["device"] == "cpu"
    state = TrainingState(order=there.plain(), rounds=1, process_s=0.0, wall_s=0.0, curve=())
    Checkpoint(state).write(tmp_path)
    with pytest.raises(InputError, match=r"holds another training: .*device") as caught:
        train({tmp_path: here})
    assert "\n" not in str(caught.value)

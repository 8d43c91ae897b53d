"""The benchmark of GPUs runs, tiny, on numba's simulator; its rates are not looked at."""

import json
import os
import subprocess
import sys
from pathlib import Path
from runpy import run_path
from unittest.mock import patch

import numba
import pytest
from programs import refusal

from uas_coverage_env.env import CoverageBatch

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "gpu.py"
TINY = ("--envs", "1,2", "--checked", "2", "--steps", "2", "--turn-s", "0")


def test_missions_are_checked_and_measured_on_the_simulator(tmp_path):
    file = tmp_path / "rows.json"
    done = subprocess.run(
        [sys.executable, str(BENCHMARK), *TINY, "--scenario", "open_field", "--json", str(file)],
        env={**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("0.0% parted, the others differ by 0.0e+00") == 3
    found = json.loads(file.read_text())
    assert found["equal"]
    ours = ["velocity", "v1, waypoint", "v1, waypoint, drawn"]
    trained = "train ppo-waypoint, hard"
    assert list(found["rows_per_s"])[:4] == [*ours, trained]
    for name in (*ours, trained):
        assert found["rows_per_s"][name].keys() == {"1", "2"}
        assert min(map(min, found["rows_per_s"][name].values())) > 0


class Elsewhere:
    """A batch in place of missions on a GPU; the first one sees something else."""

    def __init__(self, n, what):
        self._batch = CoverageBatch(n, what)
        self.settings = self._batch.settings
        self.asked = self._batch.learners.asked.reshape(n, -1)

    def reset(self, *, seed):
        self._batch.reset(seed)

    def step(self, actions):
        self._batch.step(actions)

    @property
    def observation(self):
        seen = self._batch.observation.reshape(len(self.asked), -1).copy()
        seen[0, 5] += 0.01
        return seen


def test_missions_that_part_from_those_of_a_batch_are_found(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARK.parent))
    compared = run_path(str(BENCHMARK))["compared"]
    given = {"on_host": lambda array: array}
    with patch.dict(compared.__globals__, given | {"CudaMissions": Elsewhere}):
        words, little = compared("open_field", {}, 20, 2)
    assert "5.0% parted" in words
    assert not little


def test_without_a_gpu_it_ends_with_one_line():
    if numba.cuda.is_available():
        pytest.skip("there is a GPU")
    code, said, _ = refusal(BENCHMARK)
    assert code == 2
    assert 'device="cuda" needs' in said
    assert said.count("\n") == 1


def test_without_an_assembler_no_registers_are_told(monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    code, said, _ = refusal(BENCHMARK, "--registers")
    assert code == 2
    assert "nvidia-cuda-nvcc-cu12" in said

"""The rendering benchmark runs, tiny; its figures are not looked at."""

import subprocess
import sys
from pathlib import Path

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "rendering.py"


def run(*options):
    return subprocess.run(
        [sys.executable, str(BENCHMARK), *options], capture_output=True, text=True
    )


def test_single_missions_tiles_and_tuples_are_measured():
    done = run("--steps", "2", "--envs", "2")
    assert done.returncode == 0, done.stdout + done.stderr
    for words in (
        "one environment, village",
        "one environment, town-s1000",
        "1024 x 512, 2 tiles of 512²",
        "2 of 512²",
        "matplotlib's figure of village",
    ):
        assert words in done.stdout


def test_a_wrong_size_is_one_line():
    done = run("--envs", "many")
    assert done.returncode == 2
    assert "--envs 'many'" in done.stderr
    assert done.stderr.count("\n") == 1

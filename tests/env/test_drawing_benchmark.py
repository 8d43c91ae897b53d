"""The benchmark of drawn missions measures, and finds nothing compiled."""

import subprocess
import sys
from pathlib import Path

PROGRAM = Path(__file__).parents[2] / "benchmarks" / "drawing.py"


def test_it_measures_resets_steps_and_scenes():
    options = ["--missions", "2", "--lanes", "2", "--steps", "2", "--batches", "1"]
    run = subprocess.run(
        [sys.executable, PROGRAM, *options], capture_output=True, text=True, check=True
    )
    assert "compilations after the first reset: 0" in run.stdout
    numbers = {line[:32].strip(): line[32:].split() for line in run.stdout.splitlines()}
    timed = ("a reset that draws", "of which the draw", "of which arrays", "drawn", "a list")
    for name in (*timed, "a step of 2 missions"):
        assert float(numbers[name][1]) >= float(numbers[name][0]) >= 0.0
    assert float(numbers["a scene, kB"][0]) > float(numbers["a lane, kB"][0]) > 1.0

"""The benchmark of drawn missions measures, and finds nothing compiled."""

import subprocess
import sys
from pathlib import Path

PROGRAM = Path(__file__).parents[2] / "benchmarks" / "drawing.py"


def test_it_measures_resets_and_steps():
    run = subprocess.run(
        [sys.executable, PROGRAM, "--missions", "2", "--lanes", "2", "--steps", "2"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "compilations after the first reset: 0" in run.stdout
    numbers = {line[:32].strip(): line[32:].split() for line in run.stdout.splitlines()}
    for name in ("a reset that draws", "of which the draw", "of which arrays", "drawn", "a list"):
        assert float(numbers[name][1]) >= float(numbers[name][0]) >= 0.0

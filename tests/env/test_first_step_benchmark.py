"""The benchmark of the first step answers before it works for minutes."""

import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parents[2] / "benchmarks" / "first_step.py"


@pytest.mark.parametrize(("argument", "code", "word"), [("--help", 0, "newcomer"), ("x", 2, "x")])
def test_it_answers_and_does_not_begin(argument, code, word):
    result = subprocess.run(
        [sys.executable, PROGRAM, argument], capture_output=True, text=True, timeout=20
    )
    assert result.returncode == code
    assert word in result.stdout + result.stderr
    assert "one mission" not in result.stdout

"""What several files of tests compare with."""

import json
import os
import subprocess
import sys

import pytest
import simulated_gpu


@pytest.fixture(scope="session")
def flown_on_gpu():
    """How missions on numba's simulated GPU compare with episodes; all in one process, as Python:
    to compile what few steps need would take ten times as long."""
    done = subprocess.run(
        [sys.executable, simulated_gpu.__file__],
        env={**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)

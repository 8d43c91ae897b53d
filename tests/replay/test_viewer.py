"""The viewer's own checks: its types, and unit tests of what needs no browser."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from uas_coverage_env.flight import MODES
from uas_coverage_env.replay.flight_data import flight_data

VIEWER = Path(__file__).parents[2] / "viewer"


def npm(*words, **environment):
    """Run a script of the viewer; its output is the message where it fails."""
    program = shutil.which("npm")
    if program is None or not (VIEWER / "node_modules").is_dir():
        pytest.skip("needs node, and once: cd viewer && npm ci")
    result = subprocess.run(
        [program, *words],
        cwd=VIEWER,
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


def test_the_types_of_the_viewer_fit():
    npm("run", "check")


def test_the_viewer_passes_its_unit_tests_and_reads_what_python_wrote(flight, tmp_path):
    uas = range(len(flight.names))
    power_W = flight.voltage_V * flight.current_A
    moments = [
        {
            "time_s": k * flight.scenario.dt_s,
            "position_m": flight.x[k, :, :3].tolist(),
            "soc": flight.soc[k].tolist(),
            "mode": [MODES[flight.mode[k, i]] for i in uas],
            "covered": int(flight.covered[k]),
            "energy_Wh": float(power_W[:k].sum()) * flight.scenario.dt_s / 3600.0,
        }
        for k in np.linspace(0, flight.steps, 7).astype(int)
    ]
    expected = {"duration_s": flight.steps * flight.scenario.dt_s, "moments": moments}
    path = tmp_path / "flight.json"
    path.write_text(json.dumps({"data": flight_data(flight, "here"), "expected": expected}))
    output = npm("test", FLIGHT=str(path))
    assert "a flight that Python wrote is read as Python recorded it" in output

"""The flight that `uas-coverage demo` shows at once is one of this code, and said to be recorded.

Where one of these fails, `python docs/recorded_flight.py` records it anew.
"""

import json
import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

from uas_coverage_env import independent_check
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.replay.flight_data import flight_data
from uas_coverage_env.replay.recorded import archive_of, unpack_recorded, write_recorded_page
from uas_coverage_env.scenario import load_scenario

sys.path.append(str(Path(__file__).parents[2] / "docs"))
recorded_flight = import_module("recorded_flight")


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    return unpack_recorded(tmp_path_factory.mktemp("recorded") / "flight")


@pytest.fixture(scope="module")
def flight(directory):
    return Flight.load(directory)


def test_it_is_a_flight_of_the_shipped_scenario_that_ends_well(flight):
    assert flight.scenario == load_scenario(recorded_flight.SCENARIO)
    assert flight.planner == recorded_flight.PLANNER
    assert accomplished(flight)
    assert summary(flight)["breaches"] == 0


def test_the_independent_check_finds_nothing_wrong_with_it(directory):
    report = independent_check.check(directory)
    assert (report.problems, report.contacts, report.breaches) == ([], [], 0)
    assert (report.coverage, report.all_home) == (1.0, True)


def test_its_page_is_what_the_viewer_wants_now(flight, directory):
    with ZipFile(recorded_flight.ARCHIVE) as archive:
        shipped = json.loads(archive.read("page.json"))
    assert shipped == json.loads(json.dumps(flight_data(flight, "recorded")))
    assert archive_of(directory) == recorded_flight.ARCHIVE.read_bytes()


def test_the_planner_flies_it_like_this_today(flight):
    flown = recorded_flight.fly()
    assert flown.steps == flight.steps
    # solvers of another machine may round otherwise
    np.testing.assert_allclose(flown.x[..., :3], flight.x[..., :3], atol=0.1)


def test_its_page_says_that_it_is_recorded_and_nothing_is_compiled_for_it(tmp_path):
    script = (
        "from pathlib import Path\n"
        "from uas_coverage_env.compiled.progress import COMPILATIONS\n"
        "from uas_coverage_env.replay.recorded import write_recorded_page\n"
        "print(*write_recorded_page(Path('page.html')), COMPILATIONS.n_compiled)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "empty")},
        cwd=tmp_path,
        capture_output=True,
        check=True,
        text=True,
    )
    assert done.stdout == "trajectory village 0\n"
    assert "village, trajectory (recorded)</title>" in (tmp_path / "page.html").read_text()
    assert write_recorded_page(tmp_path / "page.html") == ("trajectory", "village")

"""The benchmarks are scripts, not a package: their tests import them from their folder."""

import sys
from pathlib import Path

import pytest
from lively_missions import with_balloon

from uas_coverage_env.scenario import Scenario, generate_scenario

_FOLDER = str(Path(__file__).parents[2] / "benchmarks")
if _FOLDER not in sys.path:
    sys.path.append(_FOLDER)


@pytest.fixture(scope="session")
def lively_town() -> Scenario:
    """A generated town of two UAS and some blocks, with a balloon that drifts through it."""
    town = generate_scenario(7, n_uas=2, n_waypoints=5, n_obstacles=3)
    return with_balloon(town, start_m=(100.0, 60.0, -20.0), velocity_mps=(0.5, 1.0, 0.0))

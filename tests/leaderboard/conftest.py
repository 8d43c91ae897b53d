"""A mission of a second or two for sweeps, as a file."""

from importlib.resources import files
from pathlib import Path

import pytest

YARD = """
schema = 1
name = "yard"
dt_s = 1.0
max_steps = 60
landing_distance_m = 2.0
landing_speed_mps = 0.5
uas_safe_distance_m = 3.0
geofence.margin_m = 0.5
geofence.vertices_m = [
  [0, 0, 0], [100, 0, 0], [100, 120, 0], [0, 120, 0],
  [0, 0, -40], [100, 0, -40], [100, 120, -40], [0, 120, -40],
]
waypoints = [
  { position_m = [20, 30, -4], radius_m = 6, weight = 1 },
  { position_m = [50, 30, -10], radius_m = 8, weight = 2 },
]

[[uas]]
name = "left"
vehicle = "s500_v2"
start_m = [20, 30, -1]
soc_0 = 1.0
radius_m = 0.36
dod_max = 0.75
"""


@pytest.fixture
def yard(tmp_path) -> Path:
    """The file of a scenario with one UAS, two waypoints and sixty steps."""
    path = tmp_path / "yard.toml"
    path.write_text(YARD, encoding="utf-8")
    return path


@pytest.fixture
def two_yards(yard) -> str:
    """Two scenario files, as one writes them behind --scenarios."""
    other = yard.with_name("yard2.toml")
    text = YARD.replace('"yard"', '"yard2"').replace("[50, 30, -10]", "[60, 40, -12]")
    other.write_text(text, encoding="utf-8")
    return f"{yard},{other}"


@pytest.fixture
def village_text() -> str:
    """The village's file."""
    return files("uas_coverage_env.scenario").joinpath("village.toml").read_text(encoding="utf-8")

"""What planners share: every travel-time model is documented, and arrays and kernels agree."""

from pathlib import Path

import numpy as np
import pytest

from uas_coverage_env.autopilot import return_mode
from uas_coverage_env.env.observation import home
from uas_coverage_env.planning import reserves
from uas_coverage_env.scenario import feasibility
from uas_coverage_env.vehicle import range as flight_time
from uas_coverage_env.vehicle.range import (
    SpeedLimits,
    TravelTimeModel,
    flight_seconds,
    level_seconds,
    vertical_seconds,
)

SPEEDS = SpeedLimits(level_mps=10.0, climb_mps=3.0, descent_mps=2.0)
MODELS = {
    name: value
    for module in (flight_time, return_mode, home, feasibility, reserves)
    for name, value in vars(module).items()
    if isinstance(value, TravelTimeModel)
}
DOCS = Path(__file__).parents[2] / "docs" / "range_method.md"


@pytest.mark.parametrize("name", MODELS)
def test_arrays_give_the_same_as_the_compiled_parts(name):
    way_m, up_m = np.array([0.0, 31.7, 211.3]), np.array([0.0, 7.1, 0.3])
    model = MODELS[name]._replace(level_s=0.0, vertical_s=0.0, in_turn=True, landing_s=0.0)
    parts = level_seconds(model, SPEEDS, way_m) + vertical_seconds(SPEEDS, up_m, up_m)
    compiled = [
        flight_seconds(model, SPEEDS, 0.0, way, up, up)
        for way, up in zip(way_m.tolist(), up_m.tolist(), strict=True)
    ]
    assert parts.tolist() == compiled


def test_the_docs_have_every_model_with_its_numbers():
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in DOCS.read_text(encoding="utf-8").splitlines()
        if line.startswith("| `")
    ]
    told = {row[0].strip("`"): row[1:7] for row in rows if row[0].strip("`") in MODELS}
    assert told == {
        name: ["yes" if value is True else "no" if value is False else f"{value:.3g}"
               for value in model]
        for name, model in MODELS.items()
    }  # fmt: skip

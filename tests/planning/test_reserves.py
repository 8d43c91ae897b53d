"""What planners share: every travel-time model is documented, and arrays and kernels agree."""

import ast
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from uas_coverage_env.autopilot import return_mode
from uas_coverage_env.env.observation import home
from uas_coverage_env.planning import reserves
from uas_coverage_env.scenario import feasibility
from uas_coverage_env.vehicle import range as flight_time
from uas_coverage_env.vehicle.layout import X, Z
from uas_coverage_env.vehicle.range import (
    SpeedLimits,
    TravelTimeModel,
    flight_seconds,
    level_seconds,
    vertical_seconds,
)

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import reserves as benchmark

SPEEDS = SpeedLimits(level_mps=10.0, climb_mps=3.0, descent_mps=2.0)
MODELS = {
    name: value
    for module in (flight_time, return_mode, home, feasibility, reserves)
    for name, value in vars(module).items()
    if isinstance(value, TravelTimeModel)
}
ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs" / "range.md"


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


def calls_of(name):
    """Files of the packages in which something of this name is called."""
    for package in ("uas_coverage_env", "baselines", "agents"):
        for path in (ROOT / package).rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            if any(
                isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
                and node.func.id == name
                for node in ast.walk(ast.parse(text)) if name in text
            ):  # fmt: skip
                yield path.relative_to(ROOT).as_posix()


def test_what_is_kept_is_said_in_one_table_and_nowhere_else():
    assert set(calls_of("Reserve")) == {"uas_coverage_env/planning/reserves.py"}


def test_each_reserve_is_used_and_says_what_for_and_by_which_command_it_was_measured():
    users = "".join(
        path.read_text(encoding="utf-8")
        for package in ("uas_coverage_env", "baselines", "agents")
        for path in (ROOT / package).rglob("*.py")
        if path.name != "reserves.py"
    )
    for name, reserve in reserves.RESERVES.items():
        assert re.search(rf"\b{name}\b", users), f"{name}: no planner reads it"
        assert reserve.of, name
        assert reserve.kept_s >= 0.0, name
        assert 0.0 < reserve.legs_share <= 1.0, name
        assert 0.0 < reserve.time_share <= 1.0, name
        for script in re.findall(r"benchmarks/\w+\.py", reserve.measured):
            assert (ROOT / script).exists(), f"{name}: {script} is gone"


def test_the_benchmark_counts_a_visit_for_the_uas_that_was_there_first():
    places = [(0.0, 0.0, -10.0), (50.0, 0.0, -10.0), (99.0, 0.0, -10.0)]
    waypoints = [SimpleNamespace(position_m=place, radius_m=5.0) for place in places]
    x = np.zeros((6, 2, 14))
    x[:, :, Z] = -10.0
    x[:, 0, X] = [0.0, 10.0, 20.0, 30.0, 40.0, 50.0]
    x[:, 1, X] = [60.0, 55.0, 40.0, 20.0, 4.0, 4.0]
    flight = SimpleNamespace(scenario=SimpleNamespace(waypoints=waypoints), x=x)
    (mine, mine_at), (others, others_at) = benchmark.visits_of(flight)
    assert (mine.tolist(), mine_at.tolist()) == ([0], [0])
    assert (others.tolist(), others_at.tolist()) == ([1], [1])

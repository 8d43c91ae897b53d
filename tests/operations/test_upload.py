"""A ground station that is not ours reads our files and uploads them to a vehicle."""

import sys
from pathlib import Path

import pytest

pytest.importorskip("pyproj")
pytest.importorskip("mavsdk")

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import numpy as np
from exports import MOST_OFF_M, check
from mavlink_vehicle import FENCE, MISSION, RALLY, Bench

from uas_coverage_env import load_planner, load_scenario, rollout
from uas_coverage_env.operations import ExportOptions, make_export
from uas_coverage_env.scenario import Place


@pytest.fixture(scope="module")
def bench():
    bench = Bench()
    yield bench
    bench.close()


@pytest.mark.parametrize("number", [0, 5, 7, 10, 15])
def test_corners_read_by_other_programs_are_where_they_were_planned(number, bench, tmp_path):
    corners, plan_m, text_m = check(number, bench, tmp_path, np.random.default_rng(number))
    assert corners > 5
    assert max(plan_m, text_m) < MOST_OFF_M


def test_a_vehicle_holds_mission_fence_and_rally_point_after_the_upload(bench):
    flight = rollout(load_scenario("open_field"), load_planner("nearest-waypoint"), 0)
    place = Place(latitude_deg=47.0, longitude_deg=19.0)
    made = make_export(flight, ExportOptions("qgc", min_slack_s=0.0, place=place))
    for name, legs in ((uas["name"], uas["legs"]) for uas in made.data["uas"]):
        held = bench.upload(bench.read_plan(made.files[f"{name}.plan"]))
        home, take_off, *_, landing = held[MISSION]  # ArduPilot's first item is home
        assert [item.command for item in (home, take_off, landing)] == [16, 22, 21]
        ends = [item for item in held[MISSION][1:] if item.command == 16]
        assert len(ends) == len(legs)
        for item, leg in zip(ends, legs, strict=True):
            assert item.x / 1e7 == pytest.approx(leg["latitude_deg"], abs=1e-7)
            assert item.y / 1e7 == pytest.approx(leg["longitude_deg"], abs=1e-7)
            assert item.z == pytest.approx(leg["height_m"], abs=1e-3)
        corners_m = flight.scenario.fence.vertices_m
        assert len(held[FENCE]) == len(np.unique(corners_m[:, :2], axis=0))
        assert len(held[RALLY]) == 1

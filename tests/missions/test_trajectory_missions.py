"""Whole missions of `trajectory`, judged by a checker that shares nothing with the world."""

import pytest
from lively_missions import with_balloon
from uas_coverage_baselines.trajectory import Trajectory, TrajectoryOptions

from uas_coverage_env import independent_check, rollout
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.scenario import generate_scenario

QUICK = {"orders": 1, "moves": 20_000, "programs": 60}


@pytest.mark.parametrize("lively", [False, True])
def test_a_whole_mission_satisfies_the_independent_check(tmp_path, lively):
    """Contacts on curved flight, every limit of every sample, breaches, and plans as flown."""
    scenario = generate_scenario(11, n_uas=3, n_waypoints=15, n_obstacles=6)
    if lively:
        scenario = with_balloon(scenario, (60.0, 40.0, -20.0), (1.0, 1.5, 0.0))
    flight = rollout(scenario, Trajectory(TrajectoryOptions(**QUICK)))
    flight.save(tmp_path / "flight")
    report = independent_check.check(tmp_path / "flight")
    assert accomplished(flight)
    assert flight.breaches == 0
    assert report.problems == []

"""No UAS waits for what comes straight at it: with a solver, and without one."""

import pytest
from lively_missions import with_balloon
from uas_coverage_baselines.milp_mpc import moving_horizon
from uas_coverage_baselines.milp_mpc.fallback.reasons import Reason

from uas_coverage_env import generate_scenario, independent_check, load_planner, rollout

QUICK = {"horizon": "8", "teams": "1", "threads": "1"}
SAFE_M = 4.0 + 3.0 + 0.36  # the balloon's radius, its safe distance, the UAS's radius


def approached(gap_m, speed_mps):
    """Two UAS at their starts; a balloon comes level and straight at the one, then the other."""
    town = generate_scenario(7, n_uas=2, n_waypoints=3, n_obstacles=3)
    north_m, east_m, _ = town.uas[1].start_m
    return with_balloon(town, (north_m + SAFE_M + gap_m, east_m, -4.0), (-speed_mps, 0.0, 0.0))


@pytest.mark.parametrize("solver_works", [True, False])
@pytest.mark.parametrize(
    ("gap_m", "speed_mps"), [(2.5, 1.0), (10.0, 2.0), (15.0, 5.0), (40.0, 5.0)]
)
def test_every_uas_gets_out_of_the_way_of_what_comes_straight_at_it(
    monkeypatch, tmp_path, gap_m, speed_mps, solver_works
):
    if not solver_works:
        monkeypatch.setattr(moving_horizon, "decide", lambda *args, **keywords: Reason.NO_PLAN)
    scenario = approached(gap_m, speed_mps)
    flight = rollout(scenario, load_planner("milp-mpc", QUICK), max_steps=30)
    flight.save(tmp_path / "flight")
    report = independent_check.check(tmp_path / "flight")
    assert report.problems == []
    assert report.breaches == 0
    if not solver_works:
        assert all(decision.fallback for decision in flight.decisions)


def test_a_start_within_the_planner_s_margin_of_something_is_left_and_the_mission_flown(tmp_path):
    flight = rollout(approached(0.05, 0.0), load_planner("milp-mpc", QUICK), max_steps=60)
    flight.save(tmp_path / "flight")
    report = independent_check.check(tmp_path / "flight")
    assert report.problems == []
    assert report.breaches == 0
    assert report.coverage == 1.0
    assert flight.decisions[0].fallback

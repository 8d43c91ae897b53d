"""The benchmark of missions: what it flies, keeps, refuses and counts."""

import dataclasses
import subprocess
import sys
from pathlib import Path

import mission_statistics
import missions
import numpy as np
import pytest
from programs import refusal

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard import seed_range
from uas_coverage_env.scenario import sample_scenario


@pytest.fixture
def mission(lively_town, tmp_path):
    folder = tmp_path / "out" / "nearest-waypoint" / lively_town.name
    return missions.Mission(lively_town, "nearest-waypoint", {}, 0, folder)


def test_the_default_scenarios_are_as_large_as_they_should_be():
    seeds = seed_range("--seeds", missions.SEEDS)
    drawn = [sample_scenario(seed) for seed in seeds]
    assert len(drawn) == 20
    assert {len(scenario.uas) for scenario in drawn} == {1, 2, 3, 4}
    assert all(20 <= len(scenario.waypoints) <= 60 for scenario in drawn)
    assert all(5 <= len(scenario.obstacles) <= 20 for scenario in drawn)
    assert drawn[3] == sample_scenario(seeds[3])


def test_a_finished_flight_is_kept_and_not_flown_again(mission, monkeypatch):
    row = missions.fly(mission)
    assert row.clean
    assert row.accomplished
    assert sorted(path.name for path in mission.directory.parent.iterdir()) == [
        mission.directory.name
    ]
    monkeypatch.setattr(missions, "rollout", None)
    assert missions.fly(mission) == row


def test_a_flight_stopped_by_hand_leaves_nothing_behind(mission, monkeypatch):
    def stopped(scenario, planner, seed, **keywords):
        return rollout(scenario, planner, seed, should_stop=lambda: True)

    rollout = missions.rollout
    monkeypatch.setattr(missions, "rollout", stopped)
    with pytest.raises(KeyboardInterrupt):
        missions.fly(mission)
    assert not mission.directory.exists()


@pytest.mark.parametrize("change", [{"options": {"filter": "false"}}, {"seed": 5}])
def test_a_flight_of_another_kind_is_not_taken_for_the_one_asked_for(mission, change):
    missions.fly(mission)
    with pytest.raises(InputError, match=r"another (options|seed)"):
        missions.fly(dataclasses.replace(mission, **change))


def test_half_a_flight_is_not_taken_for_a_whole_one(mission):
    missions.fly(mission)
    (mission.directory / "summary.json").unlink()
    with pytest.raises(InputError, match="no whole flight"):
        missions.fly(mission)


def test_an_option_goes_to_the_planners_that_have_it():
    shares = missions.planner_options(["milp-mpc", "lawnmower"], ["horizon=12", "filter = false"])
    assert shares == {"milp-mpc": {"horizon": "12"}, "lawnmower": {"filter": "false"}}


@pytest.mark.parametrize(
    ("planners", "pairs", "reason"),
    [
        (["teleport"], [], "unknown planner 'teleport'"),
        (["lawnmower"], ["horizon=12"], "has an option 'horizon'"),
        (["milp-mpc"], ["horizon"], "KEY=VALUE"),
        (["milp-mpc"], ["horizon=many"], "horizon"),
    ],
)
def test_what_no_planner_can_take_is_refused(planners, pairs, reason):
    with pytest.raises(InputError, match=reason):
        missions.planner_options(planners, pairs)


@pytest.mark.parametrize("text", ["10", "a:b", "-1:3", "3:"])
def test_seeds_that_are_no_range_are_refused(text):
    with pytest.raises(InputError, match="FIRST:END"):
        seed_range("--seeds", text)


def test_the_interval_of_paired_differences_holds_their_mean():
    mean, low, high = mission_statistics.paired_interval([1.0, 2.0, 3.0, 6.0])
    assert mean == 3.0
    assert 1.0 <= low < mean < high <= 6.0
    assert mission_statistics.paired_interval([2.0, 2.0]) == (2.0, 2.0, 2.0)


def test_steps_are_compared_only_where_both_have_accomplished_the_mission(mission):
    row = missions.fly(mission)
    others = [
        dataclasses.replace(row, scenario=name, planner=planner, steps=steps, coverage=coverage)
        for name, planner, steps, coverage in (
            ("a", "one", 100, 1.0),
            ("a", "two", 90, 1.0),
            ("b", "one", 100, 1.0),
            ("b", "two", 3, 0.5),
        )
    ]
    table = mission_statistics.planners_table(others, ["one", "two"])
    cells = {column.header: list(column.cells) for column in table.columns}
    assert cells["accomplished"] == ["2/2", "1/2"]
    assert cells["pairs"] == ["", "1"]
    assert cells["Δ steps [95 %]"][1] == "-10.0 [-10.0, -10.0]"
    assert str(cells["Δ coverage"][1]).startswith("-25.0")


def run(*arguments):
    return subprocess.run(
        [sys.executable, missions.__file__, *arguments], capture_output=True, text=True
    )


def test_the_command_prints_two_tables_and_keeps_the_flights(tmp_path):
    result = run(
        *("--planners", "lawnmower,nearest-waypoint", "--seeds", "1003:1004", "--no-village"),
        *("--out", str(tmp_path), "--jobs", "2"),
    )
    assert result.returncode == 0, result.stderr
    assert "mean paired difference to lawnmower" in result.stdout
    assert len(list(tmp_path.glob("*/town-*/summary.json"))) == 2
    assert np.genfromtxt(tmp_path / "missions.csv", delimiter=",", names=True, dtype=None).size == 2


def test_the_command_refuses_in_one_line():
    code, _, line = refusal(Path(missions.__file__), "--planners", "lawnmower,teleport")
    assert code == 2
    assert line.startswith("error: unknown planner 'teleport'")
    assert line.count("\n") == 1

"""The benchmark of scale runs, tiny; its figures are not looked at."""

import subprocess
import sys
from pathlib import Path

from programs import refusal

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "scale.py"


def run(*options):
    return subprocess.run(
        [sys.executable, str(BENCHMARK), *options], capture_output=True, text=True
    )


def test_each_size_is_planned_and_flown_and_drawn(tmp_path):
    picture = tmp_path / "scale.png"
    options = ["orders=1", "moves=1000", "programs=5"]
    options = [word for option in options for word in ("--option", option)]
    done = run("--sizes", "1x4,2x6", "--figure", str(picture), *options)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = [line.split("│")[1:-1] for line in done.stdout.splitlines() if line.startswith("│")]
    assert [[int(row[0]), int(row[1])] for row in rows] == [[1, 4], [2, 6]]
    assert [row[9].strip() for row in rows] == ["yes", "yes"]
    assert picture.stat().st_size > 5000


def test_a_wrong_size_is_one_line():
    code, _, line = refusal(BENCHMARK, "--sizes", "2by50")
    assert code == 2
    assert "--sizes '2by50': should be UASxWAYPOINTS" in line
    assert line.count("\n") == 1


def test_a_mission_that_no_battery_lasts_for_is_one_line():
    code, _, line = refusal(BENCHMARK, "--sizes", "1x2000", "--no-fly")
    assert code == 2
    assert "--sizes 1x2000: n_waypoints is 2000" in line
    assert line.count("\n") == 1

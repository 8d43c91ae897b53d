"""The throughput benchmark runs, tiny; its figures are not looked at."""

import json
import os
import subprocess
import sys
from pathlib import Path
from runpy import run_path

from programs import refusal

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "throughput.py"


def run(*options, **variables):
    return subprocess.run(
        [sys.executable, str(BENCHMARK), *map(str, options)],
        capture_output=True,
        text=True,
        env=os.environ | variables,
    )


def test_our_environments_take_turns_and_are_counted(tmp_path):
    file = tmp_path / "rows.json"
    done = run("--envs", "2", "--turns", 2, "--seconds", 0.05, "--json", file)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = json.loads(file.read_text())
    assert [(row["name"], row["num_envs"]) for row in rows] == [("village-dict", 1), ("village", 2)]
    for row in rows:
        assert len(row["rates"]) == 2
        assert min(row["rates"]) > 0
        assert row["peak_mb"] > 10


def test_an_unknown_peer_is_one_line():
    code, said, _ = refusal(BENCHMARK, "--peers", "nobody")
    assert code == 2
    assert "there is no peer 'nobody'" in said


def test_another_version_takes_turns_with_ours_and_is_compared(tmp_path):
    file = tmp_path / "rows.json"
    turns = ("--turns", 2, "--seconds", 0.05)
    done = run("--envs", "2", *turns, "--against", sys.executable, "--json", file)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = json.loads(file.read_text())
    ours, others = rows[:2], rows[2:]
    for one, other in zip(ours, others, strict=True):
        assert (one["name"], one["num_envs"]) == (other["name"], other["num_envs"])
        assert (one["peer"], other["peer"]) == (None, "against")
        rates = zip(one["rates"], other["rates"], strict=True)
        assert one["ratios"] == {"against": [mine / theirs for mine, theirs in rates]}
        assert other["ratios"] == {}


def test_a_python_that_does_not_exist_is_one_line():
    code, said, _ = refusal(BENCHMARK, "--against", "no/such/python")
    assert code == 2
    assert "there is no program 'no/such/python'" in said


def test_missions_that_are_drawn_have_cases():
    known = run_path(str(BENCHMARK.with_name("throughput_case.py")))["CASES"]
    sys.path.insert(0, str(BENCHMARK.parent))
    try:
        throughput = run_path(str(BENCHMARK))
    finally:
        sys.path.remove(str(BENCHMARK.parent))
    cases = throughput["cases_of"]([2], [1], ["vmas"], drawn=True, against=True)
    assert {case.name for case in cases} <= set(known)
    assert {"generated", "streets", "hard", "own-scenes"} <= {case.name for case in cases}


def test_the_profile_shows_all_parts_of_the_real_step():
    done = run("--profile", "--envs", 2, "--turns", 1, NUMBA_DISABLE_JIT="1")
    assert done.returncode == 0, done.stdout + done.stderr
    for part in (
        "which lanes fly", "inner loop, model, battery", "reward and report",
        "nearest waypoints", "moving obstacles", "sums, ends, new missions",
        "sum of its parts", "the whole step",
    ):  # fmt: skip
        assert part in done.stdout

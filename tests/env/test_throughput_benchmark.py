"""The throughput benchmark runs, tiny; its figures are not looked at."""

import json
import subprocess
import sys
from pathlib import Path

from programs import refusal

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "throughput.py"


def run(*options):
    return subprocess.run(
        [sys.executable, str(BENCHMARK), *map(str, options)], capture_output=True, text=True
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

"""The same sweep on a local Ray cluster of two workers."""

import subprocess
import sys

import polars

from uas_coverage_env.leaderboard import TIMES

RUN = "import sys; from uas_coverage_env.cli import main; sys.exit(main())"


def test_a_local_ray_gives_what_processes_give(two_yards, tmp_path):
    for backend in ("process", "ray"):
        command = ["compare", "--scenarios", two_yards, "--planners", "hover,random-walk"]
        more = ["--seeds", "0:3", "--jobs", "2", "--backend", backend]
        subprocess.run(
            [sys.executable, "-c", RUN, *command, *more, "--out", str(tmp_path / backend)],
            check=True,
            timeout=300,
        )
    mine, theirs = (
        polars.read_parquet(tmp_path / backend / "flights.parquet").drop(*TIMES, "source_sha256")
        for backend in ("process", "ray")
    )
    assert mine.height == 12
    assert mine.equals(theirs)

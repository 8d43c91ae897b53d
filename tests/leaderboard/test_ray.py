"""The same sweep on a local Ray cluster of two workers."""

import subprocess
import sys

import polars

from uas_coverage_env.cli import main
from uas_coverage_env.leaderboard.row import TIMES

RUN = "import sys; from uas_coverage_env.cli import main; sys.exit(main())"


def test_a_local_ray_gives_what_this_process_gives(two_yards, tmp_path):
    command = ["compare", "--scenarios", two_yards, "--planners", "hover,random-walk"]
    command += ["--seeds", "0:3"]
    assert main([*command, "--jobs", "1", "--out", str(tmp_path / "process")]) == 0
    more = ["--jobs", "2", "--backend", "ray", "--out", str(tmp_path / "ray")]
    subprocess.run([sys.executable, "-c", RUN, *command, *more], check=True, timeout=300)
    mine, theirs = (
        polars.read_parquet(tmp_path / backend / "flights.parquet").drop(*TIMES, "source_sha256")
        for backend in ("process", "ray")
    )
    assert mine.height == 12
    assert mine.equals(theirs)

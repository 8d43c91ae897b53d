"""R10: exports of random missions at random places, read back by programs that are not ours."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from robustness_rows.row import Finding, Result, Row, Trial, errors, markdown

MOST_OFF_M = 0.01
_MISSIONS_OF_A_TRIAL = 10


def read_back(first: int) -> Result:
    """Some missions: their corners, and how far they are off in the two files [m].

    Args:
        first: Number of the first mission, see `benchmarks/exports.py`.
    """
    # its readers are heavy, and not everybody has installed them
    from exports import check
    from mavlink_vehicle import Bench

    bench, numbers = Bench(), range(first, first + _MISSIONS_OF_A_TRIAL)
    try:
        with tempfile.TemporaryDirectory() as folder:
            place = Path(folder)
            found = [check(n, bench, place, np.random.default_rng(n)) for n in numbers]
    finally:
        bench.close()
    return {"missions": [list(each) for each in found]}


def trials(quick: bool) -> list[Trial]:
    """Missions, some at a time."""
    n_missions = 10 if quick else 500
    return [
        Trial(f"missions {first}", read_back, (first,))
        for first in range(0, n_missions, _MISSIONS_OF_A_TRIAL)
    ]


def finding(results: Mapping[str, Result]) -> Finding:
    """A mission has failed where a corner is farther off than claimed, in either file."""
    missions = [each for one in results.values() for each in one.get("missions", ())]
    failed = sum(max(plan_m, text_m) > MOST_OFF_M for _, plan_m, text_m in missions)
    broken = _MISSIONS_OF_A_TRIAL * len(errors(results))
    table = ""
    if missions:
        corners, plan_m, text_m = np.transpose(missions)
        rows = [
            [".plan, by MAVSDK", len(missions), int(corners.sum()), f"{100.0 * plan_m.max():.2f}"],
            [
                ".waypoints, by pymavlink", len(missions), int(corners.sum()),
                f"{100.0 * text_m.max():.2f}",
            ],
        ]  # fmt: skip
        table = markdown(("file", "missions", "corners", "farthest off, cm"), rows)
    return Finding(len(missions) + broken, failed + broken, table)


ROW = Row(
    "R10",
    "Exports, read back by other programs",
    "missions",
    f"every corner is within {100.0 * MOST_OFF_M:g} cm of where the flight has it",
    trials,
    finding,
    lambda quick: (
        "generated missions at random places; every tenth on the date line, every tenth at a pole"
    ),
    "KML, GeoJSON and CSV (their tests are in `tests/operations`), and vehicles that fly a plan. "
    "Needs the extras `ops` and `test`.",
)

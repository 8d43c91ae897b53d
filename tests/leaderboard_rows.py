"""Rows of flights: some that were never flown, and those that a folder holds."""

import dataclasses
from pathlib import Path

from uas_coverage_env.leaderboard import Row
from uas_coverage_env.leaderboard.row import FAILED, FLOWN, TIMES
from uas_coverage_env.runner.store import rows_in


def row(scenario="a", label="p", seed=0, **changes) -> Row:
    """A flight that accomplished its mission with 10 Wh in 100 steps, unless changed."""
    usual = {
        "key": f"{scenario}/{label}/{seed}",
        "scenario": scenario,
        "scenario_sha256": "00",
        "level": "",
        "label": label,
        "planner": label,
        "options": "{}",
        "seed": seed,
        "dynamics": "lpv",
        "safety_filter": False,
        "status": FLOWN,
        "reason": None,
        "verdict": None,
        "failed_figures": None,
        "accomplished": True,
        "coverage": 1.0,
        "all_home": True,
        "n_uas": 1,
        "home": 1,
        "lost": 0,
        "violations": 0,
        "breaches": 0,
        "steps": 100,
        "energy_Wh": 10.0,
        "min_separation_m": None,
        "min_obstacle_clearance_m": 3.0,
        "decision_p50_s": 0.001,
        "decision_p95_s": 0.002,
        "fallbacks": 0,
        "filtered_share": 0.0,
        "trajectory_sha256": "11",
        "wall_time_s": 0.1,
        "versions": "{}",
        "source_sha256": "22",
        "finished_at": "2026-01-01T00:00:00+00:00",
        "episode_return": 50.0,
    }
    return Row(**{**usual, **changes})


def failed_row(scenario="a", label="p", seed=0, reason="refused", **changes) -> Row:
    """A flight that there is none of."""
    nothing = dict.fromkeys(
        (
            "steps",
            "energy_Wh",
            "decision_p50_s",
            "decision_p95_s",
            "trajectory_sha256",
            "episode_return",
        )
    )
    return row(
        *(scenario, label, seed),
        **{"status": FAILED, "reason": reason, "accomplished": False, "coverage": 0.0},
        **{"all_home": False, "home": 0, "wall_time_s": None, **nothing, **changes},
    )


def flights_in(out) -> list[Row]:
    """What a folder holds, apart from times; somebody may edit the source while a test runs."""
    same = dict.fromkeys((*TIMES, "source_sha256"))
    return [dataclasses.replace(one, **same) for one in rows_in(Path(out), Row)]

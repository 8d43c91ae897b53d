"""R7: how long decisions take, by processor time, which other work does not change much."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from robustness_rows.row import Finding, Result, Row, Trial, errors, markdown
from uas_coverage_env import MissionBrief, generate_scenario, load_planner, rollout
from uas_coverage_env.files.digits import three_digits
from uas_coverage_env.world import Command, SwarmState

FIRST_SEED = 14000
MOST = 1.5
MEANT_S: Mapping[str, float] = {"milp-mpc": 1.0}
"""Planner -> what its counted effort is meant to take in 95 of 100 decisions [s]."""

PLANNERS: Mapping[str, tuple[Mapping[str, str], int | None]] = {
    "nearest-waypoint": ({}, None),
    "lawnmower": ({}, None),
    "tour": ({}, None),
    "trajectory": ({}, None),
    "learned-velocity": ({}, None),
    "learned-route": ({}, None),
    "milp-mpc": ({"threads": "1"}, 12),
}
"""Planner -> options, and steps that are flown (None: the mission)."""


# missions of each: (quick, full)
_MISSIONS = {
    "tour": (3, 60),
    "trajectory": (2, 30),
    "learned-route": (1, 30),
    "milp-mpc": (2, 30),
}
_OTHERS = (10, 400)


class _Timed:
    """A planner whose decisions are timed."""

    def __init__(self, planner: Any) -> None:
        self._planner, self.cpu_s = planner, list[float]()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._planner, name)

    def reset(self, brief: MissionBrief, seed: int) -> None:
        self._planner.reset(brief, seed)
        self.cpu_s.clear()

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        began = time.process_time()
        commands = self._planner.act(swarm)
        self.cpu_s.append(time.process_time() - began)
        return commands


def decide(planner: str, seed: int) -> Result:
    """The decisions of one mission, in seconds of processor time, all threads together."""
    options, steps = PLANNERS[planner]
    town = generate_scenario(seed, n_uas=2, n_waypoints=12, n_obstacles=6)
    timed = _Timed(load_planner(planner, options))
    rollout(town, timed, seed, max_steps=steps)
    return {"planner": planner, "cpu_s": [round(each, 6) for each in timed.cpu_s]}


def trials(quick: bool) -> list[Trial]:
    """Missions of every planner."""
    return [
        Trial(f"{planner} {seed}", decide, (planner, seed))
        for planner in PLANNERS
        for seed in range(FIRST_SEED, FIRST_SEED + _MISSIONS.get(planner, _OTHERS)[not quick])
    ]


def finding(results: Mapping[str, Result]) -> Finding:
    """A decision of a planner that counts its work has failed beyond MOST times what is meant.

    Those of the others are timed, and fail by an exception alone: they are not counted.
    """
    rows, decisions, failed = [], 0, len(errors(results))
    for planner in PLANNERS:
        mine = [one["cpu_s"] for one in results.values() if one.get("planner") == planner]
        if not mine:
            continue
        cpu_s = np.concatenate(mine)
        limit_s = MEANT_S.get(planner, float("inf"))
        late = int((cpu_s > MOST * limit_s).sum())
        decisions, failed = decisions + len(cpu_s) * bool(np.isfinite(limit_s)), failed + late
        figures = [*np.quantile(cpu_s, (0.5, 0.95, 0.99)), cpu_s.max()]
        limit = f"{limit_s:g}" if np.isfinite(limit_s) else "none"
        milliseconds = [three_digits(1e3 * each) for each in figures]
        rows.append([f"`{planner}`", len(cpu_s), *milliseconds, limit, late])
    headings = ("planner", "decisions", "p50, ms", "p95", "p99", "most", "meant, s", "late")
    return Finding(decisions + len(errors(results)), failed, markdown(headings, rows))


ROW = Row(
    "R7",
    "Decision times, by processor time",
    "decisions of counted work",
    f"a planner that counts its work takes no more than {MOST:g} times what is meant, on one "
    "thread",
    trials,
    finding,
    lambda quick: f"towns of two UAS and twelve waypoints from {FIRST_SEED} on",
    "Times on the clock, which say something on a quiet machine only (`benchmarks/planner.py`); "
    "compilation and the search before take-off; and, of planners that do not count their work, "
    "any claim.",
)

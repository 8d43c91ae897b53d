"""Publish the scores of `uas-coverage score`: anchors and the tables of docs/level_scores.md.

    uas-coverage score --level easy,medium,hard,extreme --missions 50 --out scores
    uas-coverage score --level easy-v1,medium-v1,hard-v1,extreme-v1 --missions 50 --out scores
    python benchmarks/levels.py scores

Writes the interquartile means of the values of the random policy and of the best planner on the
test missions to `uas_coverage_env/tasks/anchors.json`, and one table per level between the marks
`<!-- scores -->` of docs/level_scores.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from marks import ROOT, filled

from uas_coverage_env.leaderboard import Row
from uas_coverage_env.leaderboard.statistics import iqm
from uas_coverage_env.runner.store import rows_in
from uas_coverage_env.tasks import SPLITS, level_named
from uas_coverage_env.tasks.levels import level_names
from uas_coverage_env.tasks.scoring import RANDOM, Anchors, MissionScore, scored
from uas_coverage_env.tasks.table import markdown

ANCHORS = ROOT / "uas_coverage_env" / "tasks" / "anchors.json"
PAGE = ROOT / "docs" / "level_scores.md"
Flown = dict[str, dict[str, list[MissionScore]]]
"""Level -> planner -> its missions."""


def main() -> None:
    """Write anchors and tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path, help="The --out of `uas-coverage score`.")
    flown = missions_in(parser.parse_args().folder)
    anchors = json.loads(ANCHORS.read_text("utf-8"))  # those of levels not flown stay
    for level, planners in flown.items():
        found = anchors_from(planners)
        first = level == level_named(level).level
        anchors[level] = found if first else {"random": found["random"]}
    ANCHORS.write_text(json.dumps(anchors, indent=2) + "\n", encoding="utf-8")
    text = PAGE.read_text("utf-8")
    PAGE.write_text(filled(text, tables(flown), "scores"), encoding="utf-8")


def missions_in(folder: Path) -> Flown:
    """The test missions of a folder of `uas-coverage score`."""
    flown: Flown = {}
    for row in sorted(rows_in(folder, Row), key=lambda row: row.seed):
        if row.seed in SPLITS["test"]:
            mission = MissionScore.of(row)
            flown.setdefault(row.level, {}).setdefault(row.label, []).append(mission)
    return flown


def anchors_from(planners: Mapping[str, Sequence[MissionScore]]) -> dict[str, Any]:
    """The anchors of a level, over the missions of its planners."""
    middle = {
        planner: float(iqm(np.array([one.value for one in missions])))
        for planner, missions in planners.items()
    }
    best = max((planner for planner in middle if planner != RANDOM), key=middle.__getitem__)
    flown = Anchors(middle[RANDOM], middle[best], best, len(planners[best]))
    return dataclasses.asdict(flown)


def tables(flown: Flown) -> str:
    """The tables of all levels that were flown."""
    parts = []
    for level in level_names():
        if level in flown:
            scores = {planner: scored(level, each) for planner, each in flown[level].items()}
            parts.append(f"\n`{level_named(level).id}`\n\n{markdown(scores)}\n")
    return "".join(parts) + "\n"


if __name__ == "__main__":
    main()

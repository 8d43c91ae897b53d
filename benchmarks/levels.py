"""Publish the scores of `uas-coverage score`: anchors and the tables of docs/level_scores.md.

    uas-coverage score --level easy,medium,hard,extreme --missions 50 --out scores
    python benchmarks/levels.py scores

Writes the interquartile means of the values of the random policy and of the best planner on the
test missions to `uas_coverage_env/tasks/anchors.json`, and one table per level between the marks
`<!-- scores -->` of docs/level_scores.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np

from uas_coverage_env.leaderboard.statistics import iqm
from uas_coverage_env.tasks import LEVELS, Anchors, scored
from uas_coverage_env.tasks.scoring import RANDOM
from uas_coverage_env.tasks.store import ScoreStore
from uas_coverage_env.tasks.table import markdown

ROOT = Path(__file__).parents[1]
ANCHORS = ROOT / "uas_coverage_env" / "tasks" / "anchors.json"
PAGE = ROOT / "docs" / "level_scores.md"
FIRST, LAST = "<!-- scores -->\n", "<!-- end of scores -->"


def main() -> None:
    """Write anchors and tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path, help="The --out of `uas-coverage score`.")
    store = ScoreStore(parser.parse_args().folder / "test")
    anchors = {level: anchors_from(store, level) for level in LEVELS if store.planners(level)}
    ANCHORS.write_text(json.dumps(anchors, indent=2) + "\n", encoding="utf-8")
    text = PAGE.read_text("utf-8")
    before, first, rest = text.partition(FIRST)
    _, last, after = rest.partition(LAST)
    if not first or not last:
        raise SystemExit(f"{PAGE}: has no {FIRST.strip()} ... {LAST}")
    PAGE.write_text(before + first + tables(store) + last + after, encoding="utf-8")


def anchors_from(store: ScoreStore, level: str) -> dict[str, Any]:
    """The anchors of a level, over the missions that all of its planners have flown."""
    middle = {
        planner: float(iqm(np.array([flown.value for flown in store.missions(level, planner)])))
        for planner in store.planners(level)
    }
    best = max((planner for planner in middle if planner != RANDOM), key=middle.__getitem__)
    flown = Anchors(middle[RANDOM], middle[best], best, len(store.missions(level, best)))
    return dataclasses.asdict(flown)


def tables(store: ScoreStore) -> str:
    """The tables of all levels that were flown."""
    parts = []
    for level, task in LEVELS.items():
        planners = store.planners(level)
        if planners:
            flown = {planner: scored(level, store.missions(level, planner)) for planner in planners}
            parts.append(f"\n`{task.id}`\n\n{markdown(flown)}\n")
    return "".join(parts) + "\n"


if __name__ == "__main__":
    main()

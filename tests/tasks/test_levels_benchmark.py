"""Publishing scores: what the anchors are made of."""

import sys
from pathlib import Path

import pytest
from leaderboard_rows import row

from uas_coverage_env.leaderboard import Row
from uas_coverage_env.runner.store import opened
from uas_coverage_env.tasks import scoring, seeds_of
from uas_coverage_env.tasks.scoring import MissionScore, scored

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import levels


def test_random_policy_and_best_planner_score_0_and_1_on_the_missions_of_the_anchors(
    monkeypatch,
):
    values = {"random": (0.0, 0.1, 0.1, 0.7), "tour": (0.1, 0.7, 0.8, 0.8), "hover": (0, 0, 0, 0.9)}
    missions = {
        planner: [mission(*one) for one in zip(seeds_of("test"), flown, strict=False)]
        for planner, flown in values.items()
    }
    anchors = scoring.Anchors(**levels.anchors_from(missions))
    assert (anchors.best_planner, anchors.missions) == ("tour", 4)
    monkeypatch.setattr(scoring, "anchors_of", lambda level: anchors)
    for planner, expected in (("random", 0.0), ("tour", 1.0)):
        found = scored("easy", missions[planner]).score
        assert found.value == pytest.approx(expected, abs=1e-12)


def mission(seed: int, value: float) -> MissionScore:
    figures = {"coverage": 1.0, "energy_share": 0.2, "lost": 0, "home": 1, "n_uas": 1, "steps": 9}
    return MissionScore(seed, value, {"episode_return": 1.0, **figures})


def test_the_missions_of_a_folder_are_those_of_the_test_split_by_seed(tmp_path):
    seeds = [*seeds_of("test")[:3], seeds_of("validation")[0]]
    with opened(tmp_path, scoring.DESCRIPTION, Row) as store:
        for seed in reversed(seeds):
            store.add(row(f"m{-seed}", "tour", seed, level="easy", coverage=0.5))
    found = levels.missions_in(tmp_path)
    assert [one.seed for one in found["easy"]["tour"]] == seeds[:3]
    assert "| tour | " in levels.tables(found)

"""Publishing scores: what the anchors are made of."""

import sys
from pathlib import Path

import pytest
from uas_coverage_env.tasks.store import ScoreStore

from uas_coverage_env.tasks import scoring, seeds_of
from uas_coverage_env.tasks.scoring import MissionScore, scored

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import levels


def test_random_policy_and_best_planner_score_0_and_1_on_the_missions_of_the_anchors(
    tmp_path, monkeypatch
):
    store = ScoreStore(tmp_path)
    values = {"random": (0.0, 0.1, 0.1, 0.7), "tour": (0.1, 0.7, 0.8, 0.8), "hover": (0, 0, 0, 0.9)}
    for planner, flown in values.items():
        for seed, value in zip(seeds_of("test"), flown, strict=False):
            store.add("easy", planner, mission(seed, value))
    anchors = scoring.Anchors(**levels.anchors_from(store, "easy"))
    assert (anchors.best_planner, anchors.missions) == ("tour", 4)
    monkeypatch.setattr(scoring, "anchors_of", lambda level: anchors)
    for planner, expected in (("random", 0.0), ("tour", 1.0)):
        found = scored("easy", store.missions("easy", planner)).score
        assert found.value == pytest.approx(expected, abs=1e-12)


def mission(seed: int, value: float) -> MissionScore:
    figures = {"coverage": 1.0, "energy_share": 0.2, "lost": 0, "home": 1, "n_uas": 1, "steps": 9}
    return MissionScore(seed, value, {"episode_return": 1.0, **figures})

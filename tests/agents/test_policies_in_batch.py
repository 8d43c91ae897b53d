"""What a library has learned, scored side by side: as one by one, in a second."""

import re

import pytest

pytest.importorskip("stable_baselines3")

from tiny_trainings import tiny
from uas_coverage_agents.training import curve
from uas_coverage_agents.training.rounds import TrainingJob, train

from uas_coverage_env.cli import main
from uas_coverage_env.leaderboard import Row
from uas_coverage_env.runner.store import rows_in
from uas_coverage_env.tasks import level_named, score
from uas_coverage_env.tasks.scoring import batched


@pytest.fixture
def trained(tmp_path, monkeypatch):
    monkeypatch.setattr(curve, "write", curve.write_table)

    def training(name, *changes, scenario):
        changes = (*changes, "rounds=1", "total_timesteps=20")
        settings = tiny(name, *changes, scenario=scenario)
        train({tmp_path / name: TrainingJob("tiny", settings, missions=1)})
        return f"policy:{tmp_path / name / 'policy'}"

    return training


@pytest.mark.parametrize(
    ("name", "changes", "level"),
    [
        ("ppo", ["agent=each", "environment.action=velocity"], "hard"),
        ("maskable-ppo", ["agent=each", "environment.reward_weights={energy=9.0}"], "hard"),
        ("maskable-ppo", ["agent=each", "environment.version=v1"], "hard-v1"),
        ("ppo", ["agent=swarm", "environment.observation=local"], "medium"),
    ],
)
def test_a_policy_is_worth_the_same_side_by_side_and_one_by_one(name, changes, level, trained):
    policy = trained(name, *changes, scenario=level)
    alone = score(policy, level, missions=2)
    together = score(policy, level, missions=2, batch=2)
    for one, other in zip(alone.missions, together.missions, strict=True):
        # networks round otherwise in rows; what they fly is the same
        for figure in ("value", "steps", "coverage", "home", "episode_return"):
            assert getattr(one, figure) == pytest.approx(getattr(other, figure), rel=1e-3)


def test_what_draws_its_choices_draws_the_same_side_by_side_and_one_by_one(trained):
    policy = trained("ppo-waypoint", scenario="hard")
    alone = score(policy, "hard-v1", missions=3)
    together = score(policy, "hard-v1", missions=3, batch=2)
    for one, other in zip(alone.missions, together.missions, strict=True):
        for figure in ("value", "steps", "coverage", "home", "episode_return"):
            assert getattr(one, figure) == pytest.approx(getattr(other, figure), rel=1e-9)


def test_a_policy_that_remembers_flies_one_by_one(trained):
    policy = trained("recurrent-ppo", "environment.action=velocity", scenario="easy")
    assert batched(policy, level_named("easy")) is None
    with pytest.raises(ValueError, match="is no policy"):
        score(policy, "easy", missions=1, batch=1)


def test_the_command_keeps_no_flights_of_it_unless_it_is_asked_to(trained, tmp_path, capsys):
    policy = trained("ppo", "agent=each", "environment.action=velocity", scenario="medium")
    said = []
    asked = f"score --level medium --missions 2 --jobs 1 --planners {policy}"
    for more in ([], ["--one-by-one"]):
        assert main([*asked.split(), "--out", str(tmp_path / "scores"), *more]) == 0
        said.append(re.findall(r"^\| policy.*$", capsys.readouterr().out, re.MULTILINE))
        assert len(rows_in(tmp_path / "scores", Row)) == (2 if more else 0)
    assert said[0] == said[1] != []

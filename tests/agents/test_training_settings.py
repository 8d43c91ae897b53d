"""What is trained, as a file: names, changes, and what is refused in a line."""

from pathlib import Path

import pytest
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.settings import (
    LearnerSettings,
    authors_own,
    class_named,
    learner_names,
    named_objects,
    settings_of,
)

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard import PlannerSpec
from uas_coverage_env.scenario import sample_scenario
from uas_coverage_env.tasks import LEVELS


def refusal(name: str, scenario: str | None = None, changes: list[str] | None = None) -> str:
    with pytest.raises(InputError) as caught:
        Missions.of(settings_of(name, scenario=scenario, changes=changes or []))
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_every_learner_of_the_package_can_be_named_and_its_class_found():
    assert {"ppo", "ippo", "mappo", "maskable-ppo", "recurrent-ppo", "sac", "td3", "tqc", "trpo",
            "learned-route", "learned-velocity"} <= set(learner_names())  # fmt: skip
    for name in learner_names():
        assert isinstance(class_named(settings_of(name).algorithm), type)


@pytest.mark.parametrize("level", LEVELS)
def test_a_level_says_its_rules_and_a_learner_what_is_its_own(level):
    settings = settings_of("sac", scenario=level)
    rules = Missions.of(settings).settings()
    assert rules["return_mode"] is LEVELS[level].return_mode
    assert rules["action"] == "velocity"
    assert "return_mode" in refusal("sac", level, ["environment.return_mode=false"])


def test_elsewhere_the_assistants_are_on_unless_they_are_taken_away():
    assert Missions.of(settings_of("ppo", scenario="village")).settings()["safety_filter"] is True
    bare = settings_of("ppo", scenario="village", changes=["environment.safety_filter=false"])
    assert Missions.of(bare).settings()["safety_filter"] is False


def test_what_is_learned_from_and_what_it_is_tried_on_share_no_mission():
    for name in ("easy", "streets", "generated"):
        missions = Missions.of(settings_of("ppo", scenario=name))
        seen = [missions.mission(number) for number in range(3)]
        unseen = list(missions.validation(3).values())
        assert len({str(each) for each in (*seen, *unseen)}) == 6
    village = Missions.of(settings_of("ppo", scenario="village"))
    assert [each.name for each in village.validation(5).values()] == ["village"]


def test_the_size_of_the_missions_of_a_family_can_be_said():
    towns = Missions.of(settings_of("learned-velocity"))
    drawn = sample_scenario(1_000_002, (1, 6), (20, 60), (5, 20))
    assert towns.mission(2) == drawn
    two = Missions.of(settings_of("ppo", scenario="streets", changes=["size.n_uas=[2, 2]"]))
    assert {len(two.mission(number).uas) for number in range(4)} == {2}
    assert two.source().room.n_uas == 2
    assert "'village' is no family" in refusal("ppo", "village", ["size.n_uas=[1, 2]"])
    assert "least and most" in refusal("ppo", "streets", ["size.n_uas=[3, 2]"])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("speed=9", "speed: unknown key"),
        ("environment.wind=9", "environment.wind: unknown key"),
        ("num_envs", "should be KEY=VALUE"),
        ("num_envs=0", "num_envs"),
        ("rounds=many", "rounds"),
        ("agent=both", "agent"),
        ("environment.action=sideways", "action is 'sideways'"),
        ("environment.observation=everything", "observation is 'everything'"),
        ("total_timesteps=" + "[" * 5000, "total_timesteps"),
        ("num_envs.deep=1", "there is no table 'num_envs'"),
    ],
)
def test_a_change_that_does_not_fit_is_named(change, words):
    assert words in refusal("ppo", changes=[change])


def test_a_change_reaches_one_table_of_a_list_or_all_of_them():
    changes = "learning.phases.1.noise=[0.3, 0.1]", "learning.phases.*.reward_weights.home=7.0"
    shipped, changed = settings_of("ppo-velocity"), settings_of("ppo-velocity", changes=changes)
    for number, (before, after) in enumerate(
        zip(shipped.learning["phases"], changed.learning["phases"], strict=True)
    ):
        assert before["reward_weights"]["home"] != 7.0
        noise = [0.3, 0.1] if number == 1 else before["noise"]
        weights = {**before["reward_weights"], "home": 7.0}
        assert after == {**before, "noise": noise, "reward_weights": weights}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("learning.phases.2.noise=[1.0, 1.0]", "there is no table '2'"),
        ("learning.phases.last.noise=[1.0, 1.0]", "there is no table 'last'"),
        ("learning.phases.*.noise.0=1.0", "noise is a list; give it as a whole"),
    ],
)
def test_a_change_of_a_list_that_does_not_fit_is_named(change, words):
    assert words in refusal("ppo-velocity", changes=[change])


def test_mistakes_in_names_are_answered_with_what_there_is():
    assert "did you mean mappo" in refusal("mapo")
    assert "no such file" in refusal("nowhere/mine.toml")
    assert "unknown scenario 'atlantis'" in refusal("ppo", "atlantis")
    with pytest.raises(InputError, match="algorithm 'tcq' is unknown; did you mean tqc"):
        class_named("tcq")
    with pytest.raises(InputError, match="there is no module 'my_missing_module'"):
        class_named("my_missing_module:Class")
    with pytest.raises(InputError, match="is no class"):
        class_named("math:pi")


@pytest.mark.parametrize(("key", "now"), [("steps", "total_timesteps"), ("missions", "num_envs")])
def test_keys_of_before_are_answered_with_what_says_the_same_now(tmp_path: Path, key, now):
    old = tmp_path / "old.toml"
    old.write_text(f'algorithm = "ppo"\n{key} = 8\n')
    assert f"{key} is {now} now" in refusal(str(old))


def test_a_file_of_ones_own_is_as_good_as_one_of_the_package(tmp_path: Path):
    mine = tmp_path / "mine.toml"
    mine.write_text('algorithm = "tqc"\nscenario = "medium"\n[learning]\nbatch_size = 32\n')
    settings = settings_of(str(mine), changes=["learning.gamma=0.9"])
    assert (settings.algorithm, settings.scenario) == ("tqc", "medium")
    assert settings.learning == {"batch_size": 32, "gamma": 0.9}


def test_texts_that_name_an_object_stand_for_it_and_others_for_themselves():
    given = {"a": "fractions:Fraction", "b": ["auto_0.02", "cuda:0", 3], "c": {"d": "math:pi"}}
    found = named_objects(given)
    assert found["a"].__name__ == "Fraction"
    assert found["b"] == ["auto_0.02", "cuda:0", 3]
    assert found["c"]["d"] == pytest.approx(3.1416, abs=1e-4)
    with pytest.raises(InputError, match="no module 'nowhere'"):
        named_objects("nowhere:Thing")


def test_only_classes_that_are_announced_need_no_trust():
    learning = {"policy_kwargs": {"activation_fn": "torch.nn:ReLU"}, "gamma": 0.9}
    known = LearnerSettings(algorithm="tqc", learning=learning)
    assert authors_own(known) == []
    assert authors_own(LearnerSettings(algorithm="sb3_contrib:TQC")) == []
    assert authors_own(LearnerSettings(algorithm="os:system")) == ["os:system"]
    hidden = {"policy_kwargs": {"features": ["subprocess:run"]}}
    found = authors_own(LearnerSettings(algorithm="ppo", policy="mine:Net", learning=hidden))
    assert found == ["mine:Net", "subprocess:run"]


def test_a_training_learns_on_a_lesson_and_says_so():
    missions = Missions.of(settings_of("ippo", scenario="hard:landing+assisted"))
    assert missions.settings()["safety_filter"]
    assert missions.mission(0).landing_distance_m > 2.0
    (entry,) = missions.entries(PlannerSpec.named("hover", "hover"), 1)
    assert (entry.level, entry.return_mode) == ("hard:landing+assisted", True)
    with pytest.raises(InputError, match="scenario 'hard:flying': lesson is 'flying'"):
        Missions.of(settings_of("ippo", scenario="hard:flying"))

from pathlib import Path

import pytest
from uas_coverage_agents.training.config import load_config
from uas_coverage_agents.training.published import PUBLISHED, published_names
from uas_coverage_agents.training.scenarios import (
    VALIDATION,
    town,
    training_scenarios,
    validation_scenarios,
)

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.scenario import sample_scenario

TINY = str(Path(__file__).with_name("tiny.toml"))


def refusal(*arguments, **named) -> str:
    with pytest.raises(InputError) as error:
        load_config(*arguments, **named)
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize("name", published_names())
def test_every_published_configuration_is_valid(name):
    config = load_config(name)
    assert config.summary
    towns = config.scenarios.family.towns
    assert towns is None or towns.first_seed >= 1_000_000


def test_there_are_configurations_for_both_interfaces():
    interfaces = {load_config(name).policy.interface for name in published_names()}
    assert interfaces == {"velocity", "waypoint"}
    assert {path.suffix for path in PUBLISHED.iterdir()} == {".toml"}


@pytest.mark.parametrize(
    ("change", "field", "value"),
    [
        ("steps=77", "steps", 77),
        ("learning.gamma = 0.5", "learning.gamma", 0.5),
        ("policy.hidden=[32, 16]", "policy.hidden", (32, 16)),
        ("policy.activation=relu", "policy.activation", "relu"),
        ('policy.activation="relu"', "policy.activation", "relu"),
        ("policy.safety_filter=false", "policy.safety_filter", False),
        ("scenarios.family.towns.n_uas=[3, 3]", "scenarios.family.towns.n_uas", (3, 3)),
    ],
)
def test_settings_can_be_changed_one_by_one(change, field, value):
    found = load_config(TINY, changes=[change])
    for name in field.split("."):
        found = getattr(found, name)
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("steps", "should be KEY=VALUE"),
        ("=3", "should be KEY=VALUE"),
        ("stepps=3", "there is no 'stepps'"),
        ("lerning.gamma=1", "there is no table 'lerning'"),
        ("steps.more=1", "there is no table 'steps'"),
        ("steps=0", "steps"),
        ("steps=many", "steps"),
        ("steps=1.5", "steps"),
        ("learning.gamma=nan", "learning"),
        ("learning.gamma=1.5", "gamma"),
        ("learning.algorithm=maskable-ppo", "waypoints need maskable-ppo"),
        ("learning.algorithm=magic", "learning"),
        ("policy.hidden=[]", "hidden"),
        ("policy.hidden=[999999]", "hidden"),
        ("policy.rewards.filter=1", "there is no 'filter'"),
        ("steps=" + "[" * 5000, "steps"),
    ],
)
def test_a_change_that_does_not_fit_is_named(change, words):
    assert words in refusal(TINY, changes=[change])


def test_a_configuration_with_the_names_of_before_is_the_same_one(tmp_path):
    old = tmp_path / "old.toml"
    text = (PUBLISHED / "ppo.toml").read_text()
    for name, former in (("[policy", "[player"), ('"attention"', '"gaze"'), ("num_envs", "lanes")):
        assert name in text
        text = text.replace(name, former)
    old.write_text(text)
    assert load_config(str(old)) == load_config("ppo")
    changed = [load_config("ppo", changes=[f"{table}.keys=8"]) for table in ("player", "policy")]
    assert changed[0] == changed[1] != load_config("ppo")
    assert load_config("ppo", changes=["lanes=8"]) == load_config("ppo", changes=["num_envs=8"])


def test_a_table_is_not_given_under_both_names(tmp_path):
    both = tmp_path / "both.toml"
    both.write_text(Path(TINY).read_text() + '[player]\ninterface = "velocity"\n')
    assert "player: unknown key" in refusal(str(both))


def test_mistakes_in_the_name_are_answered_with_what_there_is():
    assert "unknown algorithm 'a3c'; take " in refusal("a3c")
    assert "no such file" in refusal("nowhere/mine.toml")


def test_a_training_can_be_moved_to_one_scenario():
    config = load_config(TINY, scenario="village")
    assert config.scenarios.family.towns is None
    (scenario,) = training_scenarios(config.scenarios, seed=3)
    assert scenario.name == "village"
    assert validation_scenarios(config.scenarios.family, 5) == [scenario]
    assert load_config(TINY, scenario="generated") == load_config(TINY)


def test_training_and_validation_share_no_town():
    config = load_config(TINY)
    seeds = [{s.name for s in training_scenarios(config.scenarios, seed)} for seed in (0, 1)]
    unseen = {s.name for s in validation_scenarios(config.scenarios.family, 3)}
    assert len(seeds[0] | seeds[1] | unseen) == 2 + 2 + 3


def test_towns_are_drawn_as_the_leaderboard_draws_them():
    assert [town(VALIDATION, n) for n in (0, 7)] == [
        sample_scenario(VALIDATION.first_seed + n) for n in (0, 7)
    ]

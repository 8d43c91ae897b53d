import json
import shutil
import sys

import pytest
from tiny_policies import describe, write
from tiny_trainings import tiny
from uas_coverage_agents.training.rounds import TrainingJob, train

from uas_coverage_env import InputError, generate_scenario, load_planner, rollout
from uas_coverage_env.cli import main
from uas_coverage_env.flight import describe_planners, registry


@pytest.fixture(scope="module")
def scenario():
    return generate_scenario(900_501, n_uas=2, n_waypoints=5, n_obstacles=2)


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trained")
    settings = tiny("ippo", "environment.action=velocity", "rounds=1", scenario="village")
    train({folder: TrainingJob("ippo", settings, 0, missions=1)})
    return folder / "policy"


@pytest.fixture
def directory(trained, tmp_path):
    return shutil.copytree(trained, tmp_path / "policy")


def test_a_policy_directory_is_a_planner(directory, scenario):
    flight = rollout(scenario, load_planner(f"policy:{directory}"), max_steps=5)
    assert flight.planner == f"policy:{directory}"
    assert flight.planner_options == {"filter": True, "return_mode": True, "trust": False}
    assert (flight.safety_filter, flight.return_mode) == (True, True)
    bare = load_planner(f"policy:{directory}", {"filter": "false", "return_mode": "false"})
    flight = rollout(scenario, bare, max_steps=5)
    assert (flight.safety_filter, flight.return_mode) == (False, False)


def test_a_policy_whose_network_is_none_of_its_interface_is_refused(tmp_path):
    write(tmp_path / "policy")
    with pytest.raises(InputError, match="cannot be flown: its observation is not that"):
        load_planner(f"policy:{tmp_path / 'policy'}")


def test_without_the_extra_a_policy_of_a_library_says_what_to_install(directory, monkeypatch):
    for name in [name for name in sys.modules if name.startswith("uas_coverage_agents.training.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    monkeypatch.setitem(sys.modules, "stable_baselines3.common.env_util", None)
    with pytest.raises(InputError, match=r"pip install 'uas-coverage-env\[learn\]'"):
        load_planner(f"policy:{directory}")


def test_the_words_about_an_observation_may_change_and_its_numbers_may_not():
    view = describe().observation
    group = view.groups[0]
    reworded = group.features[0].model_copy(update={"meaning": "said in another way"})
    narrowed = group.features[0].model_copy(update={"low": -0.5})
    for feature, same in ((reworded, True), (narrowed, False)):
        features = (feature, *group.features[1:])
        groups = (group.model_copy(update={"features": features}), *view.groups[1:])
        assert view.model_copy(update={"groups": groups}).has_the_numbers_of(view) == same
    scales = view.scales | {"ray_m": 81.0}
    assert not view.model_copy(update={"scales": scales}).has_the_numbers_of(view)


def test_planners_of_a_kind_are_named_with_their_argument(directory):
    assert "policy" not in registry.planner_names()
    described = {planner.name: planner for planner in describe_planners()}
    assert [option.name for option in described["policy:DIR"].options] == [
        "filter", "return_mode", "trust",
    ]  # fmt: skip
    for name in ("policy", "policy:", "polity:here"):
        with pytest.raises(InputError, match=r"planner .*policy:(\.\.\.|here)"):
            load_planner(name)
    with pytest.raises(InputError, match="':here' is no MODULE:"):
        load_planner(":here")
    with pytest.raises(InputError, match="no option 'speed'; allowed: filter, return_mode, trust"):
        load_planner(f"policy:{directory}", {"speed": "1"})


def test_a_policy_flies_from_the_command_line(directory, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "village", "--planner", "policy:policy", "--steps", "2"]) == 0
    record = json.loads((tmp_path / "flights/village-policy-policy-0/summary.json").read_text())
    assert record["planner"]["name"] == "policy:policy"
    capsys.readouterr()
    (directory / "policy.safetensors").unlink()
    assert main(["run", "village", "--planner", "policy:policy"]) == 2
    line = capsys.readouterr().err
    assert line == (
        "error: policy/policy.safetensors: is missing; "
        "a policy is policy.json and policy.safetensors\n"
    )

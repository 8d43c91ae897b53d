import json

import numpy as np
import pytest
from tiny_policies import describe, weights, write
from uas_coverage_agents.policy import save_policy
from uas_coverage_agents.policy.planner import PolicyPlanner

from uas_coverage_env import InputError, generate_scenario, load_planner, rollout
from uas_coverage_env.cli import main
from uas_coverage_env.env import CoverageParallelEnv
from uas_coverage_env.flight import describe_planners, registry


@pytest.fixture(scope="module")
def scenario():
    return generate_scenario(900_501, n_uas=2, n_waypoints=5, n_obstacles=2)


@pytest.fixture
def directory(tmp_path):
    write(tmp_path / "policy")
    return tmp_path / "policy"


def test_a_policy_directory_is_a_planner(directory, scenario):
    flight = rollout(scenario, load_planner(f"policy:{directory}"), max_steps=5)
    assert flight.planner == f"policy:{directory}"
    assert flight.planner_options == {"filter": True, "return_mode": True}
    assert (flight.safety_filter, flight.return_mode) == (True, True)
    bare = load_planner(f"policy:{directory}", {"filter": "false", "return_mode": "false"})
    flight = rollout(scenario, bare, max_steps=5)
    assert (flight.safety_filter, flight.return_mode) == (False, False)


def test_a_policy_flies_as_its_actions_do_in_the_environment(directory, scenario):
    planner = load_planner(f"policy:{directory}")
    assert isinstance(planner, PolicyPlanner)
    flight = rollout(scenario, planner, max_steps=40)
    env = CoverageParallelEnv(scenario, return_mode=True, safety_filter=True)
    views, _ = env.reset()
    positions_m = [env.swarm_state().x[:, :3]]
    for _ in range(40):
        outputs = planner.policy.forward(np.stack([views[agent] for agent in env.agents]))
        actions = np.clip(outputs, -1, 1).astype(np.float64)
        views, *_ = env.step(dict(zip(env.agents, actions, strict=True)))
        positions_m.append(env.swarm_state().x[:, :3])
    assert np.array_equal(flight.x[:, :, :3], positions_m)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"interface": "waypoint"}, "cannot be flown"),
        ({"outputs": 4}, "network.outputs is 4, not 3"),
        ({"layout": "somebody's own"}, "observation is not that of this version"),
    ],
)
def test_a_policy_that_cannot_be_flown_is_refused(tmp_path, changes, words):
    description = describe()
    network, view = description.network, description.observation
    if "outputs" in changes:
        network = network.model_copy(update=changes)
    if "layout" in changes:
        view = view.model_copy(update=changes)
    interface = changes.get("interface", "velocity")
    description = describe(network=network, observation=view, interface=interface)
    save_policy(tmp_path / "policy", description, weights(description))
    with pytest.raises(InputError, match=words):
        load_planner(f"policy:{tmp_path / 'policy'}")


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
    assert [option.name for option in described["policy:DIR"].options] == ["filter", "return_mode"]
    for name in ("policy", "policy:", "polity:here"):
        with pytest.raises(InputError, match=r"planner .*policy:(\.\.\.|here)"):
            load_planner(name)
    with pytest.raises(InputError, match="':here' is no MODULE:"):
        load_planner(":here")
    with pytest.raises(InputError, match="no option 'speed'; allowed: filter, return_mode"):
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

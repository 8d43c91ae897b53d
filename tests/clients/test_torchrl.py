"""TorchRL: `PettingZooWrapper`, `GymEnv` and `GymWrapper`."""

from typing import Any

import pytest
from libraries import SHORT, library

envs = library("torchrl.envs")
check_env_specs = library("torchrl.envs.utils").check_env_specs

import gymnasium

from uas_coverage_env import uas_coverage_v0


def wrapped(*, wrapper: dict[str, Any], **settings) -> Any:
    env = uas_coverage_v0.parallel_env(**SHORT, flat_infos=True, **settings)
    return envs.PettingZooWrapper(env, **wrapper)


@pytest.mark.parametrize("wrapper", [{}, {"use_mask": True, "return_state": True}])
@pytest.mark.parametrize("action", ["velocity", "acceleration", "wrench", "waypoint"])
def test_the_parallel_environment_flies(action, wrapper):
    env = wrapped(wrapper=wrapper, action=action, safety_filter=True)
    check_env_specs(env)
    rollout = env.rollout(20)
    assert rollout["uas", "observation"].shape[1:] == (2, 234)
    assert rollout["uas", "info", "reward_terms_home"].shape[1:] == (2,)


def test_agents_that_end_are_masked_out_until_the_mission_ends():
    env = wrapped(
        wrapper={"use_mask": True, "done_on_any": False},
        action="waypoint",
        mask_in_observation=True,
    )
    check_env_specs(env)
    env.set_seed(0)
    rollouts = [env.rollout(20) for _ in range(6)]
    assert any((~r["uas", "mask"]).any() for r in rollouts)
    assert all(r["next", "done"][-1].all() for r in rollouts)
    for r in rollouts:
        chosen = r["uas", "action"].unsqueeze(-1)
        allowed = r["uas", "action_mask"].gather(-1, chosen).squeeze(-1)
        assert allowed.all()


@pytest.mark.parametrize("settings", [{}, {"action": "waypoint", "mask_in_observation": True}])
def test_the_swarm_as_one_agent_flies(settings):
    env = envs.GymEnv("UASCoverage-v0", **SHORT, **settings)
    check_env_specs(env)
    assert 0 < len(env.rollout(20)) <= 12


@pytest.mark.parametrize("settings", [{"autoreset_mode": "Disabled"}, {"flat_infos": True}])
def test_many_missions_fly(settings):
    settings = {"autoreset_mode": "SameStep", **settings}
    env = envs.GymWrapper(
        gymnasium.make_vec(
            "UASCoverage-v0",
            num_envs=3,
            vectorization_mode="vector_entry_point",
            **SHORT,
            **settings,
        )
    )
    check_env_specs(env)
    assert env.rollout(20).shape[0] == 3

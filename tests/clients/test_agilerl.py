"""AgileRL: environments in processes, and its own training loop."""

import numpy as np
from libraries import SHORT, library

AsyncPettingZooVecEnv = library("agilerl.vector.pz_async_vec_env").AsyncPettingZooVecEnv
IPPO = library("agilerl.algorithms").IPPO
training = library("agilerl.training.train_multi_agent_on_policy")

from supersuit import black_death_v3

from uas_coverage_env import uas_coverage_v0


def choosing():
    return uas_coverage_v0.parallel_env(**SHORT, action="waypoint")


def flying():
    # its IPPO learns from the NaN that it puts where agents have ended; with this they stay
    return black_death_v3(uas_coverage_v0.parallel_env(**SHORT))


def test_environments_in_processes_tell_numbers_and_go_on_with_agents_that_have_ended():
    envs = AsyncPettingZooVecEnv([choosing] * 2)
    try:
        envs.reset()
        for _ in range(6):  # the first goes home at once, and is asked on
            observations, *_, infos = envs.step(
                {"uas_1": np.full(2, 12), "uas_2": np.zeros(2, int)}
            )
        assert observations["uas_2"].shape == (2, 234)
        assert infos["uas_2"]["status"].tolist() == [0, 0]
    finally:
        envs.close()


def test_ippo_learns_in_its_own_loop():
    # of velocities: AgileRL 2.7.1 compares masks with None, and raises
    envs = AsyncPettingZooVecEnv([flying] * 2)
    example = flying()
    names = example.possible_agents
    agent = IPPO(
        observation_spaces=[example.observation_space(name) for name in names],
        action_spaces=[example.action_space(name) for name in names],
        agent_ids=names,
        batch_size=8,
        learn_step=16,
        update_epochs=1,
        device="cpu",
    )
    try:
        (learned,), _ = training.train_multi_agent_on_policy(
            envs,
            "uas",
            "IPPO",
            [agent],
            max_steps=32,
            evo_steps=32,
            eval_steps=12,
            wb=False,
            verbose=False,
        )
    finally:
        envs.close()
    weights = [each for actor in learned.actors.values() for each in actor.parameters()]
    assert weights
    assert all(each.isfinite().all() for each in weights)

"""BenchMARL's algorithms on the task of `uas_coverage_agents.training.benchmarl`."""

import pytest
from libraries import SHORT, library

algorithms = library("benchmarl.algorithms")
experiment = library("benchmarl.experiment")
mlp = library("benchmarl.models.mlp")

from uas_coverage_agents.training.benchmarl import CoverageTask


@pytest.mark.parametrize(
    ("name", "continuous"),
    [("Ippo", True), ("Mappo", True), ("Mappo", False), ("Qmix", False), ("Maddpg", True)],
)
def test_an_algorithm_learns_for_two_iterations(name, continuous, tmp_path):
    config = experiment.ExperimentConfig.get_from_yaml()
    config.save_folder = str(tmp_path)
    config.loggers, config.create_json = [], False
    config.evaluation = config.render = False
    config.max_n_iters, config.max_n_frames = 2, None
    config.prefer_continuous_actions = continuous
    config.on_policy_collected_frames_per_batch = 60
    config.off_policy_collected_frames_per_batch = 60
    config.on_policy_n_envs_per_worker = config.off_policy_n_envs_per_worker = 1
    config.on_policy_n_minibatch_iters, config.on_policy_minibatch_size = 1, 30
    config.off_policy_n_optimizer_steps, config.off_policy_train_batch_size = 2, 16
    model = mlp.MlpConfig.get_from_yaml()
    model.num_cells = [16]
    run = experiment.Experiment(
        task=CoverageTask(**SHORT),
        algorithm_config=getattr(algorithms, f"{name}Config").get_from_yaml(),
        model_config=model,
        critic_model_config=model,
        seed=0,
        config=config,
    )
    run.run()
    assert run.n_iters_performed == 2
    assert run.total_frames == 120

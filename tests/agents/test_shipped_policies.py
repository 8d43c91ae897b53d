"""The policies that come with the package fly as they say, on towns that they have not seen."""

import subprocess
import sys

import numpy as np
import pytest
from uas_coverage_agents.policy import load_policy
from uas_coverage_agents.training.scenarios import VALIDATION, town, validation_scenarios
from uas_coverage_agents.training.score import MEASURES, fly
from uas_coverage_agents.velocity.planner import SHIPPED, LearnedVelocity

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.flight.metrics import accomplished


def test_learned_velocity_is_a_planner_with_both_assistants():
    planner = load_planner("learned-velocity")
    assert isinstance(planner, LearnedVelocity)
    assert planner.assistants.return_mode
    assert planner.assistants.safety_filter
    assert planner.fingerprint == load_policy(SHIPPED).description.weights_sha256
    bare = load_planner("learned-velocity", {"filter": "false", "return_mode": "false"})
    assert isinstance(bare, LearnedVelocity)
    assert not bare.assistants.return_mode
    assert not bare.assistants.safety_filter


def test_learned_velocity_repeats_the_first_flights_of_its_score():
    results = fly(load_policy(SHIPPED), [town(VALIDATION, number) for number in range(3)])
    coverage, all_home, violations = (
        results[:, MEASURES.index(name)] for name in ("coverage", "all_home", "violations")
    )
    assert coverage.mean() >= 0.95
    assert all_home.all()
    assert not violations.any()


def test_learned_velocity_accomplishes_the_village():
    flight = rollout("village", "learned-velocity")
    assert accomplished(flight)
    assert flight.breaches == 0


def test_learned_velocity_is_small_and_says_how_it_was_made():
    described = load_policy(SHIPPED).description
    assert described.scenarios.towns.first_seed >= 1_000_000
    assert described.score.measures["coverage"].mean >= 0.95
    assert described.score.measures["all_home"].mean == 1.0
    assert described.score.measures["violations"].mean == 0.0
    assert sum(file.stat().st_size for file in SHIPPED.iterdir()) < 100_000


def test_learned_velocity_flies_more_uas_than_it_was_trained_with():
    scenario = town(VALIDATION.model_copy(update={"n_uas": (8, 8)}), 1)
    flight = rollout(scenario, "learned-velocity")
    assert flight.planner == "learned-velocity"
    assert accomplished(flight)


def test_flying_a_shipped_policy_loads_nothing_that_it_was_trained_with():
    script = (
        "import sys\n"
        "from uas_coverage_env import rollout\n"
        "rollout('village', 'learned-velocity', max_steps=2)\n"
        "heavy = 'torch', 'stable_baselines3', 'sb3_contrib', 'matplotlib', 'cloudpickle'\n"
        "sys.stdout.write(' '.join(name for name in heavy if name in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr


@pytest.mark.slow
def test_learned_velocity_scores_inside_its_published_intervals():
    policy = load_policy(SHIPPED)
    score = policy.description.score
    assert score is not None
    towns = validation_scenarios(policy.description.scenarios, score.missions)
    means = dict(zip(MEASURES, np.mean(fly(policy, towns), axis=0), strict=True))
    for name, measure in score.measures.items():
        # a mean of hundreds of floats may differ in its last digits
        assert measure.low - 1e-9 <= means[name] <= measure.high + 1e-9, name

"""The shipped policy `learned-waypoint`: found by name, and it flies."""

import subprocess
import sys

import pytest
from uas_coverage_agents.policy import load_policy
from uas_coverage_agents.waypoint.planner import SHIPPED, LearnedWaypoint

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight.metrics import coverage, energy_Wh, home


def test_the_shipped_policy_covers_the_village_and_saves_energy_and_time():
    flight = rollout("village", load_planner("learned-waypoint", {"simulations": "0"}))
    greedy = rollout("village", load_planner("nearest-waypoint"))
    assert coverage(flight) == 1.0
    assert home(flight).all()
    assert not flight.violations
    assert energy_Wh(flight).sum() < 0.9 * energy_Wh(greedy).sum()
    assert flight.steps < greedy.steps


def test_its_options_say_what_flies_along():
    planner = load_planner("learned-waypoint", {"filter": "false", "simulations": "7"})
    assert isinstance(planner, LearnedWaypoint)
    assert not planner.assistants.safety_filter
    assert planner.assistants.return_mode
    assert planner.options.model_dump()["simulations"] == 7
    with pytest.raises(InputError, match="simulations"):
        load_planner("learned-waypoint", {"simulations": "-1"})


def test_the_shipped_file_says_how_it_was_made():
    described = load_policy(SHIPPED).description
    assert described.training.algorithm == "maskable-ppo"
    assert described.training.process_s < 2 * 300  # five minutes on two cores
    assert described.scenarios.towns.first_seed >= 1_000_000
    assert described.score.measures["coverage"].mean >= 0.99
    assert described.score.measures["all_home"].mean == 1.0
    assert sum(file.stat().st_size for file in SHIPPED.iterdir()) < 200_000


def test_flying_it_needs_neither_torch_nor_pickle():
    program = (
        "import sys\n"
        "from uas_coverage_env import load_planner, rollout\n"
        "planner = load_planner('learned-waypoint', {'simulations': '0'})\n"
        "rollout('open_field', planner, max_steps=3)\n"
        "heavy = ('torch', 'stable_baselines3', 'sb3_contrib', 'cloudpickle')\n"
        "sys.stdout.write(' '.join(name for name in heavy if name in sys.modules))"
    )
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout == ""

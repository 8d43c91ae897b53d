"""Equal seeds and actions make equal missions: to the last bit, and in another process too."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

from uas_coverage_env import uas_coverage_v0

STEPS = 80


def trajectory_hash(action: str, dynamics: str, safety_filter: bool) -> str:
    """SHA-256 of all that an environment returns in random missions."""
    env = uas_coverage_v0.parallel_env(
        "village", action=action, dynamics=dynamics, safety_filter=safety_filter
    )
    rng = np.random.default_rng(5)
    digest = hashlib.sha256()
    env.reset(seed=5)
    for _ in range(STEPS):
        if not env.agents:
            env.reset()
        actions = {}
        for agent in env.agents:
            if action == "waypoint":
                actions[agent] = int(rng.integers(13))
            else:
                actions[agent] = rng.uniform(-1, 1, env.action_space(agent).shape)
        results = env.step(actions)
        observations, *rest = results
        for agent in observations:
            digest.update(observations[agent].tobytes())
        digest.update(repr([_plain(result) for result in rest]).encode())
        digest.update(env.state().tobytes())
    return digest.hexdigest()


def _plain(value):
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return value.tolist() if isinstance(value, np.ndarray) else value


CASES = [
    ("velocity", "lpv", False),
    ("velocity", "nonlinear", True),
    ("acceleration", "lpv", False),
    ("wrench", "nonlinear", False),
    ("waypoint", "lpv", True),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: "-".join(map(str, case)))
def test_two_environments_fly_the_same_full_missions(case):
    assert trajectory_hash(*case) == trajectory_hash(*case)


def test_another_process_with_another_hash_seed_flies_the_same():
    here = [trajectory_hash(*case) for case in CASES]
    code = (
        f"import sys; sys.path.insert(0, {os.path.dirname(__file__)!r})\n"
        "from test_determinism import CASES, trajectory_hash\n"
        "print(*[trajectory_hash(*case) for case in CASES])"
    )
    for hash_seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": hash_seed}
        run = subprocess.run(
            [sys.executable, "-c", code],
            env=environment,
            capture_output=True,
            check=True,
            text=True,
        )
        assert run.stdout.split() == here


def test_other_actions_make_another_mission():
    assert trajectory_hash(*CASES[0]) != trajectory_hash("velocity", "nonlinear", False)

"""A training on numba's simulated GPU, and the same on the processor; prints how they compare.

Run as a program, with NUMBA_ENABLE_CUDASIM=1 and NUMBA_DISABLE_JIT=1: see
`test_training_on_gpu.py`.
"""

import json
from unittest.mock import patch

import numpy as np
from uas_coverage_agents.training import packed
from uas_coverage_agents.training.learner import Told
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.packed import PackedPpo
from uas_coverage_agents.training.settings import settings_of

from uas_coverage_env.env.gpu import missions as missions_on_gpu

N_MISSIONS = 4
SETTINGS = (
    *(f"num_envs={N_MISSIONS}", "rounds=1", "total_timesteps=60"),
    *("size.n_uas=[1,2]", "size.n_waypoints=[4,5]", "size.n_obstacles=[1,2]"),
    *("environment.return_mode=false", "environment.safety_filter=false"),
    *("environment.max_cycles=4", "learning.n_steps=6", "learning.batch_size=16"),
    *("learning.hidden=[8,4]", "learning.missions=3"),
)


def learned(name, device):
    """State and what was told, and the choices among which it was drawn."""
    settings = settings_of(name, scenario="generated", changes=[*SETTINGS, f"device={device}"])
    learner, told = PackedPpo(settings, Missions.of(settings), 3), Told()
    learner.learn(0, told)
    return learner.state_dict(), told.rows, learner.learned().tensors


def compared(name):
    """How both end."""
    (here, told, tensors), (there, told_there, tensors_there) = (
        learned(name, device) for device in ("cpu", "cuda")
    )
    return {
        "different": [key for key in here if not np.array_equal(here[key], there[key])],
        "policies": all(np.array_equal(tensors[key], tensors_there[key]) for key in tensors),
        "told": told == told_there,
        "updates": len(told),
        "steps": int(here["steps"]),
        "flights": sum(numbers["flights"] for _, numbers in told),
        "learned": float(np.abs(here["adam/0/exp_avg"]).max()),
    }


if __name__ == "__main__":
    # the simulator starts a thread of the processor for each of a block
    missions_on_gpu.THREADS_PER_BLOCK = N_MISSIONS
    with patch.object(packed, "AUTORESET", "next_step"):  # as on a GPU
        print(json.dumps({name: compared(name) for name in ("ppo-waypoint", "ppo-velocity")}))

"""Own sensors and terms on numba's simulated GPU, and the same in a batch: `simulated_gpu`."""

import numpy as np
from beside_batches import compare
from own_blocks import SLOW, beacon
from practice_grounds import practice_ground

from uas_coverage_env.env import OBSERVATION, REWARD, grid

GROUND = practice_ground(n_uas=2, tower=True, n_moving=1, max_steps=4)
ASKED = np.full((2, 3), 0.3)
OWN = {
    "behind": {"observation": (*OBSERVATION, beacon(9.0, 0.0)), "reward": (*REWARD, SLOW)},
    "alone": {"observation": (beacon(0.0, 40.0),), "reward": (SLOW,)},
    "weighed": {"reward": (SLOW, *REWARD), "reward_weights": {"slow": 3.0}},
    "local": {"observation": "local"},
    "picture": {"observation": (*OBSERVATION, grid(8))},
}


def compare_all():
    """Blocks and terms of one's own, and those of the package that are not the default."""
    return {name: compare(GROUND, ASKED, 6, **settings) for name, settings in OWN.items()}

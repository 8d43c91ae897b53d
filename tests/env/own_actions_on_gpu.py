"""An own kind of action on numba's simulated GPU, and the same as an episode: `simulated_gpu`."""

import numpy as np
from own_actions import CLIMB_RATE, faulty
from practice_grounds import practice_ground

from uas_coverage_env.env.episode.episode import Episode
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.gpu.missions import CudaMissions


def compare():
    """Fly both ways, and what cannot be flown."""
    ground = practice_ground(n_uas=2, max_steps=10)
    missions = CudaMissions(2, ground, action=CLIMB_RATE)
    episode = Episode(ground, MissionSettings(action=CLIMB_RATE))
    episode.reset()
    start_m = episode.positions_m.copy()
    rng = np.random.default_rng(0)
    different = 0
    for _ in range(8):
        asked = rng.uniform(-1, 1, (2, 2, 3))
        missions.step(asked)
        episode.asked[:] = asked[1]
        episode.step()
        seen = missions.missions.first_observations.observation[1]
        different += int((seen != episode.observation).sum())
    wrong = CudaMissions(2, ground, action=faulty(0))
    wrong.step(np.array([[[0.0], [0.9]], [[0.3], [0.0]]]))
    return {
        "different": different,
        "moved": bool((np.abs(episode.positions_m - start_m) > 1.0).any()),
        "refused": wrong.missions.refused.tolist(),
    }

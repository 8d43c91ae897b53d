"""Missions on numba's simulated GPU, and the same as episodes; prints how they compare, as JSON.

Run as a program, with NUMBA_ENABLE_CUDASIM=1.
"""

import json

import numpy as np
from practice_grounds import practice_ground, with_roles

from uas_coverage_env.env.cuda import CudaMissions
from uas_coverage_env.env.episode import Episode
from uas_coverage_env.env.memory import LIMITS, REWARD
from uas_coverage_env.env.settings import MissionSettings
from uas_coverage_env.scenario import Wind
from uas_coverage_env.vehicle import limit_names

N_LANES, N_STEPS = 2, 13


def compare(ground):
    """Fly both ways, lanes with different actions, past the end of missions."""
    missions = CudaMissions(N_LANES, ground)
    episodes = [Episode(ground, MissionSettings()) for _ in range(N_LANES)]
    for episode in episodes:
        episode.reset()
    rng = np.random.default_rng(0)
    different, restarts = 0, 0
    ended = [False] * N_LANES
    for _ in range(N_STEPS):
        asked = rng.uniform(-1, 1, (N_LANES, 2, 3))
        missions.step(asked)
        seen = missions.missions
        for lane, episode in enumerate(episodes):
            if ended[lane]:
                episode.reset()
                ended[lane] = False
                restarts += 1
            else:
                episode.asked[:] = asked[lane]
                episode.step()
                amounts = np.array(episode.amounts)
                different += int((seen.rewards[lane] != amounts[:, REWARD]).sum())
                ended[lane] = bool(seen.ended[lane])
            different += int(
                (seen.first_observations.observation[lane] != episode.observation).sum()
            )
    asked[0, 1, 2] = np.nan
    before = missions.missions.worlds.x.copy()
    missions.step(asked)
    changed = (missions.missions.worlds.x != before).any(axis=(1, 2)).tolist()
    return {
        "different": different,
        "restarts": restarts,
        "refused": missions.missions.refused.tolist(),
        "changed": changed,
        "x": missions.missions.worlds.x[1].tolist(),
        "acted": int(missions.missions.acted.sum()),
        "limits_exceeded": limits_exceeded(),
    }


def limits_exceeded():
    """Names of the limits that the largest pitch torque exceeds, step by step."""
    missions = CudaMissions(1, practice_ground(n_uas=1, size_m=2000.0), action="wrench")
    found = []
    for _ in range(3):
        missions.step(np.array([[[0.0, 0.0, 1.0, 0.0]]]))
        found.append(limit_names(int(missions.missions.learners.report[0, 0, LIMITS])))
    return found


if __name__ == "__main__":
    still = practice_ground(n_uas=2, tower=True, n_moving=1, max_steps=5)
    windy = still.model_copy(update={"wind": Wind(mean_mps=4.0, from_deg=30.0, up_mps=0.5)})
    high = with_roles(still.model_copy(update={"min_height_m": 6.0}))
    flown = {"still": compare(still), "windy": compare(windy), "high": compare(high)}
    print(json.dumps(flown))

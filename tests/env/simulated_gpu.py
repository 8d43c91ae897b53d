"""Missions on numba's simulated GPU, and the same as episodes; prints how they compare, as JSON.

Run as a program, with NUMBA_ENABLE_CUDASIM=1 and NUMBA_DISABLE_JIT=1: see the fixture
`flown_on_gpu`.
"""

import json
import sys
from pathlib import Path

import numpy as np
from practice_grounds import practice_ground, with_roles

sys.path.insert(0, str(Path(__file__).parents[1]))  # as pytest does

import own_actions_on_gpu
import own_disturbances_on_gpu
import scenes_on_gpu

from uas_coverage_env.env.episode.episode import Episode
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.gpu import missions as missions_on_gpu
from uas_coverage_env.env.gpu.missions import CudaMissions
from uas_coverage_env.env.report import CONTACT, LIMITS, REWARD
from uas_coverage_env.scenario import Wind
from uas_coverage_env.scenario.packs import Sorties
from uas_coverage_env.vehicle.limits import limit_names

N_LANES, N_STEPS = 2, 13


def compare(ground, ask=None, **settings):
    """Fly both ways, lanes with different actions, past the end of missions.

    Args:
        ground: The mission.
        ask: The actions of a step, by its number; None: any.
        **settings: Of both.
    """
    missions = CudaMissions(N_LANES, ground, **settings)
    episodes = [Episode(ground, MissionSettings.of(settings)) for _ in range(N_LANES)]
    size = episodes[0].actions.size
    for episode in episodes:
        episode.reset()
    rng = np.random.default_rng(0)
    different, restarts = 0, 0
    ended = [False] * N_LANES
    statuses, contacts = set(), set()
    for k in range(N_STEPS):
        asked = rng.uniform(-1, 1, (N_LANES, 2, size)) if ask is None else ask(k)
        missions.step(asked)
        seen = missions.missions
        statuses |= set(seen.worlds.uas["status"].ravel().tolist())
        contacts |= set(seen.learners.report[:, :, CONTACT].ravel().tolist())
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
        "statuses": sorted(statuses),
        "contacts": sorted(contacts),
        "restarts": restarts,
        "refused": missions.missions.refused.tolist(),
        "changed": changed,
        "x": missions.missions.worlds.x[1].tolist(),
        "acted": int(missions.missions.acted.sum()),
        "limits_exceeded": limits_exceeded(),
    }


def limits_exceeded():
    """Names of the limits that a constant pitch torque exceeds, step by step."""
    missions = CudaMissions(1, practice_ground(n_uas=1, size_m=2000.0), action="wrench")
    found = []
    for _ in range(6):
        missions.step(np.array([[[0.0, 0.0, 0.1, 0.0]]]))
        found.append(limit_names(int(missions.missions.learners.report[0, 0, LIMITS])))
    return found


def out_and_back(k):
    """The first lane flies there and back; the other one a little later."""
    asked = np.zeros((N_LANES, 2, 3))
    asked[0, :, 0] = -0.5 if k % 6 < 2 else 0.5
    asked[1, :, 0] = -0.5 if k % 6 < 3 else 0.5
    asked[..., 2] = -0.5
    return asked


def swapping_ground():
    """UAS land fast and far from their starts, cover a waypoint of two, and swap packs."""
    waypoints_m = ((74.0, 100.0, -10.0), (120.0, 120.0, -10.0))
    ground = practice_ground(n_uas=2, waypoints_m=waypoints_m, max_steps=16)
    swapped = Sorties(packs=3, swap_s=2.0, together=False)
    rules = {"landing_distance_m": 6.0, "landing_speed_mps": 20.0, "sorties": swapped}
    return ground.model_copy(update=rules)


if __name__ == "__main__":
    # the simulator starts a thread of the processor for each of a block, whether it flies a lane or
    # not: one that flies none is enough
    missions_on_gpu.THREADS_PER_BLOCK = N_LANES + 1
    still = practice_ground(n_uas=2, tower=True, n_moving=1, max_steps=5)
    windy = still.model_copy(update={"wind": Wind(mean_mps=4.0, from_deg=30.0, up_mps=0.5)})
    high = with_roles(still.model_copy(update={"min_height_m": 6.0}))
    flown = {"still": compare(still), "windy": compare(windy), "high": compare(high)}
    flown["wrenches"] = compare(still, action="wrench")
    flown["packs"] = compare(swapping_ground(), out_and_back)
    own = {
        "actions": own_actions_on_gpu.compare(),
        "disturbances": own_disturbances_on_gpu.compare_all(),
        "scenes": scenes_on_gpu.compare_all(),
    }
    print(json.dumps({"missions": flown, **own}))

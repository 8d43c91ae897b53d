"""Missions on numba's simulated GPU, and the same in a batch; prints how they compare, as JSON.

Run as a program, with NUMBA_ENABLE_CUDASIM=1 and NUMBA_DISABLE_JIT=1: see the fixture
`flown_on_gpu`.
"""

import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # as pytest does

import arrays_on_gpu
import guided_on_gpu
import own_actions_on_gpu
import own_blocks_on_gpu
import own_disturbances_on_gpu
import scenes_on_gpu
from beside_batches import N_LANES, compare
from practice_grounds import practice_ground, with_roles

from uas_coverage_env.env.gpu import missions as missions_on_gpu
from uas_coverage_env.env.report import LIMITS
from uas_coverage_env.scenario import Wind
from uas_coverage_env.scenario.packs import Sorties
from uas_coverage_env.vehicle.limits import limit_names

N_STEPS = 13


def any_actions(size):
    """Others in every step, lane and UAS."""
    rng = np.random.default_rng(0)
    return lambda k: rng.uniform(-1, 1, (N_LANES, 2, size))


def limits_exceeded():
    """Names of the limits that a constant pitch torque exceeds, step by step."""
    ground = practice_ground(n_uas=1, size_m=2000.0)
    missions = missions_on_gpu.CudaMissions(1, ground, action="wrench")
    missions.reset(seed=1)
    found = []
    for _ in range(6):
        missions.step(np.array([[[0.0, 0.0, 0.1, 0.0]]]))
        found.append(limit_names(int(missions.report[0, 0, LIMITS])))
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
    grounds = {"still": still, "windy": windy, "high": high}
    flown = {name: compare(each, any_actions(3), N_STEPS) for name, each in grounds.items()}
    flown["wrenches"] = compare(still, any_actions(4), N_STEPS, action="wrench")
    flown["packs"] = compare(swapping_ground(), out_and_back, N_STEPS)
    own = {
        "limits_exceeded": limits_exceeded(),
        "actions": own_actions_on_gpu.compare_all(),
        "blocks": own_blocks_on_gpu.compare_all(),
        "disturbances": own_disturbances_on_gpu.compare_all(),
        "scenes": scenes_on_gpu.compare_all(),
        "guided": guided_on_gpu.compare_all(),
        "drawn": guided_on_gpu.compare_drawn(),
        "orders": guided_on_gpu.compare_orders(),
        "arrays": arrays_on_gpu.look_at_all(),
    }
    print(json.dumps({"missions": flown, **own}))

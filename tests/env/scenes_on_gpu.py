"""Scenes that change on numba's simulated GPU, and the same in a batch: see `simulated_gpu`."""

import numpy as np
from beside_batches import N_LANES, SEED, briefs_of, compare, different
from changing_missions import AGAIN, EVERYTHING, STEPS, mission

from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.gpu.missions import CudaMissions

ASKED = np.full((2, 3), 0.2)


def go_on_elsewhere():
    """Copy missions in which scenes have changed, and go on beside them: on a GPU, in a batch."""
    missions, other = (CudaMissions(N_LANES, EVERYTHING) for _ in range(2))
    batch = CoverageBatch(N_LANES, EVERYTHING)
    flown = (missions, other, batch)
    for each, seed in zip(flown, (SEED, SEED + 9, SEED + 99), strict=True):
        each.reset(seed=seed)
    for _ in range(9):
        missions.step(np.array([ASKED] * N_LANES))
    kept = missions.state_dict()
    wrong = {**kept, "changes": kept["changes"] + 1}
    try:
        other.load_state_dict(wrong)
    except ValueError as error:
        refused = str(error)
    other.load_state_dict(kept)
    batch.load_state_dict(kept)
    not_equal = set()
    for k in range(STEPS):
        if k == 3:
            other.load_state_dict(batch.state_dict())
        for each in flown:
            each.step(np.array([ASKED] * N_LANES))
        arrays = [each.state_dict() for each in flown]
        briefs = [briefs_of(each) for each in flown]
        not_equal |= different(*arrays[:2]) | different(*arrays[1:])
        not_equal |= {"scenario_of"} if briefs[1:] != briefs[:2] else set()
    n_changes = (kept["changes"] >= 0).sum(axis=1).tolist()
    return {"different": sorted(not_equal), "changes": n_changes, "refused": refused}


def compare_all():
    """All kinds of events at once, and waypoints that are asked for again."""
    again = mission(relaunch=True, **AGAIN)
    return {
        "all": compare(EVERYTHING, ASKED, STEPS + 8),
        "again": compare(again, np.zeros((2, 4)), STEPS + 8, action="wrench"),
        "checkpoint": go_on_elsewhere(),
    }

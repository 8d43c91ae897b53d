"""Missions on a GPU, or its simulator, beside a batch of the same seeds."""

from inspect import getclosurevars

import numpy as np

from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.gpu.missions import CudaMissions
from uas_coverage_env.env.report import CONTACT, RETURNING
from uas_coverage_env.mission import MissionBrief

SEED, N_LANES = 7, 2


def different(one, other):
    """Names of the arrays of two checkpoints that differ in a bit, or are in one of them only."""
    both = one.keys() & other.keys()
    return (one.keys() ^ other.keys()) | {
        name for name in both if one[name].tobytes() != other[name].tobytes()
    }


def briefs_of(flown):
    """What planners would know of all lanes."""
    return [MissionBrief.of(flown.scenario_of(lane)) for lane in range(N_LANES)]


def backwards(launch):
    """A launch whose threads run one after the other, the last one first."""
    part = getclosurevars(launch.kernel.fn).nonlocals["part"]

    def threads(numbers, blocks):
        for thread in reversed(range(blocks[0] * blocks[1])):
            part(numbers, thread)

    class Backwards:
        def __getitem__(self, blocks):
            return lambda numbers: threads(numbers, blocks)

    return launch._replace(kernel=Backwards())


def compare(scenario, asked, n_steps, last_first=False, **settings):
    """Fly both ways past the end of missions; lanes have seeds of their own.

    Args:
        scenario: The mission.
        asked: (U, size) the actions of every step; or those of all lanes, by its number.
        n_steps: How many.
        last_first: In which order threads of the GPU run.
        **settings: Of both.
    """
    missions = CudaMissions(N_LANES, scenario, **settings)
    batch = CoverageBatch(N_LANES, scenario, **settings)
    if last_first:
        missions.launches = tuple(map(backwards, missions.launches))
    missions.reset(seed=SEED)
    batch.reset(SEED)
    not_equal = different(missions.state_dict(), batch.state_dict())
    seen, changes, returned, scenarios = [], set(), False, []
    for k in range(n_steps):
        actions = asked(k) if callable(asked) else np.array([asked] * N_LANES)
        missions.step(actions)
        batch.step(actions)
        here, there = batch.state_dict(), missions.state_dict()
        not_equal |= different(here, there)
        not_equal |= set() if briefs_of(missions) == briefs_of(batch) else {"scenario_of"}
        changes |= set(there.get("changes", np.zeros(0)).ravel().tolist()) - {-1}
        report = np.array(missions.report)
        contacts = set(report[:, :, CONTACT].ravel().tolist())
        seen.append((set(there["uas.status"].ravel().tolist()), contacts))
        returned |= bool(report[:, :, RETURNING].any())
        scenarios.append(there["scenario"].tolist())
    return {
        "different": sorted(not_equal),
        "restarts": int(there["mission"].sum()),
        "statuses": sorted(set.union(*(statuses for statuses, _ in seen))),
        "contacts": sorted(set.union(*(contacts for _, contacts in seen))),
        "changes": sorted(changes),
        "apart": bool((there["x"][0] != there["x"][1]).any()),
        "x": there["x"][1].tolist(),
        "acted": int(missions.acted.sum()),
        "returned": returned,
        "scenarios": scenarios,
        "observation": there["observation"].shape[-1],
        # of which UAS guidance has written into the room
        "guided": missions.rooms.path_m.any(axis=(1, 2)).tolist(),
    }

"""Missions on a GPU, or its simulator, beside episodes of the same seeds."""

import numpy as np

from uas_coverage_env.env.episode.episode import Episode
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.gpu.missions import CudaMissions
from uas_coverage_env.env.report import REWARD
from uas_coverage_env.mission import MissionBrief

SEED, N_LANES = 7, 2


def compare(scenario, asked, n_steps, **settings):
    """Fly both ways past the end of missions; lanes have seeds of their own.

    Args:
        scenario: The mission.
        asked: (U, size) the actions of every step.
        n_steps: How many.
        **settings: Of both.
    """
    missions = CudaMissions(N_LANES, scenario, seed=SEED, **settings)
    episodes = [Episode(scenario, MissionSettings.of(settings)) for _ in range(N_LANES)]
    flown = [0] * N_LANES
    for lane, episode in enumerate(episodes):
        episode.reset(SEED + lane)
    ended = [False] * N_LANES
    different, changes = 0, set()
    seen = missions.missions
    for _ in range(n_steps):
        missions.step(np.array([asked] * N_LANES))
        for lane, episode in enumerate(episodes):
            rewards = np.zeros(len(asked))
            if ended[lane]:
                flown[lane] += 1
                episode.reset(SEED + lane, flown[lane])
            else:
                episode.asked[:] = asked
                episode.step()
                rewards = np.array(episode.amounts)[:, REWARD]
            ended[lane] = bool(seen.ended[lane])
            swarm = episode.swarm_state()
            observed = seen.first_observations.observation[lane]
            uncovered = seen.worlds.uncovered[lane, : len(swarm.uncovered)]
            different += int((observed != episode.observation).sum())
            different += int((seen.worlds.x[lane, :, :3] != episode.positions_m).sum())
            different += int((seen.worlds.uas["status"][lane] != swarm.status).sum())
            different += int((uncovered != swarm.uncovered).sum())
            different += int((seen.rewards[lane] != rewards).sum())
            brief = MissionBrief.of(missions.scenario_of(lane))
            different += int(brief != MissionBrief.of(episode.scenario))
        changes |= set(seen.changes.ravel().tolist()) - {-1}
    return {
        "different": different,
        "restarts": sum(flown),
        "apart": bool((seen.worlds.x[0] != seen.worlds.x[1]).any()),
        "changes": sorted(changes),
    }

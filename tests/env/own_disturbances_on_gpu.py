"""Own disturbances on numba's simulated GPU, and the same as episodes: see `simulated_gpu`."""

import numpy as np
from own_actions import CLIMB_RATE
from own_disturbances import deviating, drained, gusts, push, weak_rotors
from practice_grounds import practice_ground

from uas_coverage_env.disturbances import disturbances_of
from uas_coverage_env.env.cuda import CudaMissions
from uas_coverage_env.env.episode import Episode
from uas_coverage_env.env.settings import MissionSettings
from uas_coverage_env.scenario import with_disturbances

SEED, N_LANES, N_STEPS = 7, 2, 11
GROUND = practice_ground(n_uas=2, max_steps=5)
EVENTS = (
    {"kind": "uas_lost", "rate_per_h": 600.0},
    {"kind": "radio_lost", "rate_per_h": 1200.0, "for_s": 2.0, "then": "go_on"},
    {"kind": "gnss_lost", "at_s": 2.0, "for_s": 2.0, "drift_mps": 1.0},
    {"kind": "late_start", "at_s": 2.0, "uas": "uas_2"},
    {"kind": "motor_degraded", "at_s": 3.0, "thrust_share": 0.9, "power_factor": 1.3},
)
EVENTFUL = GROUND.model_copy(
    update={"events": EVENTS, "sensing": {"position_noise_m": 0.5, "delay_steps": 1}}
)
OWN = (
    *disturbances_of(with_disturbances(GROUND, "moderate", 1)),
    gusts(),
    push(0.2, 0.0, 0.0),
    weak_rotors(0.05),
    deviating(mass=0.05, drag=0.2, power=0.1),
    drained(0.01),
    *disturbances_of(EVENTFUL),  # its motor
)


def compare(**settings):
    """Fly both ways past the end of missions; lanes have seeds of their own."""
    settings = {"disturbances": OWN, **settings}
    missions = CudaMissions(N_LANES, EVENTFUL, seed=SEED, **settings)
    episodes = [Episode(EVENTFUL, MissionSettings(**settings)) for _ in range(N_LANES)]
    flown = [0] * N_LANES
    for lane, episode in enumerate(episodes):
        episode.reset(SEED + lane)
    ended = [False] * N_LANES
    different = 0
    asked = np.full((2, 3), 0.2)
    seen = missions.missions
    for _ in range(N_STEPS):
        missions.step(np.array([asked] * N_LANES))
        for lane, episode in enumerate(episodes):
            if ended[lane]:
                flown[lane] += 1
                episode.reset(SEED + lane, flown[lane])
            else:
                episode.asked[:] = asked
                episode.step()
            ended[lane] = bool(seen.ended[lane])
            observed = seen.first_observations.observation[lane]
            different += int((observed != episode.observation).sum())
            different += int((seen.worlds.x[lane, :, :3] != episode.positions_m).sum())
    return {
        "different": different,
        "restarts": sum(flown),
        "apart": bool((seen.worlds.x[0] != seen.worlds.x[1]).any()),
    }


def compare_all():
    """In both plants; with one tuple of disturbances, which is compiled into the step."""
    return [compare(), compare(dynamics="nonlinear", action=CLIMB_RATE)]

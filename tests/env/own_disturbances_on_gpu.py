"""Own disturbances on numba's simulated GPU, and the same in a batch: see `simulated_gpu`."""

import numpy as np
from beside_batches import compare
from own_actions import CLIMB_RATE
from own_disturbances import drained, gusts, perturbed, push, weak_rotors
from practice_grounds import practice_ground

from uas_coverage_env.features import disturbances_of
from uas_coverage_env.scenario import with_disturbances

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
    perturbed(mass=0.05, drag=0.2, power=0.1),
    drained(0.01),
)
MOTOR = disturbances_of(EVENTFUL)
ASKED = np.full((2, 3), 0.2)


def compare_all():
    """In both plants, beside events and without; their kernels are compiled into the step."""
    return [
        compare(EVENTFUL, ASKED, 11, disturbances=(*OWN, *MOTOR)),
        compare(GROUND, ASKED, 11, disturbances=OWN, dynamics="nonlinear", action=CLIMB_RATE),
    ]

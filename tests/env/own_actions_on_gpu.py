"""Own kinds of action on numba's simulated GPU, and the same in a batch: `simulated_gpu`."""

import numpy as np
from beside_batches import N_LANES, compare
from own_actions import CLIMB_RATE, faulty
from practice_grounds import practice_ground

from uas_coverage_env.autopilot import write_command
from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.entities.commands import CLIMB
from uas_coverage_env.env import ActionKind
from uas_coverage_env.env.gpu.missions import CudaMissions

GROUND = practice_ground(n_uas=2, max_steps=6)


@kernel
def _write_choice(arena, state, tables, learners, i, parameters, values, command):
    write_command(command, CLIMB, values[0], 0.0, -1.0)


CHOICES = ActionKind(name="choices", meaning="North, so fast.", write=_write_choice, choices=3)


def refused_of(kind, asked):
    """What is said of actions that lie on the GPU, and whether a UAS has moved."""
    missions = CudaMissions(N_LANES, GROUND, action=kind)
    missions.reset(seed=1)
    before = missions.missions.worlds.x.copy()
    missions.asked[:] = asked
    missions.step()
    moved = (missions.missions.worlds.x != before).any(axis=(1, 2))
    return {"refused": missions.refused.tolist(), "moved": moved.tolist()}


def compare_all():
    """Fly both ways, and what cannot be flown."""
    rng = np.random.default_rng(0)
    return {
        "numbers": compare(
            GROUND, lambda k: rng.uniform(-1, 1, (N_LANES, 2, 3)), 8, action=CLIMB_RATE
        ),
        "choices": compare(GROUND, lambda k: rng.integers(0, 3, (N_LANES, 2)), 8, action=CHOICES),
        "not finite": refused_of(CLIMB_RATE, [[0.0] * 5 + [np.nan], [0.1] * 6]),
        "no choice": refused_of(CHOICES, [[0.0, 3.0], [1.0, 2.0]]),
        "half a choice": refused_of(CHOICES, [[0.0, 1.0], [0.5, 2.0]]),
        "not flyable": refused_of(faulty(0), [[0.0, 0.9], [0.3, 0.0]]),
    }

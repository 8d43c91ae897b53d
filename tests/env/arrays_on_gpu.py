"""The arrays of `vector_env(device="cuda")` on numba's simulated GPU: see `simulated_gpu`."""

import numpy as np
import torch
from gymnasium.error import ResetNeeded
from practice_grounds import practice_ground

from uas_coverage_env import uas_coverage_v0
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.gpu import missions as missions_on_gpu

GROUND = practice_ground(n_uas=2, tower=True, n_moving=1, max_steps=4)
N = 3
READ = (
    "observation", "reward", "rewards", "terminated", "truncated", "ended", "report", "refused",
    "acted", "asked",
)  # fmt: skip


def error_of(call):
    """What is said of a call."""
    try:
        call()
    except (ResetNeeded, ValueError) as error:
        return str(error)
    return ""


def read_in_place():
    """Tensors made before the first mission, beside what `vector_env` returns on the processor."""
    env = uas_coverage_v0.vector_env(N, GROUND, device="cuda")
    beside = uas_coverage_v0.vector_env(N, GROUND)
    seen = {name: torch.as_tensor(getattr(env, name)) for name in READ}
    shapes = {name: [*tensor.shape] for name, tensor in seen.items()}
    rng, equal = np.random.default_rng(1), True
    for k in range(7):
        if k % 6 == 0:
            env.reset(seed=k)
            observation, _ = beside.reset(seed=k)
            returned = [observation]
        else:
            actions = rng.uniform(-1, 1, env.action_space.shape)
            seen["asked"][:] = torch.from_numpy(actions)
            env.step()
            returned = beside.step(actions)[:-1]
        names = ("observation", "reward", "terminated", "truncated")
        equal &= all(
            bool((seen[name].numpy() == array).all())
            for name, array in zip(names, returned, strict=False)
        )
        ended = seen["terminated"] | seen["truncated"]
        equal &= bool((seen["ended"] == ended).all())
        equal &= seen["observation"].numpy() in env.observation_space
        equal &= bool((seen["rewards"].sum(1) - seen["reward"]).abs().max() < 1e-12)
    spaces = ("observation_space", "action_space")
    both = [*spaces, *(f"single_{name}" for name in spaces)]
    return {
        "equal": bool(equal),
        "spaces": all(getattr(env, name) == getattr(beside, name) for name in both),
        "shapes": shapes,
    }


def seeded():
    """Seeds and numbers of missions, of resets in turn."""
    env = missions_on_gpu.CudaMissions(2, GROUND)
    batch = CoverageBatch(2, GROUND)
    found = []
    for seed in (5, None, [None, 8], [2**64 - 1, 0]):
        env.reset(seed=seed)
        batch.reset(seed)
        lanes, own = batch.lanes, env.missions.lanes
        equal = (own.seed == lanes.seed).all() and (own.mission == lanes.mission).all()
        found.append([[*map(int, own.seed)], [*map(int, own.mission)], bool(equal)])
    return found


def taken_on_the_device():
    """Single precision that lies on the GPU, and the same from the host."""
    there, here = (missions_on_gpu.CudaMissions(2, GROUND) for _ in range(2))
    for each in (there, here):
        each.reset(seed=1)
    actions = np.random.default_rng(2).uniform(-1, 1, (2, 6)).astype(np.float32)
    here.step(actions)
    kept = missions_on_gpu.is_on_device, missions_on_gpu.as_device_array
    missions_on_gpu.is_on_device, missions_on_gpu.as_device_array = (
        lambda given: True,
        lambda given: given,
    )
    there.step(actions)
    refused = error_of(lambda: there.step(actions[:1]))
    missions_on_gpu.is_on_device, missions_on_gpu.as_device_array = kept
    return {"equal": bool((there.observation == here.observation).all()), "refused": refused}


def look_at_all():
    """How they look, and what is refused."""
    env = missions_on_gpu.CudaMissions(2, GROUND)
    refused = {"step": error_of(lambda: env.step(np.zeros((2, 6))))}
    env.reset()
    refused |= {
        "shape": error_of(lambda: env.step(np.zeros((2, 7)))),
        "letters": error_of(lambda: env.step(np.full((2, 6), "a"))),
        "seed": error_of(lambda: env.reset(seed=-1)),
        "seeds": error_of(lambda: env.reset(seed=[1])),
    }
    return {
        "in place": read_in_place(),
        "seeded": seeded(),
        "taken": taken_on_the_device(),
        "refused": refused,
    }

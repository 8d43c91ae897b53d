"""Policies small enough to write down, and what they are made of."""

import numpy as np
from uas_coverage_agents.policy import PolicyDescription, save_policy
from uas_coverage_agents.policy.description import Observation, ScenarioFamily, Training
from uas_coverage_agents.policy.mlp import Mlp

from uas_coverage_env.env.observation import OBSERVATION
from uas_coverage_env.env.observation.scales import SCALES


def describe(**changes) -> PolicyDescription:
    """A policy with one layer of eight."""
    view = Observation.of("uas_coverage_v0", OBSERVATION, SCALES)
    fields = {
        "interface": "route-velocity",
        "network": Mlp(inputs=view.size, hidden=(8,), outputs=3, activation="tanh"),
        "observation": view,
        "scenarios": ScenarioFamily(name="village"),
        "training": Training(
            algorithm="none", settings={"gamma": 0.9}, seed=0, steps=0,
            process_s=0.0, wall_s=0.0, machine="this",
        ),
        "versions": {"numpy": np.__version__},
    }  # fmt: skip
    return PolicyDescription(**(fields | changes))


def weights(description: PolicyDescription, seed: int = 0) -> dict[str, np.ndarray]:
    """Small weights drawn from a seed."""
    rng = np.random.default_rng(seed)
    shapes = description.network.shapes()
    return {name: rng.normal(size=shape).astype(np.float32) / 9 for name, shape in shapes.items()}


def write(directory, seed: int = 0) -> PolicyDescription:
    """Write a policy and say what it is."""
    description = describe()
    save_policy(directory, description, weights(description, seed))
    return description

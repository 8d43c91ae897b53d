"""The names under which Gymnasium and PettingZoo find the environments."""

import gymnasium
import pettingzoo

GYMNASIUM_ID = "UASCoverage-v0"
PETTINGZOO_ID = "uas/coverage-v0"

_DOOR = "uas_coverage_env.uas_coverage_v0"


def register_environments() -> None:
    """Register the environments; once registered, nothing is done again.

    `gymnasium.make("UASCoverage-v0")`, `pettingzoo.make("parallel", "uas/coverage-v0")` and
    `pettingzoo.make("aec", "uas/coverage-v0")` find them then. PettingZoo has a registry from 1.27
    on; before that, `uas_coverage_v0` is the only door.
    """
    if GYMNASIUM_ID not in gymnasium.registry:
        gymnasium.register(
            GYMNASIUM_ID,
            entry_point="uas_coverage_env.env:CoverageSwarmEnv",
            vector_entry_point="uas_coverage_env.env:CoverageVectorEnv",
        )
    if hasattr(pettingzoo, "register"):
        if PETTINGZOO_ID not in pettingzoo.parallel_registry:
            pettingzoo.register("parallel", PETTINGZOO_ID, f"{_DOOR}:parallel_env")
        if PETTINGZOO_ID not in pettingzoo.aec_registry:
            pettingzoo.register("aec", PETTINGZOO_ID, f"{_DOOR}:env")

"""The names under which Gymnasium and PettingZoo find the environments."""

import re

import gymnasium
import pettingzoo

GYMNASIUM_ID = "UASCoverage-v0"
PETTINGZOO_ID = "uas/coverage-v0"
LEVEL_NAMES = ("easy", "medium", "hard", "extreme")
"""Those of `tasks.LEVELS`, which is not imported here: a test compares them."""

VERSIONS = (0,)
"""Of the environments that there are, each in a module `uas_coverage_vN`."""

_DOOR = "uas_coverage_env.uas_coverage_v0"
_TASKS = "uas_coverage_env.tasks"


def register_environments() -> None:
    """Register the environments; once registered, nothing is done again.

    `gymnasium.make("UASCoverage-v0")`, `pettingzoo.make("parallel", "uas/coverage-v0")` and
    `pettingzoo.make("aec", "uas/coverage-v0")` find them then; and the levels as
    `gymnasium.make("UASCoverage/Easy-v0")`, `pettingzoo.make("parallel", "uas/coverage-easy-v0")`.
    PettingZoo has a registry from 1.27 on; before that, `uas_coverage_v0` is the only door.
    """
    if GYMNASIUM_ID not in gymnasium.registry:
        gymnasium.register(
            GYMNASIUM_ID,
            entry_point="uas_coverage_env.env:CoverageSwarmEnv",
            vector_entry_point="uas_coverage_env.env:CoverageVectorEnv",
        )
    for level in LEVEL_NAMES:
        name = f"UASCoverage/{level.capitalize()}-v0"
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point=f"{_TASKS}:swarm_env",
                vector_entry_point=f"{_TASKS}:vector_env",
                kwargs={"level": level},
            )
    if hasattr(pettingzoo, "register"):
        if PETTINGZOO_ID not in pettingzoo.parallel_registry:
            pettingzoo.register("parallel", PETTINGZOO_ID, f"{_DOOR}:parallel_env")
        if PETTINGZOO_ID not in pettingzoo.aec_registry:
            pettingzoo.register("aec", PETTINGZOO_ID, f"{_DOOR}:env")
        for level in LEVEL_NAMES:
            name = f"uas/coverage-{level}-v0"
            if name not in pettingzoo.parallel_registry:
                kwargs = {"level": level}
                pettingzoo.register("parallel", name, f"{_TASKS}:parallel_env", kwargs=kwargs)


def successor_of(name: str) -> str | None:
    """The module of environments that has followed one which is gone; None: it is none of those.

    Gymnasium and PettingZoo say the same of the ids in their registries.
    """
    number = re.fullmatch(r"uas_coverage_v(\d+)", name)
    if number is None or int(number[1]) >= min(VERSIONS):
        return None
    return f"uas_coverage_v{min(VERSIONS)}"

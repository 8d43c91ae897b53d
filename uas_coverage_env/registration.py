"""The names under which Gymnasium and PettingZoo find the environments."""

import re
from functools import cache
from pathlib import Path
from typing import Any

import gymnasium
import pettingzoo

_MODULE = re.compile(r"uas_coverage_(v(\d+))")
"""Of a version of the environments; its version is `VERSION` there."""

LEVEL_NAMES = ("easy", "medium", "hard", "extreme", "air-taxi", "indoor")
"""Those of `tasks.LEVELS`, which is not imported here: a test compares them."""

_TASKS = "uas_coverage_env.tasks.make"


def register_environments() -> None:
    """Register the environments; once registered, nothing is done again.

    `gymnasium.make("UASCoverage-v0")`, `pettingzoo.make("parallel", "uas/coverage-v0")` and
    `pettingzoo.make("aec", "uas/coverage-v0")` find them then; and the levels as
    `gymnasium.make("UASCoverage/Easy-v0")`, `pettingzoo.make("parallel", "uas/coverage-easy-v0")`.
    PettingZoo has a registry from 1.27 on; before that, modules such as `uas_coverage_v0` are the
    only way to its environments.
    """
    for version in version_names():
        module = f"uas_coverage_env.uas_coverage_{version}"
        _register_gymnasium(f"UASCoverage-{version}", module)
        _register_pettingzoo("parallel", f"uas/coverage-{version}", f"{module}:parallel_env")
        _register_pettingzoo("aec", f"uas/coverage-{version}", f"{module}:env")
        for level in LEVEL_NAMES:
            of = level if version == "v0" else f"{level}-{version}"
            _register_gymnasium(level_id(level, version), _TASKS, level=of)
            name, found = f"uas/coverage-{level}-{version}", f"{_TASKS}:parallel_env"
            _register_pettingzoo("parallel", name, found, level=of)


def level_id(level: str, version: str) -> str:
    """Under which Gymnasium knows a level: `air-taxi` as `UASCoverage/AirTaxi-v0`."""
    return f"UASCoverage/{''.join(word.capitalize() for word in level.split('-'))}-{version}"


def _register_gymnasium(name: str, module: str, **kwargs: str) -> None:
    if name not in gymnasium.registry:
        gymnasium.register(
            name,
            entry_point=f"{module}:swarm_env",
            vector_entry_point=f"{module}:vector_env",
            kwargs=kwargs,
        )


def _register_pettingzoo(kind: str, name: str, entry_point: str, **kwargs: str) -> None:
    library: Any = pettingzoo
    if hasattr(library, "register") and name not in getattr(library, f"{kind}_registry"):
        library.register(kind, name, entry_point, kwargs=kwargs)


@cache
def version_names() -> tuple[str, ...]:
    """The versions of the environments that there are, oldest first: those with a module."""
    found = [_MODULE.fullmatch(path.stem) for path in Path(__file__).parent.glob("*.py")]
    return tuple(each[1] for each in sorted(filter(None, found), key=lambda each: int(each[2])))


def successor_of(name: str) -> str | None:
    """The module of environments that has followed one which is gone; None: it is none of those.

    Gymnasium says the same of ids.
    """
    asked, oldest = _MODULE.fullmatch(name), version_names()[0]
    if asked is None or int(asked[2]) >= int(oldest[1:]):
        return None
    return f"uas_coverage_{oldest}"

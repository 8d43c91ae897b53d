"""Scenarios by name or from a file."""

from pathlib import Path

from uas_coverage_env.files.strict_toml import InputError, read_toml
from uas_coverage_env.scenario.model import Scenario

_SHIPPED = Path(__file__).parent


def scenario_names() -> tuple[str, ...]:
    """The names of the shipped scenarios."""
    return tuple(sorted(path.stem for path in _SHIPPED.glob("*.toml")))


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Read a scenario and check it.

    Args:
        name_or_path: The name of a shipped scenario, or the path of a TOML file in the same
            format; a string is a path where it ends in `.toml` or contains a folder.

    Raises:
        InputError: There is no such scenario, or something in it is wrong: one line that names
            file, field, value and fix.
    """
    if isinstance(name_or_path, str) and name_or_path in scenario_names():
        path = _SHIPPED / f"{name_or_path}.toml"
    elif is_path(name_or_path):
        path = Path(name_or_path)
    else:
        raise InputError(
            f"unknown scenario {str(name_or_path)[:80]!r}; "
            f"take {', '.join(scenario_names())} or the path of a .toml file"
        )
    return read_toml(path, Scenario, context={"folder": path.parent})


def is_path(name_or_path: str | Path) -> bool:
    """Whether a scenario is named by its file."""
    if isinstance(name_or_path, Path):
        return True
    path = Path(name_or_path) if isinstance(name_or_path, str) else Path()
    return path.suffix == ".toml" or len(path.parts) > 1

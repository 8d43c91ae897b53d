"""Scenarios by name or from a file."""

from pathlib import Path

from uas_coverage_env.files.strict_toml import InputError, read_json, read_toml
from uas_coverage_env.files.suggestions import did_you_mean
from uas_coverage_env.scenario.families import installed_families
from uas_coverage_env.scenario.model import Scenario

_SHIPPED = Path(__file__).parent
_DRAWN = (".geojson", ".kml", ".kmz", ".plan", ".shp")
"""Files of areas, which `uas-coverage import` reads."""

_LONGEST_SEED = 18  # digits, as in a sweep


def scenario_names() -> tuple[str, ...]:
    """The names of the shipped scenarios."""
    return tuple(sorted(path.stem for path in _SHIPPED.glob("*.toml")))


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Read a scenario and check it.

    Args:
        name_or_path: The name of a shipped scenario, the name and the seed of a generated one as
            in `town:7` or `streets:seed=7` (see `installed_families`), or the path of a file in
            the same format, TOML or, where it ends in `.json`, the `scenario.json` of a flight; a
            string is a path where it ends in `.toml` or `.json` or contains a folder.

    Raises:
        InputError: There is no such scenario, or something in it is wrong: one line that names
            file, field, value and fix.
    """
    given = Path(name_or_path) if isinstance(name_or_path, str | Path) else Path()
    if given.suffix.lower() in _DRAWN:
        raise InputError(
            f"{given}: is a drawn area; make a scenario of it: uas-coverage import {given} "
            f"--out {given.with_suffix('.toml').name}"
        )
    if isinstance(name_or_path, str) and name_or_path in scenario_names():
        path = _SHIPPED / f"{name_or_path}.toml"
    elif is_path(name_or_path):
        path = Path(name_or_path)
    else:
        return _generated(str(name_or_path))
    read = read_json if path.suffix.lower() == ".json" else read_toml
    return read(path, Scenario, context={"folder": path.parent})


def _generated(text: str) -> Scenario:
    """FAMILY:SEED."""
    name, colon, seed = text.partition(":")
    seed, families = seed.removeprefix("seed="), installed_families()
    if not colon or name not in families:
        end = seed[:18] or "SEED"
        known = (*scenario_names(), *(f"{family}:{end}" for family in families))
        otherwise = f"take {', '.join(known)} or the path of a .toml file"
        raise InputError(f"unknown scenario {text[:80]!r}; {did_you_mean(text, known, otherwise)}")
    if not (seed.isdecimal() and len(seed) <= _LONGEST_SEED):
        raise InputError(
            f"scenario {text[:80]!r}: should be {name}:SEED with one whole number of at most "
            f"{_LONGEST_SEED} digits, as in {name}:7"
        )
    return families[name].of_seed(int(seed))


def is_path(name_or_path: str | Path) -> bool:
    """Whether a scenario is named by its file."""
    if isinstance(name_or_path, Path):
        return True
    path = Path(name_or_path) if isinstance(name_or_path, str) else Path()
    return path.suffix in (".toml", ".json") or len(path.parts) > 1

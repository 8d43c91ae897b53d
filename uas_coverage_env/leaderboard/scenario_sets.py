"""The scenarios that planners are compared on: sets by name, shipped scenarios, files, seeds."""

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.files.suggestions import meant
from uas_coverage_env.leaderboard.hashing import content_hash
from uas_coverage_env.scenario import Scenario, load_scenario, scenario_names
from uas_coverage_env.scenario.families import installed_families
from uas_coverage_env.scenario.load import is_path

# `dev` is there to look at while one tunes; nothing is ever tuned or trained on `test`
SETS: Mapping[str, range] = {"dev": range(2000, 2020), "test": range(3000, 3020)}
_MOST_SEEDS = 10_000
# digits that a column of a store can hold
_LONGEST_SEED = 18


def scenarios_of(texts: Iterable[str]) -> dict[str, Scenario]:
    """The scenarios that a person asks for, by name; what is asked for twice comes once.

    Args:
        texts: Each one or several (comma or space between them) of: the name of a set, the name of
            a shipped scenario, the path of a scenario file, FAMILY:SEED, FAMILY:FIRST:END
            (see `installed_families`).

    Raises:
        InputError: There are none, one of them cannot be read, or two that differ share a name.
    """
    found: dict[str, Scenario] = {}
    for scenario in (scenario for item in _items(texts) for scenario in _scenarios(item)):
        other = found.setdefault(scenario.name, scenario)
        if scenario_hash(other) != scenario_hash(scenario):
            raise InputError(
                f"--scenarios: two different ones are named {scenario.name!r}; rename one of them"
            )
    if not found:
        raise InputError(f"--scenarios: names none; give some, as in village,{next(iter(SETS))}")
    return found


def scenario_hash(scenario: Scenario) -> str:
    """What the scenario is, its vehicles included, whatever files it came from."""
    return content_hash(scenario.content())


def seed_range(option: str, text: str) -> range:
    """FIRST:END as a range; END is not part of it.

    Raises:
        InputError: It is not that, or empty, or of more seeds than anybody flies.
    """
    first, separator, end = text.partition(":")
    numbers = all(part.isdecimal() and len(part) <= _LONGEST_SEED for part in (first, end))
    if not (separator and numbers and int(first) < int(end)):
        raise InputError(
            f"{option} {text[:80]!r}: should be FIRST:END with FIRST < END, as in 0:20, "
            f"of at most {_LONGEST_SEED} digits"
        )
    seeds = range(int(first), int(end))
    if len(seeds) > _MOST_SEEDS:
        raise InputError(f"{option} {text!r}: are {len(seeds)} seeds; give at most {_MOST_SEEDS}")
    return seeds


def _items(texts: Iterable[str]) -> Iterator[str]:
    for text in texts:
        if _is_file(text):  # its path may hold a space
            yield text
        else:
            yield from filter(None, re.split(r"[,\s]+", text))


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except OSError:  # a list of many is too long for a name
        return False


def _scenarios(item: str) -> Iterator[Scenario]:
    kind, _, rest = item.partition(":")
    families = installed_families()
    if item in SETS:
        yield from map(families["generated"].of_seed, SETS[item])
    elif ":" in rest and kind in families:
        yield from map(families[kind].of_seed, seed_range(f"--scenarios {kind}:", rest))
    elif not (is_path(item) or item in scenario_names()) and (close := meant(item, SETS)):
        raise InputError(f"unknown scenario or set {item!r}; did you mean {close}?")
    else:
        yield load_scenario(item)

"""Which tests stay together where several processes run the suite (`-n 2`), and which come first.

Tests of a folder need the same kernels and fixtures: one process compiles and makes them, instead
of each. What takes longest comes first, so that all processes end at about the same time. How much
processor time each takes is written by `python -m pytest -n 2 --write-seconds`.
"""

import json
from collections import Counter
from pathlib import Path

SECONDS_FILE = Path(__file__).with_name("scope_seconds.json")
SECONDS: dict[str, float] = json.loads(SECONDS_FILE.read_text(encoding="utf-8"))
"""What stays together -> how long it takes; what is not listed is taken for short."""

FIRST = ("missions/test_evasion.py", "test_house.py", "docs")
"""One process compiles what most others need, meanwhile the next one works without kernels: `docs`
begins with building the site."""

APART = (
    "docs/test_documented_commands.py",
    "docs/test_notebooks.py",
    "cli/test_warm_up.py",
    "leaderboard/test_compare_command.py",
)
"""Files whose tests have nothing in common, and use all planners or several processes: each goes
where there is time for it, after all others, which have compiled the kernels by then."""

BY_FILE = ("baselines", "leaderboard", "milp_mpc", "missions")
"""Folders whose files have nothing in common but kernels, which other folders need as well."""


def scope_of(nodeid: str) -> str:
    """What a test stays together with."""
    path = _path(nodeid)
    if path in APART:
        return nodeid.removeprefix("tests/")
    folder, slash, _ = path.partition("/")
    return folder if slash and folder not in BY_FILE else path


def _path(nodeid: str) -> str:
    return nodeid.partition("::")[0].removeprefix("tests/")


def rank_of(nodeid: str) -> tuple[int, float, str]:
    """Where a test stands in the order of the whole suite."""
    scope = scope_of(nodeid)
    group = FIRST.index(scope) if scope in FIRST else len(FIRST) + (_path(nodeid) in APART)
    return group, -SECONDS.get(scope, 0.0), scope


def write_seconds(of_tests: dict[str, float], file: Path = SECONDS_FILE) -> None:
    """Write how long each scope took, the longest first.

    Args:
        of_tests: Node id -> seconds.
        file: Where to.
    """
    total = Counter[str]()
    for nodeid, seconds in of_tests.items():
        total[scope_of(nodeid)] += seconds
    whole = {scope: round(seconds) for scope, seconds in total.most_common() if seconds >= 0.5}
    file.write_text(json.dumps(whole, indent=2) + "\n", encoding="utf-8")

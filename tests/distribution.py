"""Which tests stay together where several processes run the suite (`-n 2`), and which come first.

Tests of a folder need the same kernels and fixtures: one process compiles and makes them, instead
of each. What takes longest comes first, so that all processes end at about the same time.
"""

LONGEST_FIRST = (
    "agents", "missions", "docs", "env", "test_house.py", "milp_mpc", "baselines", "compiled",
    "cli",
)  # fmt: skip
"""Folders, and files beside them, by processor time; others follow in the order of their names."""

APART = ("docs/test_documented_commands.py", "docs/test_notebooks.py")
"""Files whose tests have nothing in common and are long: each goes where there is time for it."""


def scope_of(nodeid):
    """What a test stays together with."""
    path = nodeid.partition("::")[0].removeprefix("tests/")
    if path in APART:
        return nodeid
    folder, slash, _ = path.partition("/")
    return folder if slash else path


def rank_of(nodeid):
    """Where a test stands in the order of the whole suite."""
    top = nodeid.partition("::")[0].removeprefix("tests/").partition("/")[0]
    first = LONGEST_FIRST.index(top) if top in LONGEST_FIRST else len(LONGEST_FIRST)
    return first, scope_of(nodeid)

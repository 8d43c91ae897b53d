"""What the suite says of itself: its quick part, and how it is shared between processes."""

import ast
import json
import re
from pathlib import Path

from distribution import APART, BY_FILE, FIRST, SECONDS, rank_of, scope_of, write_seconds
from quick_files import QUICK, is_quick

TESTS = Path(__file__).parent
ROOT = TESTS.parent


def test_what_is_listed_is_there():
    for name, choice in QUICK.items():
        text = (TESTS / name).read_text(encoding="utf-8")
        functions = set(re.findall(r"^def (test_\w+)", text, re.MULTILINE))
        assert choice.split()[:1] in ([], ["only"], ["but"])
        assert set(choice.split()[1:]) < functions, name


def test_some_tests_of_a_file_can_be_chosen_or_left_out():
    solvers, tour = "milp_mpc/test_solvers.py", "baselines/test_tour.py"
    chosen, left_out = QUICK[solvers].split()[1], QUICK[tour].split()[1]
    assert is_quick(solvers, chosen)
    assert not is_quick(solvers, "test_another")
    assert not is_quick(tour, left_out)
    assert is_quick(tour, "test_another")
    assert is_quick("paper/test_battery_figure.py", "test_any")
    assert not is_quick("agents/test_attention.py", "test_any")


def test_every_folder_of_tests_has_quick_ones():
    folders = {path.parent.name for path in TESTS.glob("*/test_*.py")}
    assert len(folders) > 15
    assert folders <= {name.partition("/")[0] for name in QUICK}


def test_every_package_is_imported_by_a_quick_test():
    """Whatever has an `__init__.py`, but what only training needs: it loads torch."""
    packages = {
        ".".join(path.parent.relative_to(root).parts)
        for root in (ROOT, ROOT / "baselines", ROOT / "agents")
        for top in root.glob("uas_coverage_*")
        for path in top.rglob("__init__.py")
    }
    imported = set()
    for name in QUICK:
        tree = ast.parse((TESTS / name).read_text(encoding="utf-8"))
        for statement in ast.walk(tree):
            if isinstance(statement, ast.ImportFrom) and statement.module:
                imported |= {statement.module}
                imported |= {f"{statement.module}.{alias.name}" for alias in statement.names}
            elif isinstance(statement, ast.Import):
                imported |= {alias.name for alias in statement.names}
    missing = {
        package
        for package in packages
        if not any(name == package or name.startswith(f"{package}.") for name in imported)
    }
    assert missing <= {"uas_coverage_agents.training"}


def test_tests_of_a_folder_stay_together_but_for_long_ones_that_share_nothing():
    assert all((TESTS / name).exists() for name in (*FIRST, *APART, *BY_FILE))
    one, other = "tests/env/test_batch.py::test_a[x::y]", "tests/env/test_actions.py::test_b"
    assert scope_of(one) == scope_of(other) == "env"
    assert scope_of("tests/test_house.py::test_c") == "test_house.py"
    page, next_page = (f"tests/{APART[0]}::test_d[{page}]" for page in "pq")
    assert scope_of(page) != scope_of(next_page)
    file, next_file = (f"tests/{BY_FILE[0]}/test_{name}.py::test_e" for name in "ab")
    assert scope_of(file) != scope_of(next_file)


def test_the_longest_come_first_but_for_what_is_apart():
    nodes = [f"tests/{s}" if ".py" in s else f"tests/{s}/test_x.py" for s in reversed(SECONDS)]
    assert [scope_of(node) for node in nodes] == list(reversed(SECONDS))
    nodes.append("tests/world/test_x.py::test_y")
    ranked = [scope_of(name) for name in sorted(nodes, key=rank_of)]
    assert ranked[: len(FIRST)] == list(FIRST)
    apart = [scope.startswith(APART) for scope in ranked]
    assert apart == sorted(apart), "what uses all kernels comes when they are compiled"
    for last in (False, True):
        timed = [scope for scope in ranked[len(FIRST) :] if scope in SECONDS]
        seconds = [SECONDS[scope] for scope in timed if scope.startswith(APART) is last]
        assert seconds == sorted(seconds, reverse=True)


def test_what_is_timed_exists():
    for scope in SECONDS:
        assert (TESTS / scope.partition("::")[0]).exists(), f"{scope}: write the seconds anew"


def test_seconds_are_added_up_and_read_again(tmp_path):
    file = tmp_path / "seconds.json"
    tests = {"tests/env/a.py::b": 1.0, "tests/env/c.py::d": 2.2, "tests/missions/e.py::f": 7.0}
    write_seconds({**tests, "tests/world/g.py::h": 0.1}, file)
    assert json.loads(file.read_text()) == {"missions/e.py": 7, "env": 3}

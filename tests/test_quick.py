"""What the suite says of itself: its quick part, and how it is shared between processes."""

import ast
import re
from pathlib import Path

from distribution import APART, LONGEST_FIRST, rank_of, scope_of
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
    assert all((TESTS / name).exists() for name in (*LONGEST_FIRST, *APART))
    one, other = "tests/env/test_batch.py::test_a[x::y]", "tests/env/test_actions.py::test_b"
    assert scope_of(one) == scope_of(other) == "env"
    assert scope_of("tests/test_house.py::test_c") == "test_house.py"
    page, next_page = (f"tests/{APART[0]}::test_d[{page}]" for page in "pq")
    assert scope_of(page) != scope_of(next_page)


def test_the_longest_come_first_and_what_stays_together_in_one_piece():
    files = [f"{top}/test_x.py" for top in LONGEST_FIRST if not top.endswith(".py")]
    files += [top for top in LONGEST_FIRST if top.endswith(".py")]
    nodes = [f"tests/{file}::test_y" for file in ("world/test_x.py", "routing/test_x.py", *files)]
    ranked = [scope_of(node) for node in sorted(nodes, key=rank_of)]
    assert ranked == [*LONGEST_FIRST, "routing", "world"]
    assert rank_of(f"tests/{APART[0]}::test_d")[0] == LONGEST_FIRST.index("docs")

"""What is private to numba is named in one file, each name with its reason."""

import ast
from pathlib import Path

import numba
import pytest
from numba.core import registry

from uas_coverage_env.compiled import internals

FILE = Path(internals.__file__)
ROOT = FILE.parents[2]
PACKAGES = ("uas_coverage_env", "baselines", "agents")
DOCUMENTED = {
    "numba.core": {"errors", "event"},
    "numba.cuda": {"config"},
    "numba.extending": {"intrinsic"},
    "llvmlite": {"ir", "binding"},
}
"""Of numba's modules for extensions, what is documented and used here."""


def imported(path: Path) -> set[str]:
    """What a file takes from modules of numba, without what is documented."""
    found: set[str] = set()
    for statement in ast.walk(ast.parse(path.read_text())):
        if isinstance(statement, ast.ImportFrom) and statement.module != "numba":
            module = statement.module or ""
            if module.partition(".")[0] in ("numba", "llvmlite"):
                names = {alias.name for alias in statement.names}
                found |= names - DOCUMENTED.get(module, set())
    return found


def test_private_names_of_numba_are_few_and_each_has_a_reason():
    assert len(internals.PRIVATE) <= 42
    assert all(internals.PRIVATE.values())
    text = FILE.read_text().partition("}\n")[2]
    assert [name for name in internals.PRIVATE if name not in text and name not in KERNELS] == []


DUNDERS = {"__closure__", "__code__", "__qualname__", "__version__"}

KERNELS = {"_nrt", "forceinline"}
"""Options that are used in the file beside."""


def test_every_private_name_that_is_used_is_listed():
    tree = ast.parse(FILE.read_text())
    own = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    stored = {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and isinstance(node.ctx, ast.Store)
        and isinstance(node.value, ast.Name)
        and node.value.id == "self"
    }
    private = {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and node.attr.startswith("_")
    }
    used = imported(FILE) | private - own - stored - DUNDERS
    assert used <= internals.PRIVATE.keys()


@pytest.mark.parametrize("package", PACKAGES)
def test_no_other_file_imports_what_is_private_to_numba(package):
    files = [path for path in (ROOT / package).rglob("*.py") if path != FILE]
    assert {path.name: names for path in files if (names := imported(path))} == {}


def test_numba_has_what_is_listed():
    """A release that renames one says so here, before a kernel is compiled."""
    target = registry.cpu_target.target_context
    codegen = target.codegen()
    owners = [
        internals, target, target.call_conv, codegen, codegen.create_library("none"),
        internals.CPUDispatcher, internals.Compiler, internals.CompileResultCacheImpl,
        internals.Flags(), internals.FunctionIdentity, numba.core.options.DefaultOptions,
    ]  # fmt: skip
    absent = {
        name for name in internals.PRIVATE if not any(hasattr(owner, name) for owner in owners)
    }
    # made by instances
    assert absent <= {"llvm_func_name", "_cache", "_locator"}

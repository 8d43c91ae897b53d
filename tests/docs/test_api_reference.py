"""The API reference describes every public name, and the stability page says which these are."""

import ast
import importlib
import json
import re
import zlib
from pathlib import Path

import pytest
from markdown_blocks import PAGES, ROOT, blocks

STABILITY = (ROOT / "docs" / "stability.md").read_text(encoding="utf-8")
TOP = "uas_coverage_env"
TABLE = STABILITY.partition("| module |")[2].partition("\n\n")[0]
MODULES = re.findall(r"`(uas_coverage[\w.]+)`", TABLE)


@pytest.fixture(scope="module")
def described(site):
    """The full names of all that the reference describes."""
    content = (site / "objects.inv").read_bytes().split(b"\n", 4)[4]
    entries = [line.split() for line in zlib.decompress(content).decode().splitlines()]
    return {name for name, kind, *_ in entries if kind.startswith("py:")}


def is_described(module, name, described):
    thing = getattr(importlib.import_module(module), name)
    while module:
        if f"{module}.{name}" in described:
            return getattr(importlib.import_module(module), name, None) is thing
        module = module.rpartition(".")[0]
    return False


def test_every_module_with_public_names_is_on_the_stability_page():
    files = [path for path in (ROOT / TOP).rglob("*.py") if "__all__ =" in path.read_text("utf-8")]
    found = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for path in files
    }
    assert len(found) > 8
    assert found <= set(MODULES)


@pytest.mark.parametrize("module", MODULES)
def test_every_public_name_is_described(module, described):
    names = importlib.import_module(module).__all__
    assert names
    assert [name for name in names if not is_described(module, name, described)] == []


def imports(code):
    """(module, name) of ours that a piece of code imports."""
    return {
        (statement.module, alias.name)
        for statement in ast.walk(ast.parse(code))
        if isinstance(statement, ast.ImportFrom) and statement.module
        if statement.module.startswith("uas_coverage")
        for alias in statement.names
    }


def notebook_code(path: Path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    return [re.sub(r"^%.*$", "", text, flags=re.MULTILINE) for text in code]


def test_what_pages_and_lessons_import_is_described(described):
    code = [b.text for page in PAGES for b in blocks(page) if b.language == "python"]
    for path in (ROOT / "docs" / "lessons").glob("*.ipynb"):
        code += notebook_code(path)
    used = set().union(*map(imports, code))
    assert len(used) > 30
    missing = [
        f"{module}.{name}"
        for module, name in sorted(used)
        if f"{module}.{name}" not in MODULES and not is_described(module, name, described)
    ]
    assert missing == []


def test_parameters_and_attributes_are_told_apart_and_types_lead_to_their_classes(site):
    text = (site / "api" / "flights.html").read_text(encoding="utf-8")
    assert 'id="uas_coverage_env.rollout"' in text
    assert "<strong>max_steps</strong>" in text
    assert 'href="scenarios.html#uas_coverage_env.Scenario"' in text

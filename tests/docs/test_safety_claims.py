"""Every claim of the pages on safety and on failures names a test that there is."""

import ast
import re

import pytest
from markdown_blocks import ROOT

PAGES = {"safety.md": "claim", "faults.md": "row"}
TESTS = ROOT / "tests"


def claims(page):
    """Of each row of the table: the claim, and its tests as (file, name)."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    table = text.split(f"| {PAGES[page]} | test |\n|---|---|\n")[1].split("\n\n")[0]
    rows = [row.strip("| ").split(" | ") for row in table.splitlines()]
    return {claim: re.findall(r"`([\w/]+\.py)::(\w+)`", tests) for claim, tests in rows}


@pytest.mark.parametrize("page", PAGES)
def test_every_claim_names_a_test_that_there_is(page):
    found = claims(page)
    assert len(found) > 20
    missing = [claim for claim, tests in found.items() if not tests]
    for claim, tests in found.items():
        for file, name in tests:
            path = TESTS / file
            functions = ast.parse(path.read_text(encoding="utf-8")).body if path.is_file() else []
            if not any(isinstance(f, ast.FunctionDef) and f.name == name for f in functions):
                missing.append(f"{claim} {file}::{name}")
    assert missing == []

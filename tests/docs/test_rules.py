"""The page of the rules names what the world records and what scenario files hold."""

import re

from markdown_blocks import ROOT

from uas_coverage_env.entities.outcome import CONTACT_NAMES
from uas_coverage_env.scenario.schema import scenario_schema

PAGE = (ROOT / "docs" / "rules.md").read_text(encoding="utf-8")


def section(title):
    return PAGE.partition(f"\n## {title}\n")[2].partition("\n## ")[0]


def test_every_kind_of_contact_has_its_row_in_the_order_in_which_they_are_recorded():
    kinds = re.findall(r"^\| `(\w+)` \|", section("Contact"), re.MULTILINE)
    assert ("none", *kinds) == CONTACT_NAMES


def test_the_quantities_of_the_rules_are_keys_of_scenario_files():
    schema = scenario_schema()
    keys = {
        *schema["properties"],
        *(key for table in schema["$defs"].values() for key in table["properties"]),
    }
    named = set(re.findall(r"`(\w+_(?:m|s|mps|max|steps))`", PAGE))
    assert len(named) > 7
    assert named <= keys


def test_docstrings_cite_pages_that_are_there():
    cited = {
        (path.relative_to(ROOT), page)
        for folder in ("uas_coverage_env", "baselines", "agents", "tests", "benchmarks")
        for path in (ROOT / folder).rglob("*.py")
        for page in re.findall(r"(docs/\w+\.md|\b[A-Z_]+\.md)\b", path.read_text("utf-8"))
    }
    assert len(cited) > 5
    lost = {
        (str(path), page)
        for path, page in cited
        if not any((at / page).exists() for at in (ROOT, ROOT / path.parents[-2]))
    }
    assert lost == set()

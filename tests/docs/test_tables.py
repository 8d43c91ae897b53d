"""The tables that pages take from the code: committed, and fresh."""

import importlib.util

import pytest
from markdown_blocks import PAGES, ROOT


@pytest.fixture(scope="module")
def tables():
    spec = importlib.util.spec_from_file_location("tables", ROOT / "docs" / "tables.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_what_is_generated_is_what_the_code_says_now(tables):
    """Where this fails: python docs/tables.py."""
    wanted = tables.renewed_files()
    stale = [path.name for path, text in wanted.items() if path.read_text("utf-8") != text]
    assert stale == []


def test_every_table_is_shown_on_a_page(tables):
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    shown = [name for name in tables.PARTS if f"<!-- generated: {name} -->\n" in text]
    assert shown == list(tables.PARTS)


def test_no_page_includes_a_file_that_a_code_host_does_not_have():
    assert not [page.name for page in PAGES if "{include}" in page.read_text(encoding="utf-8")]


def test_what_was_changed_by_hand_is_made_anew_and_the_rest_is_left(tables):
    page = "before\n<!-- generated: rewards -->\nby hand\n<!-- end of rewards -->\nafter\n"
    text = tables.renewed(page)
    assert tables.rewards_table() in text
    assert "by hand" not in text
    assert text.startswith("before\n<!-- generated: rewards -->\n\n")
    assert text.endswith("\n\n<!-- end of rewards -->\nafter\n")
    assert tables.renewed(text) == text


@pytest.mark.parametrize(
    "page",
    [
        "<!-- generated: rewards -->\nno end\n",
        "<!-- generated: riches -->\n<!-- end of riches -->\n",
        "<!-- generated: rewards -->\n<!-- end of actions -->\n",
    ],
)
def test_a_mark_without_a_part_or_an_end_is_named(tables, page):
    with pytest.raises(ValueError, match="has no end, or is none of "):
        tables.renewed(page)

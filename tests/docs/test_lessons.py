"""The lessons as pages: they show the notebooks as these are, with their pictures."""

import importlib.util
import re
import shutil

import pytest
from markdown_blocks import ROOT


@pytest.fixture
def lessons():
    spec = importlib.util.spec_from_file_location("lessons", ROOT / "docs" / "lessons.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_lesson_has_a_page_with_each_of_its_cells(lessons):
    """Where this fails: python docs/lessons.py with the number of the lesson."""
    assert len(lessons.NOTEBOOKS) == 9
    assert lessons.stale() == []


def test_a_page_is_stale_once_its_notebook_says_something_else(lessons, tmp_path, monkeypatch):
    notebook = tmp_path / lessons.NOTEBOOKS[0].name
    shutil.copyfile(lessons.NOTEBOOKS[0], notebook)
    monkeypatch.setattr(lessons, "NOTEBOOKS", [notebook])
    assert lessons.stale() == []
    text = notebook.read_text(encoding="utf-8")
    assert "import numpy as np" in text
    notebook.write_text(text.replace("import numpy as np", "import numpy"), encoding="utf-8")
    assert lessons.stale() == [lessons.page_of(notebook)]


def test_every_page_shows_pictures_and_every_picture_is_shown(lessons):
    shown = set()
    for notebook in lessons.NOTEBOOKS:
        page = lessons.page_of(notebook)
        text = page.read_text(encoding="utf-8")
        pictures = re.findall(r"^!\[.*\]\((.*)\)$", text, re.MULTILINE)
        assert len(pictures) >= 3, page.name
        shown |= {(page.parent / picture).resolve() for picture in pictures}
        for target in re.findall(r"(?<!!)\[[^\]]*\]\(([^)#\s]+)", text):
            assert (page.parent / target).exists(), f"{page.name}: {target}"
    assert shown == set(lessons.PICTURES.iterdir())


def test_pictures_are_small(lessons):
    sizes = {path.name: path.stat().st_size for path in lessons.PICTURES.iterdir()}
    assert {name: size for name, size in sizes.items() if size > 100_000} == {}


def test_links_between_lessons_lead_to_pages(lessons):
    class Cell:
        cell_type = "markdown"
        source = "[a](2_milp_blocks.ipynb) [b](../docs/rules.md) [c](../agents/README.md#d)"

    shown = "[a](2_milp_blocks.md) [b](../rules.md) [c](../../agents/README.md#d)"
    assert lessons.source_of(Cell()) == shown

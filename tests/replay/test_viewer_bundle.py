"""The viewer that is shipped is the one whose source is here."""

import hashlib
import json
import re
from importlib.resources import files
from pathlib import Path

from uas_coverage_env.draw.colours import (
    BLUE,
    INK,
    PAGES,
    WHITE,
    hex_of,
    on_dark_area,
    on_dark_line,
    page_style,
)

VIEWER = Path(__file__).parents[2] / "viewer"
BUNDLE = files("uas_coverage_env.replay").joinpath("viewer.js").read_text(encoding="utf-8")


def test_the_bundle_was_built_from_the_sources_as_they_are():
    """As in viewer/build.mjs; where this fails: cd viewer && npm ci && npm run build."""
    total = hashlib.sha256()
    sources = sorted(path.name for path in (VIEWER / "src").iterdir())
    assert len(sources) > 10
    for name in ("package.json", "build.mjs", *(f"src/{source}" for source in sources)):
        total.update(f"{name}\n".encode() + (VIEWER / name).read_bytes() + b"\n")
    assert re.findall(r"sources sha256:(\w+)", BUNDLE) == [total.hexdigest()]


def test_every_colour_that_the_viewer_names_is_in_the_one_table():
    sources = "".join(path.read_text() for path in sorted((VIEWER / "src").iterdir()))
    named = set(re.findall(r"""(?:var\(|colour\(\s*|["'])--([a-z-]+)""", sources))
    set_by_the_page = {"uas", "kind", "done"}
    assert set_by_the_page < named
    assert not named - set_by_the_page - set(PAGES)
    assert not re.search(r"--[a-z-]+:\s*#", sources)


def test_pages_are_given_all_colours_light_and_dark():
    light, dark = page_style().split("@media", 1)
    for name, both in PAGES.items():
        for style, colour in zip((light, dark), both, strict=True):
            assert f"--{name}:{hex_of(colour)};" in style


def test_on_dark_pages_lines_are_lighter_and_areas_darker_as_in_the_viewer():
    """As `bright` and `dim` of viewer/src/palette.ts."""
    assert hex_of(on_dark_line(BLUE)) == "#4d9cc9"
    assert hex_of(on_dark_line(INK)) == "#b3b4b5"
    assert hex_of(on_dark_area(WHITE)) == "#b3b3b3"


def test_the_bundle_carries_the_licence_of_three():
    version = json.loads((VIEWER / "package.json").read_text())["dependencies"]["three"]
    notice = BUNDLE[: BUNDLE.index("*/")]
    assert f"three.js {version}" in notice
    assert "The MIT License" in notice
    assert "three.js authors" in notice


def test_the_sources_name_exact_versions():
    package = json.loads((VIEWER / "package.json").read_text())
    versions = {**package["dependencies"], **package["devDependencies"]}
    assert all(re.fullmatch(r"\d+\.\d+\.\d+", version) for version in versions.values())
    lock = json.loads((VIEWER / "package-lock.json").read_text())
    assert {name: lock["packages"][f"node_modules/{name}"]["version"] for name in versions} == (
        versions
    )
    assert not [name for name, entry in lock["packages"].items() if "resolved" in entry]


def test_no_file_of_the_viewer_is_long():
    lengths = {path.name: path.read_text().count("\n") for path in (VIEWER / "src").iterdir()}
    assert {name: n for name, n in lengths.items() if n > 440} == {}

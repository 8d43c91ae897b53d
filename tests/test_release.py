"""A release is named alike wherever it is named, and its changes can be read."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_version_is_the_same_in_the_package_the_citation_and_the_changelog():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    released = re.findall(r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d\d-\d\d)$", CHANGELOG, re.MULTILINE)
    assert released
    assert released[0][0] == project["version"]
    assert f"\nversion: {released[0][0]}\n" in citation
    assert f'\ndate-released: "{released[0][1]}"\n' in citation


def test_what_is_not_released_yet_has_a_heading_of_its_own_on_top():
    assert re.findall(r"^## \[(.*?)\]", CHANGELOG, re.MULTILINE)[0] == "Unreleased"


def test_changes_of_a_release_are_short_and_grouped():
    release = CHANGELOG.partition("\n## [")[2].partition("\n## [")[2]
    groups = re.findall(r"^### (.*)$", release, re.MULTILINE)
    assert set(groups) <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
    entries = re.findall(r"^- (.*)$", release, re.MULTILINE)
    assert len(entries) > 30
    assert {entry[:40]: len(entry) for entry in entries if len(entry) > 400} == {}

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


def test_the_readme_cites_paper_and_package_as_the_citation_file_does():
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    paper, package = re.findall(r"^@\w+\{\w+,\n(.*?)^\}$", readme, re.MULTILINE | re.DOTALL)

    title = re.search(r'^title: "(.*)"$', citation, re.MULTILINE)[1]
    version = re.search(r"^version: (.*)$", citation, re.MULTILINE)[1]
    released = re.search(r'^date-released: "(.*)"$', citation, re.MULTILINE)[1]
    (authors,) = re.findall(r"^  - name: (.*)$", citation, re.MULTILINE)
    assert _bibtex(package) == {
        "title": title,
        "author": f"{{{authors}}}",
        "version": version,
        "date": released,
    }

    (article,) = re.findall(r"^    title: (.*)$", citation, re.MULTILINE)
    people = re.findall(r"given-names: (.*)\n +family-names: (.*)", citation)
    fields = _bibtex(paper)
    assert fields["title"] == article
    assert fields["author"] == " and ".join(f"{last}, {first}" for first, last in people)


def _bibtex(entry: str) -> dict[str, str]:
    return dict(re.findall(r"^  (\w+) *= \{(.*)\},?$", entry, re.MULTILINE))

"""The viewer that is shipped is the one whose source is here."""

import hashlib
import json
import re
from importlib.resources import files
from pathlib import Path

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

"""Entry points and versions are read once, and again where something has been installed."""

import os
from importlib import metadata

import pytest

from uas_coverage_env.plugins.installed import entry_points, version_of

GROUP = "uas_coverage.test_installed"


def install(folder, name):
    """A package that announces itself; the folder was changed a second later than before."""
    made = folder / f"{name}-1.0.dist-info"
    made.mkdir()
    (made / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (made / "entry_points.txt").write_text(f"[{GROUP}]\n{name} = {name}:Thing\n")
    later_ns = folder.stat().st_mtime_ns + 1_000_000_000
    os.utime(folder, ns=(later_ns, later_ns))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def names():
    return [entry.name for entry in entry_points(GROUP)]


def test_what_is_installed_later_is_found_and_what_is_removed_is_not(folder):
    assert names() == []
    assert version_of("first") is None
    install(folder, "first")
    assert version_of("first") == "1.0"
    assert names() == ["first"]
    install(folder, "second")
    assert sorted(names()) == ["first", "second"]
    (folder / "first-1.0.dist-info" / "entry_points.txt").unlink()
    (folder / "first-1.0.dist-info" / "METADATA").unlink()
    (folder / "first-1.0.dist-info").rmdir()
    assert names() == ["second"]
    assert version_of("first") is None


def test_what_is_installed_is_read_once(folder, monkeypatch):
    read, calls = metadata.entry_points, []
    monkeypatch.setattr(metadata, "entry_points", lambda **of: calls.append(of) or read(**of))
    install(folder, "first")
    assert names() == names() == ["first"]
    assert calls == [{"group": GROUP}]

"""The site, built once for all tests that look at it."""

import subprocess
import sys

import pytest
from markdown_blocks import ROOT

# the scripts of the documentation import each other from their folder
if str(ROOT / "docs") not in sys.path:
    sys.path.append(str(ROOT / "docs"))


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """The folder of the site as HTML."""
    folder = tmp_path_factory.mktemp("site")
    _build(folder)
    return folder / "html"


def _build(folder):
    options = ["-W", "-q", "-b", "html", "-d", folder / "doctrees"]
    command = [sys.executable, "-m", "sphinx", *options, ROOT / "docs", folder / "html"]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr

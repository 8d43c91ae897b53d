"""The first lines of the pages install the program, also where Python is externally managed."""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FIRST = ("README.md", "docs/quickstart.md", "docs/from_area_to_flight.md")
PAGES = {page: (ROOT / page).read_text(encoding="utf-8") for page in FIRST}
ENVIRONMENT = "python3 -m venv .venv && . .venv/bin/activate && "
MANAGED = any(Path("/usr/lib").glob("python3*/EXTERNALLY-MANAGED"))
"""Whether the system's own Python refuses to install anything outside of an environment."""
SAYS = """
import sys

def main():
    print(sys.prefix, "flew", sys.argv[1:])
"""


def first_block(page):
    """The first block of a page that installs anything, as lines."""
    found = re.findall(r"^```\w*sh\n(.*?)^```", PAGES[page], re.MULTILINE | re.DOTALL)
    return next(block for block in found if "pip install" in block).splitlines()


def small_wheel(folder):
    """A package without dependencies whose program `uas-coverage` says where it runs."""
    path = folder / "first_lines-1-py3-none-any.whl"
    of = "first_lines-1.dist-info"
    members = {
        "first_lines.py": SAYS,
        f"{of}/METADATA": "Metadata-Version: 2.1\nName: first-lines\nVersion: 1\n",
        f"{of}/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{of}/entry_points.txt": "[console_scripts]\nuas-coverage = first_lines:main\n",
    }
    members[f"{of}/RECORD"] = "".join(f"{name},,\n" for name in [*members, f"{of}/RECORD"])
    with zipfile.ZipFile(path, "w") as wheel:
        for name, text in members.items():
            wheel.writestr(name, text)
    return path


@pytest.fixture
def shell():
    """The environment of a newcomer's shell; the system's own Python where that is managed."""
    ours = ("PYTHON", "VIRTUAL", "PIP")
    clean = {key: value for key, value in os.environ.items() if not key.startswith(ours)}
    ready = ["/usr/bin/python3", "-c", "import ensurepip, pip"]
    if MANAGED and subprocess.run(ready, capture_output=True, check=False).returncode == 0:
        clean["PATH"] = "/usr/bin:/bin"
    return clean


@pytest.mark.parametrize("page", PAGES)
def test_what_a_newcomer_installs_goes_into_an_environment_of_its_own(page):
    install = re.escape(f"{ENVIRONMENT}python -m pip install -c constraints.txt ")
    assert re.fullmatch(install + r'(\.|"\.\[\w+\]")', first_block(page)[0])


def test_so_does_what_the_tests_of_the_readme_need():
    commands = re.findall(r"^.*-m pytest -n 2$", PAGES["README.md"], re.MULTILINE)
    assert [command.startswith(ENVIRONMENT) for command in commands] == [True]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows activates in another way")
def test_the_first_lines_of_the_readme_install_the_program_and_run_it(tmp_path, shell):
    wheel = small_wheel(tmp_path)
    lines = "\n".join(first_block("README.md"))
    lines = lines.replace("-c constraints.txt .", f"--no-index {wheel}")
    assert str(wheel) in lines
    run = {"cwd": tmp_path, "env": shell, "capture_output": True, "text": True, "check": False}
    if shell["PATH"] == "/usr/bin:/bin":
        refused = subprocess.run(["python3", "-m", "pip", "install", "--no-index", wheel], **run)
        assert "externally-managed-environment" in refused.stderr
    done = subprocess.run(["bash", "-e", "-c", lines], **run)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == f"{tmp_path / '.venv'} flew ['demo']"

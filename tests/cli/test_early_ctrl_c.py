"""Ctrl-C in the first third of a second, while the program is being imported."""

import os
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

INTERRUPTED_AT = """
import os, signal, sys

class Interrupts:
    def find_spec(self, name, path=None, target=None):
        if name == {name!r}:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupts())
"""


def installed():
    """The command as an installer writes it."""
    module, _, function = PROJECT["scripts"]["uas-coverage"].partition(":")
    named = "sys.argv[0] = '/usr/bin/uas-coverage'"
    return ["-c", f"import sys; {named}; from {module} import {function}; sys.exit({function}())"]


FORMS = {"installed": installed(), "module": ["-m", "uas_coverage_env"]}


def interrupted(folder, name, command):
    """A process of its own that gets SIGINT where it imports a module."""
    (folder / "sitecustomize.py").write_text(INTERRUPTED_AT.format(name=name))
    paths = filter(None, (str(folder), os.environ.get("PYTHONPATH", "")))
    return subprocess.run(
        [sys.executable, *command],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        # as a shell starts it, also where the tests run in the background
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        capture_output=True,
        text=True,
    )


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    "name", ["lazy_loader", "numpy", "gymnasium.core", "pettingzoo", "typer", "rich.console"]
)
def test_ctrl_c_while_the_program_is_imported_ends_it_without_a_word(tmp_path, name, form):
    ended = interrupted(tmp_path, name, [*FORMS[form], "planner", "list"])
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", "")


def test_ctrl_c_while_another_program_imports_the_package_is_python_s_own(tmp_path):
    catches = "try:\n import uas_coverage_env\nexcept KeyboardInterrupt:\n print('caught')"
    ended = interrupted(tmp_path, "pettingzoo", ["-c", catches])
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "caught\n", "")


def test_ctrl_c_while_a_command_is_imported_is_one_line(tmp_path):
    ended = interrupted(
        tmp_path, "uas_coverage_env.cli.planner", [*FORMS["installed"], "planner", "list"]
    )
    assert ended.returncode == 130
    assert ended.stderr == "error: stopped by hand; what was finished before is kept\n"

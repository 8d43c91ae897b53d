"""What the code host runs is what the documentation tells people to run."""

import re
import tomllib
from pathlib import Path

import pytest

yaml = pytest.importorskip("yaml")
ROOT = Path(__file__).parents[1]
FOLDER = ROOT / ".github" / "workflows"
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def steps(name):
    """The commands of a workflow, in their order."""
    workflow = yaml.safe_load((FOLDER / f"{name}.yml").read_text(encoding="utf-8"))
    jobs = workflow["jobs"].values()
    return [step["run"] for job in jobs for step in job["steps"] if "run" in step]


def matrix(name, job):
    workflow = yaml.safe_load((FOLDER / f"{name}.yml").read_text(encoding="utf-8"))
    return workflow["jobs"][job]["strategy"]["matrix"]


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.yml")), ids=lambda path: path.name)
def test_a_workflow_may_only_read_and_cannot_run_for_ever(path):
    workflow = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert workflow["permissions"] == {"contents": "read"}
    for job in workflow["jobs"].values():
        assert 0 < job["timeout-minutes"] <= 120
        uses = [step["uses"] for step in job["steps"] if "uses" in step]
        assert all(re.fullmatch(r"actions/[\w-]+@v\d+", action) for action in uses)


def test_tests_run_on_three_systems_and_the_oldest_and_newest_python():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    versions = re.findall(r"Python :: (3\.\d+)", " ".join(project["classifiers"]))
    ends = [versions[0], versions[-1]]
    assert project["requires-python"] == f">={versions[0]}"
    assert matrix("tests", "linux")["python"] == matrix("tests", "elsewhere")["python"] == ends
    assert matrix("tests", "elsewhere")["os"] == ["macos-latest", "windows-latest"]


def test_on_linux_the_tests_are_those_of_the_readme():
    assert ".ci/run" in steps("tests")
    assert "python -m pytest -m quick" in steps("tests")


def test_the_site_is_built_as_contributing_says():
    for command in steps("docs"):
        assert command.removesuffix(" --check") in CONTRIBUTING


def test_every_library_of_the_clients_tests_is_installed_by_a_job():
    jobs = [entry["tests"].split() for entry in matrix("clients", "library")["include"]]
    named = [f"test_{name}.py" for names in jobs for name in names]
    files = {path.name for path in (ROOT / "tests" / "clients").glob("test_*.py")}
    assert len(named) == len(set(named))
    others = {"test_gymnasium_wrappers.py", "test_loops.py"}
    no_package = {"test_epymarl.py"}  # flown from a checkout
    assert files - set(named) == others | no_package
    assert set(named) <= files
    assert " -c constraints.txt " in steps("clients")[0]


def test_the_next_numba_may_be_newer_than_the_bound():
    installs = [command for command in steps("numba-next") if "pip install" in command]
    assert "numba" not in installs[0]
    assert installs[1].endswith(" numba")
    tested = " ".join(steps("numba-next"))
    for package in ("compiled", "geometry", "vehicle", "world", "env"):
        assert f"tests/{package}" in tested
        assert (ROOT / "tests" / package).is_dir()

"""What the whole repository keeps: what may import what, types, form, the wheel."""

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from email import message_from_bytes
from email.message import Message
from graphlib import TopologicalSorter
from importlib.metadata import requires, version
from pathlib import Path

import grimp
import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
PACKAGES = {
    "uas_coverage_env": ROOT / "uas_coverage_env",
    "uas_coverage_baselines": ROOT / "baselines" / "uas_coverage_baselines",
    "uas_coverage_agents": ROOT / "agents" / "uas_coverage_agents",
}
LONGEST_FILE = 440
MOST_PARAMETERS = 12
TEXT = {".py", ".md", ".toml", ".txt", ".cff", ".yaml", ".yml", ".json", ".csv", ".ipynb", ".lp"}


def checked(*command: str, **environment: str) -> str:
    """Run a tool of this Python in the root; its output is the message where it fails."""
    result = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, env={**os.environ, **environment}
    )
    output = result.stdout + result.stderr
    assert result.returncode == 0, output
    return output


def ours() -> list[Path]:
    """Every file that is, or would be, committed."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    names = checked("git", "ls-files", "--cached", "--others", "--exclude-standard").splitlines()
    return [path for name in names if (path := ROOT / name).is_file()]


def test_no_package_imports_a_package_above_it():
    tool = Path(sys.executable).with_name("lint-imports")
    output = checked(str(tool), "--no-cache", PYTHONPATH=os.pathsep.join(_source_folders()))
    assert "0 broken" in output


def test_no_imports_run_in_a_circle():
    # those in functions, and for types only, count as well
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    imports = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    assert len(imports) > 200
    TopologicalSorter(imports).prepare()  # raises a CycleError that names them
    packages: dict[str, set[str]] = {}
    for name, imported in imports.items():
        if "." in name:
            packages.setdefault(_package(name), set()).update(map(_package, imported))
    TopologicalSorter({name: used - {name} for name, used in packages.items()}).prepare()


def _package(module: str) -> str:
    return ".".join(module.split(".")[:2])


def _nodes(*folders: Path) -> Iterator[tuple[Path, ast.AST]]:
    """All syntax nodes of some folders, of the packages by default, with their files."""
    for folder in folders or PACKAGES.values():
        for path in folder.rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                yield path, node


def _names_bound(init: Path) -> set[str]:
    """What an `__init__` binds, but for modules that it imports as such."""
    bound: set[str] = set()
    for node in ast.parse(init.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom):
            modules = {path.stem for path in init.parent.glob("*.py")}
            of_itself = node.module is None or node.module.endswith(f".{init.parent.name}")
            names = {alias.asname or alias.name for alias in node.names}
            bound |= names - modules if of_itself else names
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            bound.add(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            bound |= {target.id for target in targets if isinstance(target, ast.Name)}
    return bound


def test_no_module_is_hidden_by_what_its_package_calls_by_the_same_name():
    # `import package.module` would give the function, and `patch("package.module.x")` find no x
    hidden = [
        f"{module.relative_to(ROOT)}: {init.name}"
        for folder in PACKAGES.values()
        for init in (*folder.rglob("__init__.py"), *folder.rglob("__init__.pyi"))
        for name in _names_bound(init)
        for module in (init.parent / f"{name}.py", init.parent / name / "__init__.py")
        if module.exists()
    ]
    assert hidden == []


def test_no_function_takes_more_than_12_parameters():
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}: {n}"
        for path, node in _nodes()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        if (n := _n_parameters(node.args)) > MOST_PARAMETERS and not _is_command(node)
    ]
    assert not found


def _n_parameters(arguments: ast.arguments) -> int:
    return len(arguments.posonlyargs) + len(arguments.args) + len(arguments.kwonlyargs)


def _is_command(node: ast.AST) -> bool:
    """Whether a function is a command of the command line: each option is a parameter."""
    arguments = getattr(node, "args", None)
    of_command = arguments.args if isinstance(arguments, ast.arguments) else []
    said = [ast.unparse(each.annotation) for each in of_command if each.annotation]
    return any(word in text for text in said for word in ("typer.Option(", "typer.Argument("))


def test_no_column_with_a_meaning_is_addressed_by_its_number():
    # up to 2 they are coordinates, ends and pairs; beyond, and in records, a number says nothing
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}: {ast.unparse(node)}"
        for path, node in _nodes(*PACKAGES.values(), ROOT / "benchmarks")
        if isinstance(node, ast.Subscript) and (_is_numbered(node) or _is_field(node))
    ]
    assert not found, "name these columns where their array is declared"


@pytest.mark.parametrize(
    ("text", "numbered"),
    [
        ("swarm.x[i, 2]", True),
        ("flight.x[:, :, 0]", True),
        ("packs[r, 1]", True),
        ("row[3]", True),
        ("noise[5, 5]", True),
        ("swarm.x[i, Z]", False),
        ("swarm.x[0, Z]", False),
        ("swarm.x[i, :3]", False),
        ("places_m[:, 2]", False),
    ],
)
def test_a_column_by_its_number_is_told_from_coordinates(text, numbered):
    node = ast.parse(text, mode="eval").body
    assert isinstance(node, ast.Subscript)
    assert (_is_numbered(node) or _is_field(node)) is numbered


RECORDS = {
    "x": "states of the UAS: `vehicle/layout.py`",
    "packs": "flights with fresh packs: `routing/task.py`",
    "gain": "battery over thrust: `reductions/elimination.py`",
    "level": "voltage and current: `reductions/elimination.py`",
    "notes": "steps of a labelled route: `training/route_flights.py`",
    "output": "voltage and current: `reductions/elimination.py`",
    "history": "what a solver told: `benchmarks/solver_watch.py`",
    "trace": "better and better orders: `benchmarks/routing_peers.py`",
    "_DEFLECTIONS": "commands to try instead: `autopilot/safety.py`",
}
"""Arrays whose columns mean different things from the first on, as names and as attributes; of a
plain `x`, which may be anything, nothing is asked."""


def _is_field(node: ast.Subscript) -> bool:
    """Whether a number says which column of a record is meant."""
    named = node.value.attr if isinstance(node.value, ast.Attribute) else ""
    if isinstance(node.value, ast.Name) and node.value.id != "x":
        named = node.value.id
    if named not in RECORDS or not isinstance(node.slice, ast.Tuple):
        return False
    column = node.slice.elts[-1]
    return isinstance(column, ast.Constant) and isinstance(column.value, int)


NOT_COLUMNS = {
    "Annotated": "types, and lengths of axes",
    "series": "terms of a power series, numbered as in its formula",
}


def _is_numbered(node: ast.Subscript) -> bool:
    """Whether a number of 3 or more says which element is meant.

    A slice from the beginning alone is none: it cuts texts and lists short.
    """
    if isinstance(node.value, ast.Name) and node.value.id in NOT_COLUMNS:
        return False
    if isinstance(node.slice, ast.Tuple):
        numbers = [number for part in node.slice.elts for number in _ends(part)]
    elif isinstance(node.slice, ast.Slice) and node.slice.lower is None:
        numbers = []
    else:
        numbers = _ends(node.slice)
    return any(
        isinstance(number, ast.Constant) and number.value in range(3, 1000) for number in numbers
    )


def _ends(part: ast.expr) -> list[ast.expr | None]:
    """An index, or the first and the last index of a slice."""
    if not isinstance(part, ast.Slice):
        return [part]
    last = part.upper
    if isinstance(last, ast.Constant) and isinstance(last.value, int):
        last = ast.Constant(last.value - 1)
    return [part.lower, last]


def _source_folders() -> list[str]:
    return sorted({str(folder.parent) for folder in PACKAGES.values()})


def test_ruff_finds_nothing_to_mend():
    checked(sys.executable, "-m", "ruff", "check", ".")
    checked(sys.executable, "-m", "ruff", "format", "--check", ".")


def test_pyrefly_finds_no_type_that_does_not_fit():
    # the packages that are imported are looked up where the tests run
    here = ("--python-interpreter-path", sys.executable)
    tool = Path(sys.executable).with_name("pyrefly")
    output = checked(str(tool), "check", *here, "--output-format", "min-text")
    assert "0 errors" in output


def test_no_file_names_a_folder_of_the_machine_it_was_written_on():
    machine_folders = [f"/{name}/" for name in ("work", "tmp", "farm", "root")]
    found = [
        f"{path.relative_to(ROOT)}: {folder}"
        for path in ours()
        if path.suffix in TEXT or path.name == "run"
        for folder in machine_folders
        if folder in path.read_text(encoding="utf-8")
    ]
    assert not found


def test_no_python_file_is_much_longer_than_400_lines():
    lengths = {
        str(path.relative_to(ROOT)): len(path.read_text(encoding="utf-8").splitlines())
        for path in ours()
        if path.suffix == ".py"
    }
    assert len(lengths) > 50
    assert {name: n for name, n in lengths.items() if n > LONGEST_FILE} == {}


def pinned(file: str) -> dict[str, str]:
    """Package -> version of a file of constraints, which pins exact versions and nothing else."""
    versions = {}
    for line in (ROOT / file).read_text().splitlines():
        if not line.startswith("#"):
            requirement = Requirement(line)
            (pin,) = requirement.specifier
            assert pin.operator == "=="
            assert requirement.url is None
            assert "+" not in pin.version, f"{requirement}: a local version is on no index"
            versions[_canonical(requirement.name)] = pin.version
    return versions


def test_developers_constraints_pin_all_that_tests_need():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    needed = [*project["dependencies"], *project["optional-dependencies"]["test"]]
    names = {_canonical(Requirement(text).name) for text in needed}
    assert names <= pinned("constraints-dev.txt").keys()


def test_users_constraints_leave_room_for_learners_libraries():
    users = pinned("constraints.txt")
    assert users.items() <= pinned("constraints-dev.txt").items()
    assert {"numba", "numpy", "scipy", "highspy"} <= users.keys()
    # RLlib and AgileRL need versions of their own
    assert not users.keys() & {"gymnasium", "pettingzoo", "torch", "pandas", "packaging", "ray"}


def test_every_numpy_from_our_bound_on_that_numba_takes_is_ours():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    ours = {each.name: each.specifier for each in map(Requirement, project["dependencies"])}
    numbas = {each.name: each.specifier for each in map(Requirement, requires("numba") or [])}
    assert ours["numba"].contains(version("numba"))
    releases = [f"2.{minor}.0" for minor in range(6)]
    assert [release in numbas["numpy"] for release in releases] == [True] * 6
    assert [release in ours["numpy"] for release in releases] == [True] * 6


def _canonical(name: str) -> str:
    return name.lower().replace("_", "-")


def test_ci_runs_what_the_readme_tells_a_newcomer():
    script = (ROOT / ".ci" / "run").read_text()
    command = 'python -m pip install -c constraints-dev.txt ".[test]" && python -m pytest -n 2'
    assert all(part in script for part in command.split(" && "))
    assert command in (ROOT / "README.md").read_text()


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> zipfile.ZipFile:
    folder = tmp_path_factory.mktemp("wheel")
    checked(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder))
    (path,) = folder.glob("*.whl")
    return zipfile.ZipFile(path)


@pytest.fixture(scope="module")
def metadata(wheel) -> Message:
    (name,) = [name for name in wheel.namelist() if name.endswith(".dist-info/METADATA")]
    return message_from_bytes(wheel.read(name))


def test_the_wheel_holds_our_three_packages_and_nothing_else(wheel):
    tops = {name.partition("/")[0] for name in wheel.namelist()}
    (info,) = [top for top in tops if top.endswith(".dist-info")]
    assert tops - {info} == set(PACKAGES)


def test_the_wheel_holds_every_module_and_data_file(wheel):
    names = set(wheel.namelist())
    wanted = {
        f"{package}/{path.relative_to(folder).as_posix()}"
        for package, folder in PACKAGES.items()
        for path in folder.rglob("*")
        if path.suffix in {".py", ".toml", ".typed", ".safetensors", ".js", ".css", ".csv", ".zip"}
    }
    assert wanted <= names
    assert "uas_coverage_env/scenario/village.toml" in names
    assert {name for name in names if name.endswith("s500_v2.toml")}
    assert not [
        name
        for name in names
        if "__pycache__" in name or name.endswith((".nbi", ".nbc", "kernels.zip"))
    ]


def test_the_core_needs_neither_torch_nor_matplotlib(metadata):
    requirements = [Requirement(text) for text in metadata.get_all("Requires-Dist") or []]
    core = {_canonical(entry.name) for entry in requirements if entry.marker is None}
    assert "numpy" in core
    heavy = {
        "torch",
        "matplotlib",
        "stable-baselines3",
        "ray",
        "pygame-ce",
        "pandas",
        "pyscipopt",
        "gurobipy",
    }
    assert core.isdisjoint(heavy)


def test_importing_the_core_loads_no_heavy_package():
    loaded = checked(
        sys.executable,
        "-c",
        "import sys, uas_coverage_env, uas_coverage_env.cli, uas_coverage_baselines\n"
        "heavy = ('torch', 'matplotlib', 'pygame', 'highspy', 'pyscipopt', 'gurobipy',\n"
        "    'ray', 'stable_baselines3')\n"
        "sys.stdout.write(' '.join(name for name in heavy if name in sys.modules))",
    )
    assert loaded == ""


def test_every_name_of_the_nomenclature_stands_where_it_says():
    page = (ROOT / "docs" / "nomenclature.md").read_text(encoding="utf-8")
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in page.partition("\n## Symbols\n")[2].splitlines()
        if line.startswith("|") and "`" in line
    ]
    assert len(rows) > 50
    for symbol, _, names, _, place in rows:
        path = place.strip("`").replace("milp_mpc/", "baselines/uas_coverage_baselines/milp_mpc/")
        file = ROOT / path if path.startswith("baselines") else ROOT / "uas_coverage_env" / path
        words = set(re.findall(r"\w+", file.read_text(encoding="utf-8")))
        missing = set(re.findall(r"`(\w+)`", names)) - words
        assert not missing, f"{symbol}: {missing} not in {place}"

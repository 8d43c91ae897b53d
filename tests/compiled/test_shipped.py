"""Kernels that a wheel brings are loaded where they fit, and compiled where they do not."""

import json
import logging
import os
import platform
import runpy
import subprocess
import sys
import zipfile
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hatchling.metadata.core import ProjectMetadata
from hatchling.plugin.manager import PluginManager
from numba.core import registry

from uas_coverage_env.compiled import internals, shipped

ROOT = Path(__file__).parents[2]
KERNELS = """
import math
from uas_coverage_env.compiled.kernels import kernel
FACTOR = 1.1
@kernel
def thrust(x):
    return FACTOR * math.sqrt(x)
@kernel
def lift(values):
    total = 0.0
    for k in range(values.shape[0]):
        total += math.exp(-values[k]) * thrust(values[k]) + 0.1
    return total
"""
VALUES = np.linspace(0.0, 3.0, 101)
PROCESSOR = registry.cpu_target.target_context.codegen().magic_tuple()


@pytest.fixture(scope="module")
def compiled_for_all(tmp_path_factory):
    """Kernels compiled for the level by a process of its own."""
    if shipped.at_level(PROCESSOR) is None:
        pytest.skip("this processor is below the level")
    folder = tmp_path_factory.mktemp("build")
    (folder / "motor.py").write_text(KERNELS)
    program = "import numpy, motor; print(motor.lift(numpy.linspace(0.0, 3.0, 101)).hex())"
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join([os.environ["PYTHONPATH"], str(folder)]),
            "NUMBA_CPU_NAME": shipped.LEVEL,
            "NUMBA_CPU_FEATURES": "",
            "NUMBA_CACHE_DIR": str(folder / "cache"),
        },
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return sorted((folder / "cache").rglob("*.nbc")), float.fromhex(done.stdout)


@pytest.fixture
def archive(compiled_for_all, tmp_path, monkeypatch):
    """A wheel brings them, and a user has compiled nothing yet."""
    path = tmp_path / "kernels.zip"
    with zipfile.ZipFile(path, "w") as kernels:
        for each in compiled_for_all[0]:
            kernels.write(each, each.name)
    monkeypatch.setattr(shipped, "ARCHIVE", path)
    monkeypatch.setattr(internals.numba.config, "CACHE_DIR", "")
    shipped._archive.cache_clear()
    yield path
    shipped._archive.cache_clear()


class User:
    """A process that imports the kernels anew."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "motor.py"
        self.file.write_text(KERNELS)

    def lift(self) -> float:
        spec = spec_from_file_location("motor", self.file)
        # numba looks for the module of what it loads
        self.motor = sys.modules["motor"] = module_from_spec(spec)
        exec(compile(self.file.read_text(), self.file, "exec"), vars(self.motor))
        return self.motor.lift(VALUES)

    @property
    def loaded(self) -> int:
        """How many were there, of the one that Python calls and the part of it."""
        stats = self.motor.lift.for_python.stats, self.motor.thrust.stats
        return sum(len(each.cache_hits) for each in stats)

    @property
    def written(self) -> set[str]:
        return {path.name.split(".")[1] for path in self.file.parent.rglob("*.nbc")}


@pytest.fixture
def user(tmp_path):
    (tmp_path / "installed").mkdir()
    yield User(tmp_path / "installed")
    sys.modules.pop("motor", None)


def test_what_a_wheel_brings_is_loaded_flies_the_same_and_is_never_written_to(
    archive, user, compiled_for_all
):
    before = archive.read_bytes()
    lifted = user.lift()
    assert lifted == compiled_for_all[1]
    assert user.loaded == 1
    assert not user.written
    assert archive.read_bytes() == before
    archive.write_bytes(b"")  # as if there were none
    shipped._archive.cache_clear()
    assert user.lift() == lifted
    assert user.written == {"lift", "thrust"}


def test_a_package_that_cannot_be_written_to_serves_what_it_brings(archive, user, monkeypatch):
    nowhere = user.file.parent / "file"
    nowhere.write_text("")
    (user.file.parent / "__pycache__").write_text("no folder, so nothing can be written into it")
    for name in ("XDG_CACHE_HOME", "HOME"):
        monkeypatch.setenv(name, str(nowhere))
    user.lift()
    assert user.loaded == 1


def test_an_edited_part_is_compiled_and_so_is_what_calls_it(archive, user):
    before = user.lift()
    user.file.write_text(KERNELS.replace("1.1", "2.2"))
    assert user.lift() > 1.5 * before
    assert user.loaded == 0


@pytest.mark.parametrize(
    ("owner", "name", "other"),
    [
        (internals, "sys", SimpleNamespace(implementation=SimpleNamespace(cache_tag="cpython-39"))),
        (internals.numba, "__version__", "0.1"),
        (internals, "MACHINERY", "of another release"),
        (
            registry.cpu_target.target_context.codegen(),
            "_tm_features",
            PROCESSOR[2].replace("+avx2", "-avx2"),
        ),
    ],
    ids=["Python", "numba", "release", "processor"],
)
def test_kernels_of_another_python_numba_release_or_processor_are_not_loaded(
    archive, user, monkeypatch, compiled_for_all, owner, name, other
):
    monkeypatch.setattr(owner, name, other)
    assert user.lift() == compiled_for_all[1]
    assert user.loaded == 0
    assert user.written == {"lift", "thrust"}


FEATURES = (
    "avx", "avx2", "bmi", "bmi2", "cx16", "f16c", "fma", "lzcnt", "movbe", "popcnt", "sahf",
    "sse3", "sse4.1", "sse4.2", "ssse3", "xsave",
)  # fmt: skip
"""Of x86-64-v3, by the names that LLVM has for them."""


@pytest.mark.parametrize("lacking", FEATURES)
def test_a_processor_without_any_one_feature_of_the_level_is_below_it(lacking):
    has = [f"+{name}" for name in FEATURES]
    system = "x86_64-unknown-linux-gnu"
    assert shipped.at_level((system, "znver5", ",".join(has))) == (system, shipped.LEVEL, "")
    without = ",".join(name if name != f"+{lacking}" else f"-{lacking}" for name in has)
    assert shipped.at_level((system, "old", without)) is None
    assert shipped.at_level(("aarch64-apple-darwin", "apple-m1", ",".join(has))) is None
    assert shipped.at_level((system, shipped.LEVEL, "")) is None  # it is what is compiled for


@pytest.mark.parametrize("content", [b"", b"text", None], ids=["empty", "text", "cut off"])
def test_an_archive_that_cannot_be_read_costs_one_line_and_the_compilation(
    archive, user, compiled_for_all, caplog, content
):
    archive.write_bytes(archive.read_bytes()[:-30] if content is None else content)
    with caplog.at_level(logging.WARNING):
        assert user.lift() == compiled_for_all[1]
    assert user.loaded == 0
    (record,) = caplog.records
    assert str(archive) in record.getMessage()
    assert "install the package again" in record.getMessage()
    assert "\n" not in record.getMessage()


@pytest.mark.parametrize("damage", ["another byte", "another object"])
def test_an_entry_that_is_damaged_is_compiled(archive, user, compiled_for_all, damage):
    if damage == "another byte":
        content = bytearray(archive.read_bytes())
        content[600] ^= 1  # an archive knows the sum of each of its entries
        archive.write_bytes(content)
    else:
        with zipfile.ZipFile(archive, "w") as kernels:
            for each in compiled_for_all[0]:
                kernels.writestr(each.name, b"N.")
    assert user.lift() == compiled_for_all[1]
    assert user.loaded < 2
    assert user.written


def test_what_is_compiled_for_this_processor_comes_before_what_the_package_brings(
    archive, user, monkeypatch
):
    with shipped.compiling_for_this_processor():
        user.lift()
    assert user.loaded == 0
    assert user.written == {"lift", "thrust"}
    asked = []
    monkeypatch.setattr(internals, "shipped", lambda name: asked.append(name))
    user.lift()
    assert user.motor.lift.for_python.stats.cache_hits
    assert not asked


def test_a_build_that_is_asked_to_brings_what_the_first_commands_compile(tmp_path, monkeypatch):
    started = []

    def run(command, *, env, cwd, check):
        folder = Path(env["NUMBA_CACHE_DIR"], f"of_{len(started)}")
        folder.mkdir(parents=True)
        (folder / f"kernel_{len(started)}.python.nbc").write_text(" ".join(command[1:]))
        (folder / f"kernel_{len(started)}.part.nbc").write_text("")
        started.append((command[1:], env))

    monkeypatch.setattr(platform, "machine", lambda: "x86_64")
    build = runpy.run_path(str(ROOT / "hatch_build.py"))
    monkeypatch.setattr(subprocess, "run", run)
    metadata = ProjectMetadata(str(ROOT), PluginManager())
    hook = build["Kernels"](str(ROOT), {}, None, metadata, str(tmp_path), "wheel")
    data = {"force_include": {}}
    hook.initialize("standard", data)

    ((archive, place),) = data["force_include"].items()
    assert ROOT / place == shipped.ARCHIVE
    assert data["infer_tag"]
    assert not data["pure_python"]
    with zipfile.ZipFile(archive) as kernels:
        assert kernels.namelist() == sorted(f"kernel_{n}.python.nbc" for n in range(len(started)))
        warm_up = kernels.read("kernel_0.python.nbc").decode()
    assert warm_up.startswith("-m uas_coverage_env planner warm-up --environments")
    assert "--planner milp-mpc" in warm_up
    assert "demo" in started[1][0]
    steps = {(json.loads(command[-2]).get("action"), command[-1]) for command, _ in started[2:]}
    assert steps == {(action, version) for action in (None, "waypoint") for version in ("v0", "v1")}
    for _, env in started:
        assert (env["NUMBA_CPU_NAME"], env["NUMBA_CPU_FEATURES"]) == (shipped.LEVEL, "")
    (folder, *_) = started[0][1]["PYTHONPATH"].split(os.pathsep)
    (points,) = Path(folder).glob("uas_coverage_env-*.dist-info/entry_points.txt")
    assert "milp-mpc = uas_coverage_baselines.milp_mpc:MilpMpc" in points.read_text()
    hook.finalize("standard", data, "")
    assert not Path(folder).exists()

    hook.initialize("editable", unchanged := {"force_include": {}})
    assert unchanged == {"force_include": {}}
    monkeypatch.setattr(platform, "machine", lambda: "riscv64")
    with pytest.raises(SystemExit):
        hook.initialize("standard", {"force_include": {}})

"""What is compiled is kept on disk for as long as all the sources it was made from are the same."""

import json
import os
import shutil
import subprocess
import sys
import types
from collections import namedtuple
from concurrent.futures import ThreadPoolExecutor
from enum import Enum
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from new_process import in_new_process

from uas_coverage_env.compiled import digest
from uas_coverage_env.compiled.internals import KernelDispatcher
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.env.batch.kernel import step_batch, step_batch_in_threads, step_block_with
from uas_coverage_env.env.episode.step import step_episode_with
from uas_coverage_env.env.versions import V0, V1

PACKAGE = Path(digest.__file__).parents[1]
ROOT = PACKAGE.parent

SOURCES = {
    "craft/__init__.py": "",
    "craft/parts/__init__.py": """
from craft.parts.motor import thrust
from craft.parts.cell import charge
""",
    "craft/parts/motor.py": """
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
FACTOR = 2.0
@kernel
def thrust(x):
    return FACTOR * x
""",
    "craft/parts/cell.py": """
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
@kernel
def charge(x):
    return x - 1.0
""",
    "craft/body.py": """
from craft.parts import thrust
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
@kernel
def lift(x):
    return thrust(x) + 1.0
""",
    "sensor.py": """
from craft.body import lift
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from helper import half
@kernel
def sense(x):
    return half(lift(x))
def around(reward):
    @kernel
    def inner(x):
        return reward(x) + 1.0
    return inner
""",
    "helper.py": """
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
@kernel
def half(x):
    return 0.5 * x
""",
}

PROGRAM = """
import json, sys, types
package = types.ModuleType("uas_coverage_env")  # without the second that all of it takes
package.__path__ = [sys.argv.pop()]
sys.modules["uas_coverage_env"] = package
module, name, number = sys.argv[1:]
function = getattr(__import__(module, fromlist=[name]), name)
value = function(float(number))
stats = getattr(getattr(function, "for_python", None), "stats", None)
print(json.dumps([value, len(stats.cache_hits) if stats else 0]))
"""


@pytest.fixture
def craft(tmp_path):
    for name, text in SOURCES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def called(
    folder: Path, module: str, name: str, number: float = 3.0, program=PROGRAM, **environment: str
):
    """What a kernel returns in a new process, and how many versions it took from the cache.

    With a program or an environment of its own, Python is started for it.
    """
    if program is PROGRAM and not environment:
        return in_new_process(str(folder), module, name, number)
    done = subprocess.run(
        [sys.executable, "-c", program, module, name, str(number), str(PACKAGE)],
        env={
            **{key: text for key, text in os.environ.items() if key != "NUMBA_CACHE_DIR"},
            "PYTHONPATH": os.pathsep.join(
                [str(folder), os.environ.get("PYTHONPATH", ""), str(ROOT)]
            ),
            "PYTHONDONTWRITEBYTECODE": "1",
            **environment,
        },
        capture_output=True,
        text=True,
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr
    return tuple(json.loads(done.stdout))


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_an_edited_kernel_is_noticed_by_what_calls_it_from_another_module(craft):
    assert called(craft, "sensor", "sense") == (3.5, 0)
    assert called(craft, "sensor", "sense") == (3.5, 1)
    edit(craft / "craft/parts/motor.py", "FACTOR * x", "FACTOR * x + 1.0")
    assert called(craft, "sensor", "sense") == (4.0, 0)
    edit(craft / "craft/parts/motor.py", "2.0", "4.0")  # a constant
    assert called(craft, "sensor", "sense") == (7.0, 0)
    edit(craft / "helper.py", "0.5", "1.5")  # beside a file that belongs to no package
    assert called(craft, "sensor", "sense") == (21.0, 0)


def test_an_edit_elsewhere_costs_no_compilation(craft):
    called(craft, "sensor", "sense")
    edit(craft / "craft/parts/cell.py", "1.0", "2.0")
    edit(craft / "craft/parts/motor.py", "@kernel", "# a line\nOTHER = 1.0\n@kernel")
    edit(craft / "craft/body.py", "    return", '    """What lifts."""\n    return')
    assert called(craft, "sensor", "sense") == (3.5, 1)
    os.utime(craft / "craft/parts/motor.py", (1, 1))  # a fresh checkout of the same contents
    assert called(craft, "sensor", "sense") == (3.5, 1)


def test_a_name_that_a_package_takes_from_another_module_is_noticed(craft):
    called(craft, "craft.body", "lift")
    edit(craft / "craft/parts/__init__.py", "cell import charge", "cell import charge as thrust")
    assert called(craft, "craft.body", "lift") == (3.0, 0)


def test_a_kernel_built_around_another_is_kept_for_as_long_as_that_one_is_the_same(craft):
    (craft / "built.py").write_text(
        "from craft.body import lift\nfrom craft.parts import charge\n"
        "from sensor import around\nreward = around(lift)\nother = around(charge)\n"
    )
    assert called(craft, "built", "reward") == (8.0, 0)
    assert called(craft, "built", "other") == (3.0, 0)
    assert called(craft, "built", "reward") == (8.0, 1)
    edit(craft / "craft/parts/motor.py", "2.0", "3.0")
    assert called(craft, "built", "reward") == (11.0, 0)


def test_the_plant_flies_by_the_power_train_as_it_is_now(tmp_path):
    copy = tmp_path / PACKAGE.name
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__", "*.js"))
    program = """
import json
import numpy as np
from uas_coverage_env.vehicle import compile_vehicle, load_vehicle, plant_step
from uas_coverage_env.vehicle.layout import N_INPUTS, N_STATES
vehicle, x = compile_vehicle(load_vehicle("s500_v2"), 0.1)[()], np.zeros(N_STATES)
print(json.dumps(plant_step(vehicle, x, np.zeros(N_INPUTS), x.copy())))
"""
    before = called(tmp_path, "", "", program=program)
    edit(copy / "vehicle/powertrain.py", "return n * per_motor", "return 1.03 * n * per_motor")
    after = called(tmp_path, "", "", program=program)
    # not more: a vehicle whose rotors take 5 % more than its file says is refused
    assert after[1] > 1.02 * before[1] > 0.0


def test_what_was_compiled_from_earlier_sources_is_deleted(craft):
    called(craft, "craft.body", "lift")
    folder = craft / "craft/__pycache__"
    first = set(folder.glob("*.nbc"))
    for n in range(3):  # the second kernel of a module moves down, too
        edit(craft / "craft/body.py", " + 1.0", " + 1.0 + 1.0")
        called(craft, "craft.body", "lift", number=n)
    assert len(list(folder.glob("*.nbc"))) == len(first) == 1
    assert first.isdisjoint(folder.glob("*.nbc"))


def test_of_a_function_that_is_built_around_numbers_the_latest_versions_are_kept(craft):
    (craft / "many.py").write_text(
        "from uas_coverage_env.compiled import internals\n"
        "from uas_coverage_env.compiled.kernels import inlined_kernel, kernel\n"
        "internals._VERSIONS = 2\n"
        "def plus(y):\n    @kernel\n    def inner(x):\n        return x + y\n    return inner\n"
        "def call(x):\n    return [plus(float(y))(x) for y in range(5)][int(x)]\n"
    )
    assert called(craft, "many", "call", 4.0) == (8.0, 0)
    assert len(list(craft.glob("__pycache__/*.nbc"))) == 3


def test_a_folder_that_cannot_be_written_to_leaves_the_choice_to_the_users_cache(craft):
    (craft / "craft/__pycache__").write_text("no folder, so nothing can be written into it")
    home = craft / "home"
    there = {"XDG_CACHE_HOME": str(home), "HOME": str(home)}
    assert called(craft, "craft.body", "lift", **there) == (7.0, 0)
    assert called(craft, "craft.body", "lift", **there) == (7.0, 1)
    assert list(home.rglob("body.lift.*.nbc"))


def test_without_any_place_to_write_to_kernels_are_compiled_in_each_process(craft):
    (craft / "craft/__pycache__").write_text("")
    (craft / "home").write_text("")
    nowhere = {"XDG_CACHE_HOME": str(craft / "home"), "HOME": str(craft / "home")}
    for _ in range(2):
        assert called(craft, "craft.body", "lift", **nowhere) == (7.0, 0)


def test_a_cache_folder_of_the_users_choice_serves_checkouts_side_by_side(craft, tmp_path_factory):
    other = tmp_path_factory.mktemp("other")
    shutil.copytree(craft, other, dirs_exist_ok=True)
    edit(other / "craft/parts/motor.py", "2.0", "4.0")
    place = {"NUMBA_CACHE_DIR": str(craft / "chosen")}
    for hits in (0, 1):
        assert called(craft, "craft.body", "lift", **place) == (7.0, hits)
        assert called(other, "craft.body", "lift", **place) == (13.0, hits)
    assert not list((craft / "craft").rglob("*.nbc"))


def test_processes_that_compile_at_the_same_time_leave_a_whole_cache(craft):
    with ThreadPoolExecutor(4) as pool:
        results = list(pool.map(lambda _: called(craft, "craft.body", "lift"), range(4)))
    assert {value for value, _ in results} == {7.0}
    assert called(craft, "craft.body", "lift") == (7.0, 1)
    assert not list(craft.rglob("*.tmp.*"))


def test_closures_that_were_compiled_by_different_processes_are_told_apart(craft):
    (craft / "many.py").write_text(
        "from uas_coverage_env.compiled.kernels import kernel\n"
        "def plus(y):\n    @kernel\n    def inner(x):\n        return x + y\n    return inner\n"
        "one, two = plus(1.0), plus(2.0)\n"
        "@kernel\ndef first(x):\n    return one(x)\n"
        "@kernel\ndef second(x):\n    return two(x)\n"
        "@kernel\ndef both(x):\n    return 10.0 * one(x) + two(x)\n"
    )
    assert called(craft, "many", "first", 0.0) == (1.0, 0)
    assert called(craft, "many", "second", 0.0) == (2.0, 0)
    assert called(craft, "many", "both", 0.0) == (12.0, 0)


def test_a_cache_file_that_was_cut_off_is_replaced(craft):
    called(craft, "craft.body", "lift")
    (kept,) = (craft / "craft/__pycache__").glob("body.lift.*.nbc")
    kept.write_bytes(kept.read_bytes()[:100])
    assert called(craft, "craft.body", "lift") == (7.0, 0)
    assert called(craft, "craft.body", "lift") == (7.0, 1)


def test_without_compilation_kernels_are_plain_functions(craft):
    assert called(craft, "sensor", "sense", NUMBA_DISABLE_JIT="1") == (3.5, 0)
    assert not list(craft.rglob("*.nbc"))


def test_a_kernel_typed_into_a_prompt_is_compiled_but_not_kept():
    program = """
import json
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
@kernel
def twice(x):
    return 2.0 * x
print(json.dumps([twice(2.0), len(twice.for_python.stats.cache_hits)]))
"""
    assert called(Path.cwd(), "", "", program=program) == (4.0, 0)


VALUES = {
    "FACTOR": ["2.0", "np.float64(2.0)", "3.0"],
    "TABLE": ["np.zeros(2)", "np.ones(2)", "np.zeros(3)", "(1, 2)", "[1, 2]"],
    "KIND": ["np.dtype('f8')", "np.dtype([('a', 'f8')])", "np.dtype([('b', 'f8')])"],
    "CODE": ["Enum('Code', 'A B').A", "Enum('Code', 'A B').B", "Enum('Code', 'B A').A"],
    "ROW": ["namedtuple('Row', 'x y')", "namedtuple('Row', 'y x')"],
    "helper": ["lambda x: x + 1", "lambda x: x + 2", "lambda x, y=1: x + 1"],
    "cached": ["cache(lambda x: x + 1)", "cache(lambda x: x + 2)"],
    "bound": ["partial(max, 1)", "partial(max, 2)", "partial(min, 1)", "partial(max, default=1)"],
    "part": ["kernel(lambda x: x)", "kernel(lambda x: -x)", "inlined_kernel(lambda x: x)"],
    "module": ["made('m', X=1)", "made('m', X=2)"],
}
"""Values of a name that a kernel uses, each of which makes another kernel of it."""


def made(name: str, **values: object) -> types.ModuleType:
    module = types.ModuleType(name)
    vars(module).update(values)
    return module


KNOWN: dict[str, Any] = {
    "np": np,
    "made": made,
    "cache": cache,
    "partial": partial,
    "namedtuple": namedtuple,
    "Enum": Enum,
    "kernel": kernel,
    "inlined_kernel": inlined_kernel,
}


def digest_where(name: str, text: str) -> str | None:
    there = {**KNOWN, "__name__": "somewhere"}
    exec(f"def use(x):\n    return {name}.X(x)", there)
    there[name] = eval(text, there)
    return digest.digest_of(kernel(there["use"]))


@pytest.mark.parametrize("name", VALUES)
def test_every_value_that_a_kernel_names_makes_another_kernel(name):
    digests = [digest_where(name, text) for text in VALUES[name]]
    assert None not in digests
    assert len(set(digests)) == len(digests)
    assert digests == [digest_where(name, text) for text in VALUES[name]]


def test_what_an_object_has_computed_since_makes_no_other_kernel():
    class Table:
        @cached_property
        def total(self) -> float:
            return 1.0

    KNOWN["table"] = Table()
    before = digest_where("one", "table")
    assert KNOWN["table"].total == 1.0
    assert digest_where("one", "table") == before is not None


@pytest.mark.parametrize("version", [V0, V1], ids=lambda version: version.name)
def test_the_steps_of_all_environments_are_kept_on_disk(version):
    alone, block = step_episode_with(version), step_block_with(version, 234)
    for step in (alone, block, step_batch, step_batch_in_threads):
        assert digest.digest_of(step), step


def test_all_kernels_of_the_package_are_kept_on_disk():
    ours = {
        name: value
        for module in [*sys.modules.values()]
        if getattr(module, "__name__", "").startswith("uas_coverage_env.")
        for name, value in vars(module).items()
        if isinstance(value, KernelDispatcher)
    }
    assert len(ours) > 100
    assert [name for name, each in ours.items() if digest.digest_of(each) is None] == []


def test_what_only_this_process_knows_by_its_address_has_no_digest():
    assert digest_where("one", "object()") is None


def test_an_edited_string_is_noticed_and_a_docstring_is_none():
    def text_of(source: str) -> str | None:
        there: dict[str, Any] = {"__name__": "somewhere"}
        exec(source, there)
        return digest.digest_of(kernel(there["use"]))

    plain = text_of("def use(x):\n    return x == 'a'")
    assert plain != text_of("def use(x):\n    return x == 'b'")
    assert plain == text_of("def use(x):\n    'Says whether.'\n    return x == 'a'")


def test_kernels_that_call_each_other_have_a_digest():
    there: dict[str, Any] = {"__name__": "somewhere"}
    exec("def a(x):\n    return b(x)\ndef b(x):\n    return a(x)", there)
    assert digest.digest_of(kernel(there["a"]))


@pytest.mark.parametrize("first", ["a", "b", "c"])
def test_where_kernels_call_each_other_an_edit_of_one_makes_all_of_them_others(first):
    def digests(text: str) -> dict[str, str | None]:
        there: dict[str, Any] = {"__name__": "somewhere"}
        exec(text, there)
        digest.digest_of(kernel(there[first]))  # what is described first is described from within
        return {name: digest.digest_of(kernel(there[name])) for name in "abc"}

    text = (
        "def a(x):\n    return b(x) + 1.0\ndef b(x):\n    return c(x)\ndef c(x):\n    return a(x)"
    )
    before, after = digests(text), digests(text.replace("1.0", "2.0"))
    assert before == digests(text)
    assert None not in before.values()
    assert all(before[name] != after[name] for name in "abc")

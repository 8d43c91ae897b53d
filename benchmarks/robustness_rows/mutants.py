"""R13: the safety files with one operator, constant or condition changed: does a test see it?

The mutants are Cosmic Ray's (extra `mutants`), drawn for each file of `benchmarks/mutants.toml`;
each meets the tests named there, in a copy of the source tree. For a file with kernels all kernels
are run as plain Python: a mutant of one would have to compile all that calls it. Only operators
that leave a program of the kind that someone could have written are used: no `is` between numbers,
no `+` for a `<<`.
"""

from __future__ import annotations

import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from robustness_rows.row import Finding, Result, Row, Trial, errors, markdown

ROOT = Path(__file__).parents[2]
TABLE = tomllib.loads((ROOT / "benchmarks/mutants.toml").read_text("utf-8"))
LEAST_SHARE = 0.8
_TREE = ("uas_coverage_env", "baselines", "agents", "benchmarks", "tests", "pyproject.toml")
_LONGEST_S = 600.0  # a mutant that takes longer is caught
_MACHINE_CODE = ".nbc"
_SWAPPED = ("Add_Sub", "Mul_Div")
_COMPARED = ("Lt_LtE", "Gt_GtE", "Lt_GtE", "Gt_LtE", "Eq_NotEq", "Is_IsNot")
_OTHERS = (
    "AddNot",
    "NumberReplacer",
    "ReplaceAndWithOr",
    "ReplaceOrWithAnd",
    "ReplaceTrueWithFalse",
    "ReplaceFalseWithTrue",
    "ReplaceBreakWithContinue",
    "ReplaceContinueWithBreak",
    "ReplaceUnaryOperator_Delete_USub",
    "ReplaceUnaryOperator_Delete_Not",
)


def _operators() -> Iterator[str]:
    """Names of Cosmic Ray's, both ways for each pair."""
    for kind, pairs in (("Binary", _SWAPPED), ("Comparison", _COMPARED)):
        for pair in pairs:
            one, other = pair.split("_")
            yield f"core/Replace{kind}Operator_{one}_{other}"
            yield f"core/Replace{kind}Operator_{other}_{one}"
    yield from (f"core/{name}" for name in _OTHERS)


@cache
def _tree() -> tempfile.TemporaryDirectory[str]:
    """A copy of the sources, of this process's own."""
    place = tempfile.TemporaryDirectory(prefix="mutants_")
    for name in _TREE:
        start, end = ROOT / name, Path(place.name, name)
        if start.is_dir():
            shutil.copytree(
                start, end, ignore=shutil.ignore_patterns("*.pyc"), copy_function=_copied
            )
        else:
            shutil.copy2(start, end)
    return place


def _copied(start: str, end: str) -> None:
    """A file as another; of machine code, which is kept by what it was made from, a link."""
    (os.symlink if start.endswith(_MACHINE_CODE) else shutil.copy2)(start, end)


def _drawn(path: str, number: int) -> Any:
    """The mutant with a number of a file, None beyond the last."""
    from cosmic_ray.commands.init import _all_work_items

    file = Path(_tree().name, path)
    lines = file.read_text("utf-8").split("\n")
    wanted = set(_operators())
    mutants = [item.mutations[0] for item in _all_work_items([file], {})]
    # of an array with one record, [0] and [-1] are the same
    mutants = [
        one for one in mutants
        if one.operator_name in wanted
        and not ("Number" in one.operator_name and _is_first(lines, one.start_pos))
    ]  # fmt: skip
    random.Random(f"{TABLE['seed']} {path}").shuffle(mutants)
    return mutants[number] if number < len(mutants) else None


def _is_first(lines: list[str], start: tuple[int, int]) -> bool:
    """Whether what begins in a line (from 1 on) at a column is the index [0]."""
    line, column = start
    return lines[line - 1][column - 1 : column + 2] == "[0]"


def tried(path: str, number: int) -> Result:
    """Whether the tests of a file see one of its mutants.

    Args:
        path: Of the file, from the root of the repository.
        number: Of the mutant; -1: the file as it is, which has to pass.
    """
    from cosmic_ray.mutating import use_mutation
    from cosmic_ray.plugins import get_operator

    (tests,) = (each["tests"] for each in TABLE["files"] if each["path"] == path)
    file = Path(_tree().name, path)
    plain = re.search(r"^@\w*kernel\b", file.read_text("utf-8"), re.MULTILINE) is not None
    if number < 0:
        if _fail(tests, plain):
            raise RuntimeError(f"{path}: its tests fail without a mutant")
        return {"path": path, "mutant": None}
    mutant = _drawn(path, number)
    if mutant is None:
        return {"path": path, "mutant": None}
    with use_mutation(file, get_operator(mutant.operator_name)(), mutant.occurrence) as texts:
        caught = _fail(tests, plain)
    before, after = (str(text).split("\n") for text in texts)
    (k,) = (k for k, lines in enumerate(zip(before, after, strict=True)) if len({*lines}) > 1)
    change = f"{path}:{mutant.definition_name}: `{before[k].strip()}` -> `{after[k].strip()}`"
    return {"path": path, "mutant": change, "line": k + 1, "caught": caught}


def _fail(tests: Sequence[str], plain: bool) -> bool:
    """Whether any of some tests fails in the copy, kernels as plain Python or compiled."""
    root = Path(_tree().name)
    path = os.pathsep.join(str(root / name) for name in ("", "baselines", "agents"))
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
    environment["NUMBA_DISABLE_JIT"] = str(int(plain))
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    try:
        code = subprocess.run(
            command, cwd=root, env=environment, timeout=_LONGEST_S, check=False,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        ).returncode  # fmt: skip
    except subprocess.TimeoutExpired:
        return True
    if code not in (0, 1, 2):  # 2: the mutant cannot be imported
        raise RuntimeError(f"pytest ended with {code}: {' '.join(tests)}")
    return code != 0


def trials(quick: bool) -> list[Trial]:
    """Each file as it is, and mutants of it."""
    n = 2 if quick else TABLE["mutants_of_a_file"]
    return [
        Trial(f"{each['path']} {number}", tried, (each["path"], number))
        for each in TABLE["files"]
        for number in range(-1, n)
    ]


def finding(results: Mapping[str, Result]) -> Finding:
    """A mutant that no test sees has failed, unless it was read and does the same."""
    good = [one for one in results.values() if one.get("mutant")]
    equivalent = {each["mutant"]: each["why"] for each in TABLE["equivalent"]}
    rows: list[list[Any]] = []
    said: list[str] = []
    for path in dict.fromkeys(one["path"] for one in good):
        mine = [one for one in good if one["path"] == path]
        left = [one["mutant"] for one in mine if not one["caught"]]
        same = sum(mutant in equivalent for mutant in left)
        rows.append([f"`{path}`", *_counted(len(mine), len(mine) - len(left), same)])
        said += [f"- the same: {each}: {equivalent[each]}" for each in left if each in equivalent]
        said += [f"- not caught: {each}" for each in left if each not in equivalent]
    all_of, caught, same = (sum(int(row[k]) for row in rows) for k in range(1, 4))
    if rows:
        rows.append(["all", *_counted(all_of, caught, same)])
    headings = ("file", "mutants", "caught", "the same", "not caught", "caught of the others")
    broken = len(errors(results))
    table = "\n".join([markdown(headings, rows), "", *said])
    return Finding(all_of + broken, all_of - caught - same + broken, table.rstrip())


def _counted(mutants: int, caught: int, same: int) -> list[Any]:
    """Cells of a line of the table."""
    others = max(mutants - same, 1)
    return [mutants, caught, same, mutants - caught - same, f"{caught / others:.0%}"]


ROW = Row(
    "R13",
    "Mutants of the files that keep UAS safe",
    "mutants",
    "a test that `benchmarks/mutants.toml` names for the file fails; a mutant that was read and "
    f"does the same does not count. {LEAST_SHARE:.0%} are to be caught",
    trials,
    finding,
    lambda quick: (
        f"{2 if quick else TABLE['mutants_of_a_file']} mutants of a file, drawn with seed "
        f"{TABLE['seed']} from those of Cosmic Ray's operators that swap + and -, * and /, "
        "comparisons, `and` and `or`, truth values, `break` and `continue`, drop a sign or a "
        "`not`, and add 1 to a number or take it away"
    ),
    "Other files, and tests that are not named for a file but might see its mutants. Tests were "
    "written for survivors of this draw, so that of another one fewer are caught. On demand: "
    "needs the extra `mutants`, and takes hours.",
)

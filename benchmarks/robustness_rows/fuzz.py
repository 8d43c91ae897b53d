"""R9: damaged files of every kind that is read: taken, or refused in one line."""

from __future__ import annotations

import contextlib
import io
import re
import signal
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np
from uas_coverage_agents.policy import load_policy
from uas_coverage_agents.training.settings import FOLDER, settings_of
from uas_coverage_agents.velocity.planner import SHIPPED

from robustness_rows.row import Finding, Result, Row, Trial, errors, markdown
from uas_coverage_env import generate_scenario, rollout
from uas_coverage_env.cli import main
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight

FIRST_SEED = 10_000
FILES_OF_A_TRIAL = 25
_LONGEST_CPU_S = 30.0
_NUMBER = re.compile(rb"-?\d+\.?\d*(?:e-?\d+)?")
_VALUES = (
    b"nan", b"inf", b"-1", b"0", b"1e308", b"1e-308", b"10000000000000000000000", b"true", b'"x"',
    b"[]", b"{}", b"1979-05-27", b"-0.0", b"null", b"1e9999", b"[[[]]]", b"0.5", b"''", b"2.5",
)  # fmt: skip

Rng = np.random.Generator


class TooLongError(Exception):
    """A file has kept the processor busy for too long."""


@contextlib.contextmanager
def limited() -> Iterator[None]:
    """End what takes more processor time than any file should."""

    def stop(number: int, frame: object) -> None:
        raise TooLongError(f"more than {_LONGEST_CPU_S:g} s of processor time")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, _LONGEST_CPU_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def _number(rng: Rng, text: bytes) -> bytes:
    found = list(_NUMBER.finditer(text))
    if not found:
        return text
    one = found[int(rng.integers(len(found)))]
    return text[: one.start()] + _VALUES[int(rng.integers(len(_VALUES)))] + text[one.end() :]


def _lines(rng: Rng, text: bytes) -> bytes:
    lines = text.split(b"\n")
    a, b = (int(k) for k in rng.integers(len(lines), size=2))
    match int(rng.integers(3)):
        case 0:
            del lines[a]
        case 1:
            lines.insert(a, lines[b])
        case _:
            lines[a], lines[b] = lines[b], lines[a]
    return b"\n".join(lines)


def _bytes(rng: Rng, text: bytes) -> bytes:
    damaged = bytearray(text)
    for place in rng.integers(len(damaged), size=int(rng.integers(1, 9))):
        damaged[int(place)] = int(rng.integers(256))
    return bytes(damaged)


def _cut(rng: Rng, text: bytes) -> bytes:
    return text[: int(rng.integers(len(text)))]


def _word(rng: Rng, text: bytes) -> bytes:
    words = list(re.finditer(rb"[A-Za-z_]{3,}", text))
    one, other = (words[int(k)] for k in rng.integers(len(words), size=2)) if words else (None,) * 2
    if one is None or other is None:
        return text
    return text[: one.start()] + other.group() + text[one.end() :]


def damaged(rng: Rng, text: bytes) -> bytes:
    """The file with one to three things wrong."""
    ways = (_number, _number, _lines, _bytes, _cut, _word)
    for _ in range(int(rng.integers(1, 4))):
        text = ways[int(rng.integers(len(ways)))](rng, text) or b"\n"
    return text


def _command(*arguments: str) -> str:
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(list(arguments))
    if code == 2:
        said = err.getvalue()
        one_line = said.startswith("error: ") and said.count("\n") == 1
        return "refused" if one_line else f"refused in {said.count(chr(10))} lines"
    return "taken" if code in (0, 1) else f"exit code {code}"


def _reading(read: Callable[[Path], object], folder: Path) -> str:
    try:
        read(folder)
    except InputError as error:
        return "refused" if "\n" not in str(error) else "refused in several lines"
    return "taken"


def _toml(source: str, package: str, *arguments: str) -> Callable[[Rng, Path], str]:
    def tried(rng: Rng, folder: Path) -> str:
        path = folder / "file.toml"
        path.write_bytes(damaged(rng, files(package).joinpath(source).read_bytes()))
        return _command(*(text.format(folder=folder) for text in arguments), str(path))

    return tried


@cache
def _flight_files() -> Mapping[str, bytes]:
    """Of a flight that is flown once in a process."""
    town = generate_scenario(1, n_uas=2, n_waypoints=4, n_obstacles=2)
    with tempfile.TemporaryDirectory() as folder:
        rollout(town, "nearest-waypoint", max_steps=12).save(Path(folder))
        return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


@cache
def _policy_files() -> Mapping[str, bytes]:
    return {path.name: path.read_bytes() for path in SHIPPED.iterdir() if path.is_file()}


def _flight(rng: Rng, folder: Path) -> str:
    return _directory(rng, folder, _flight_files(), Flight.load)


def _policy(rng: Rng, folder: Path) -> str:
    return _directory(rng, folder, _policy_files(), load_policy)


def _config(rng: Rng, folder: Path) -> str:
    every = sorted(FOLDER.glob("*.toml"))
    whole = every[int(rng.integers(len(every)))]
    path = folder / "file.toml"
    path.write_bytes(damaged(rng, whole.read_bytes()))
    return _reading(lambda path: settings_of(str(path)), path)


def _directory(
    rng: Rng, folder: Path, contents: Mapping[str, bytes], read: Callable[[Path], object]
) -> str:
    whole = folder / "whole"
    whole.mkdir()
    for name, content in contents.items():
        (whole / name).write_bytes(content)
    paths = sorted(whole.iterdir())
    path = paths[int(rng.integers(len(paths)))]
    if rng.random() < 0.1:
        path.unlink()
    else:
        path.write_bytes(damaged(rng, path.read_bytes()))
    return _reading(read, whole)


_CHECK = ("scenario", "check", "--picture", "{folder}/map.png")
_SCENARIOS = ("village", "open_field", "corridor")
KINDS: Mapping[str, Callable[[Rng, Path], str]] = {
    **{
        f"scenario {name}": _toml(f"{name}.toml", "uas_coverage_env.scenario", *_CHECK)
        for name in _SCENARIOS
    },
    "vehicle": _toml("s500_v2.toml", "uas_coverage_env.vehicle", "vehicle", "check"),
    "flight directory": _flight,
    "policy directory": _policy,
    "training configuration": _config,
}
"""Kind of file -> damage one and read it: what became of it."""


def try_files(kind: str, seed: int) -> Result:
    """Some damaged files of a kind: what became of each, and the first few failures."""
    tally: Counter[str] = Counter()
    failures = []
    for number in range(FILES_OF_A_TRIAL):
        rng = np.random.default_rng([seed, number])
        with tempfile.TemporaryDirectory() as folder:
            try:
                with limited():
                    outcome = KINDS[kind](rng, Path(folder))
            except Exception as error:  # whatever gets here would be a traceback
                outcome = f"{type(error).__name__}: {error}"[:200]
        tally[outcome if outcome in ("taken", "refused") else "failed"] += 1
        if outcome not in ("taken", "refused"):
            failures.append(f"{seed} {number}: {outcome}")
    return {"kind": kind, "tally": dict(tally), "failures": failures}


def trials(quick: bool) -> list[Trial]:
    """Some seeds of every kind."""
    return [
        Trial(f"{kind} {seed}", try_files, (kind, seed))
        for seed in range(FIRST_SEED, FIRST_SEED + (3 if quick else 350))
        for kind in KINDS
    ]


def finding(results: Mapping[str, Result]) -> Finding:
    """Per kind, what became of the files."""
    cells: dict[str, Counter[str]] = defaultdict(Counter)
    failures = [text for result in results.values() for text in result.get("failures", ())]
    for result in results.values():
        if "error" not in result:
            cells[result["kind"]].update(result["tally"])
    names = ("taken", "refused", "failed")
    rows = [
        (kind, sum(tally.values()), *(tally[n] for n in names)) for kind, tally in cells.items()
    ]
    table = markdown(("kind", "files", *names), rows)
    if failures:
        table += "\n\nFailures (seed, number):\n\n" + "\n".join(f"- {text}" for text in failures)
    tried = sum(sum(tally.values()) for tally in cells.values())
    return Finding(tried, len(failures) + len(errors(results)), table)


ROW = Row(
    "R9",
    "Damaged files",
    "files",
    "taken, or refused by one line and exit code 2; no traceback, and no more than "
    f"{_LONGEST_CPU_S:g} s of processor time",
    trials,
    finding,
    lambda quick: (
        f"{FILES_OF_A_TRIAL} files of every seed from {FIRST_SEED} on: one to three of a "
        "number, line, word, byte or the end changed"
    ),
    "Checkpoints, comparison stores, imported areas, links and devices in "
    "place of files (their tests are in `tests/files` and `tests/cli`), and memory.",
)

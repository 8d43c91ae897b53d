"""Fly everything that is published, from one commit, and fill the pages with it.

    python benchmarks/publish.py --list                what there is, and how long it takes
    python benchmarks/publish.py --out night           all of it, on two cores
    python benchmarks/publish.py --out hour --quick    fewer missions and seeds
    python benchmarks/publish.py --out part --only test,karhula

`published.toml` has the commands. They run in `--out`/checkout, a clone of the commit that is
checked out, so that one may go on working; the same command goes on where it was stopped. When all
is flown the pages are filled there, and they and `docs/published.json` (each table with its
command, and the commit, versions and machine) are copied here; with `--quick` or `--only` nothing
is copied. What a command says and no table has is in `--out`/NAME.txt, and the lines of pages which
name that command are listed to be read.

Exits 1 where a command failed, 2 where the input is bad, 130 where it was stopped.
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer
from marks import ROOT, filled, pages, places
from pydantic import Field

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.files.strict_toml import StrictModel, read_toml
from uas_coverage_env.files.suggestions import check_choice
from uas_coverage_env.leaderboard.hardware import machine, versions

FIGURES = Path(__file__).with_name("published.toml")
RESULTS = Path("docs") / "published.json"
STOPPED = 130
_EMPTY = "(not filled yet)"


class Figures(StrictModel):
    """Figures that one command makes."""

    command: str
    """`{out}` is a folder of its own, `{jobs}` the processes side by side (else it uses one)."""
    minutes: float = Field(gt=0.0)
    """On two quiet cores."""
    quick: str = ""
    """The command of `--quick`; default: the same."""
    fill: tuple[str, ...] = ()
    """Commands that fill pages from `{out}`; `{command}` is the one above, `{checkout}` a folder.
    Default: what the command writes to stdout goes between its only mark."""
    marks: tuple[str, ...] = ()
    """Between which it stands on pages."""
    alone: bool = False
    """It measures time: nothing else runs beside it."""
    gpu: bool = False
    """It needs one: without, the page keeps what it has, with its machine and date."""


class Published(StrictModel):
    """All figures, by name."""

    figures: dict[str, Figures]


def figures_in(path: Path = FIGURES) -> dict[str, Figures]:
    """What is published.

    Raises:
        InputError: The file is not as it should be.
    """
    return read_toml(path, Published).figures


class Checkout:
    """A clone of one commit, in which everything runs, and what came of it."""

    def __init__(self, out: Path, source: Path) -> None:
        """Make the clone, or find it.

        Raises:
            InputError: What is to be flown is not committed.
        """
        self.out = out.resolve()
        self.folder = self.out / "checkout"
        if not self.folder.exists():
            changed = _git(source, "status", "--porcelain", "--untracked-files=no")
            if changed:
                raise InputError(
                    f"{changed.split()[1]}: is changed; commit it, since only what is committed "
                    "is flown"
                )
            self.out.mkdir(parents=True, exist_ok=True)
            _git(source, "clone", "--quiet", "--no-hardlinks", str(source), str(self.folder))
        self.commit = _git(self.folder, "rev-parse", "HEAD")

    def run(self, command: str, log: Path) -> int:
        """Run a command in `out`, by this checkout; its exit code. Its outputs go to files."""
        rooms = (self.folder, *(self.folder / room for room in ("baselines", "agents")))
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(map(str, rooms)),
            "OMP_NUM_THREADS": "1",
        }
        program, *words = shlex.split(command)
        if program == "python":
            words[0] = str(self.folder / words[0])
        else:
            words[:0] = ["-m", "uas_coverage_env"]
        with log.open("wb") as stdout, log.with_suffix(".log").open("ab") as stderr:
            return subprocess.run(
                [sys.executable, *words],
                cwd=self.out,
                env=environment,
                stdout=stdout,
                stderr=stderr,
                check=False,
            ).returncode

    def fly(self, name: str, figures: Figures, quick: bool, jobs: int) -> bool:
        """Make some figures, if they are not there; whether they are there now."""
        command = self.command(name, figures, quick, jobs)
        if self.flown(name, command):
            return True
        sys.stderr.write(f"{name}: some {figures.minutes:g} minutes; {self.out / name}.log\n")
        began_s = time.monotonic()
        code = self.run(command, self.out / f"{name}.txt")
        if code:
            sys.stderr.write(f"error: {name}: ended with {code}; see {self.out / name}.log\n")
            return False
        done = {
            "command": command,
            "minutes": round((time.monotonic() - began_s) / 60.0, 1),
            "finished_at": datetime.now(UTC).isoformat(timespec="seconds"),
        }
        write_atomically(self.out / f"{name}.json", json.dumps(done, indent=2).encode())
        sys.stderr.write(f"{name}: took {done['minutes']:.0f} minutes\n")
        return True

    @staticmethod
    def command(name: str, figures: Figures, quick: bool, jobs: int) -> str:
        """The command that makes some figures here."""
        command = (figures.quick or figures.command) if quick else figures.command
        return command.format(out=name, jobs=jobs)

    def flown(self, name: str, command: str) -> bool:
        """Whether a command has ended well in this checkout."""
        path = self.out / f"{name}.json"
        return path.exists() and json.loads(path.read_text("utf-8"))["command"] == command

    def fill(self, flown: dict[str, Figures], quick: bool) -> None:
        """Fill the pages of the checkout, and write the file of results.

        Raises:
            InputError: A page cannot be filled.
        """
        tables = {}
        for name, figures in flown.items():
            done = json.loads((self.out / f"{name}.json").read_text("utf-8"))
            for page, mark, _ in self._places(figures):
                _put(page, mark, _EMPTY)
            self._fill(name, figures, done["command"])
            for page, mark, text in self._places(figures):
                if text == _EMPTY:
                    raise InputError(f"{name}: has not filled <!-- {mark} --> of {page.name}")
                where = f"{page.relative_to(self.folder).as_posix()}: {mark}"
                tables[where] = {"figures": name, **done, "text": text}
        results = {
            "commit": self.commit,
            "quick": quick,
            "versions": versions(),
            "machine": machine(),
            "tables": tables,
        }
        path = self.folder / RESULTS
        path.parent.mkdir(exist_ok=True)
        path.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n", "utf-8")

    def _places(self, figures: Figures) -> list[tuple[Path, str, str]]:
        return [place for place in places(self.folder) if place[1] in figures.marks]

    def _fill(self, name: str, figures: Figures, command: str) -> None:
        log = self.out / f"{name}.fill.txt"
        for fill in figures.fill:
            words = fill.format(out=name, command=command, checkout=self.folder)
            if self.run(words, log):
                raise InputError(f"{name}: `{words}` failed; see {log.with_suffix('.log')}")
        if not figures.fill:
            written = (self.out / f"{name}.txt").read_text("utf-8")
            for page, mark, _ in self._places(figures):
                _put(page, mark, f"`{command}`\n\n{written.strip()}")

    def copy_to(self, root: Path) -> list[str]:
        """Copy what was filled; the files."""
        lines = _git(self.folder, "status", "--porcelain", "--untracked-files=all").splitlines()
        names = [line.strip().split(maxsplit=1)[1] for line in lines]
        for name in names:
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(self.folder / name, root / name)
        return names


def fly_all(
    checkout: Checkout, wanted: dict[str, Figures], quick: bool, jobs: int
) -> dict[str, Figures]:
    """Make all figures that are asked for; those that are there."""

    def fly(name: str) -> bool:
        return checkout.fly(name, wanted[name], quick, jobs)

    def chosen(is_of: Callable[[Figures], bool]) -> list[str]:
        return [name for name, figures in wanted.items() if is_of(figures)]

    there = {}
    for name in chosen(lambda one: not one.alone and "{jobs}" in one.command):
        there[name] = fly(name)
    one_core = chosen(lambda one: not one.alone and "{jobs}" not in one.command)
    with ThreadPoolExecutor(jobs) as pool:
        there |= dict(zip(one_core, pool.map(fly, one_core), strict=True))
    for name in chosen(lambda one: one.alone):
        there[name] = fly(name)
    return {name: figures for name, figures in wanted.items() if there[name]}


def lines_that_name(figures: Iterable[Figures], root: Path) -> list[str]:
    """Lines outside of marks that give figures of some commands: a reader compares them."""
    found = []
    commands = [one.command.partition(" --out")[0] for one in figures]
    for page in pages(root):
        text = page.read_text("utf-8")
        for _, _, between in (each for each in places(root) if each[0] == page):
            text = text.replace(between, "\n" * between.count("\n"))
        for number, line in enumerate(text.splitlines(), start=1):
            if any(f"`{command}" in line for command in commands):
                found.append(f"{page.relative_to(root)}:{number}")
    return found


def main(
    out: Annotated[Path | None, typer.Option(help="Keeps what was flown.")] = None,
    only: Annotated[str, typer.Option(help="Some figures, by name.")] = "",
    quick: Annotated[bool, typer.Option("--quick", help="Fewer missions and seeds.")] = False,
    jobs: Annotated[int, typer.Option(min=1, help="Processes side by side.")] = 2,
    listed: Annotated[bool, typer.Option("--list", help="Only say what there is.")] = False,
) -> None:
    """Fly, fill and copy."""
    wanted = figures_in()
    for name in filter(None, only.split(",")):
        check_choice("--only", name, wanted)
    if only:
        wanted = {name: wanted[name] for name in only.split(",")}
    if listed:
        for name, one in wanted.items():
            sys.stdout.write(f"{one.minutes:6g} min  {name:24} {one.command}\n")
        total = sum(one.minutes / (1 if one.alone or "{jobs}" in one.command else 2)
                    for one in wanted.values())  # fmt: skip
        sys.stdout.write(f"{total / 60.0:6.1f} h    all, on two quiet cores\n")
        return
    if out is None:
        raise InputError("--out: is missing; name a folder")
    checkout = Checkout(out, ROOT)
    there = fly_all(checkout, wanted, quick, jobs)
    if len(there) < len(wanted):
        raise typer.Exit(1)
    checkout.fill(there, quick)
    copied = [] if quick or only else checkout.copy_to(ROOT)
    for name in copied or [f"{checkout.folder / RESULTS}"]:
        sys.stdout.write(f"{name}\n")
    for line in lines_that_name(there.values(), ROOT):
        sys.stdout.write(f"to be read: {line}\n")


def _put(page: Path, mark: str, content: str) -> None:
    page.write_text(filled(page.read_text("utf-8"), content, mark), encoding="utf-8")


def _git(folder: Path, *words: str) -> str:
    run = subprocess.run(
        ["git", "-C", str(folder), *words],
        check=False,
        capture_output=True,
        text=True,
    )
    if run.returncode:
        raise InputError(f"git {words[0]}: {run.stderr.strip() or 'failed'}")
    return run.stdout.rstrip()


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(main)
    try:
        app()
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(STOPPED)

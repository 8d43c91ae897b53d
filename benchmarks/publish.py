"""Fly everything that is published, from one commit, and fill the pages with it.

    python benchmarks/publish.py --list                what there is, and how long it takes
    python benchmarks/publish.py --out night           all of it, on two cores
    python benchmarks/publish.py --out hour --quick    fewer missions and seeds
    python benchmarks/publish.py --out part --only test,karhula

`published.toml` has the commands. They run in `--out`/checkout, a clone of the commit that is
checked out, so that one may go on working. What a command has made is put on the pages at once, and
into `docs/published.json`: each table with its command, and the commit, versions and machine.
Commit both now and then: **what that file has is not flown again**, and the rest is flown from its
commit, in another session, from another clone, on another machine. `--anew` begins again, from the
commit that is checked out. `--quick` fills pages and file in `--out`/checkout alone. What a command
says and no table has is in the file, too, and the lines of pages which name that command are listed
to be read.

Exits 1 where a command failed, 2 where the input is bad, 130 where it was stopped.
"""

from __future__ import annotations

import hashlib
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
from glob import glob
from pathlib import Path
from threading import Lock
from typing import Annotated, Any

import typer
from marks import ROOT, filled, markdown, marks_on, pages, places
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
    """On quiet cores: two where it has `{jobs}`, else one."""
    quick: str = ""
    """The command of `--quick`; default: the same."""
    fill: tuple[str, ...] = ()
    """Commands that fill pages from `{out}`; `{command}` is the one above, `{checkout}` a folder,
    and `*` is as in a shell. Default: what the command
    writes to stdout goes between its only mark."""
    marks: tuple[str, ...] = ()
    """Between which it stands on pages."""
    alone: bool = False
    """It measures time: nothing else runs beside it."""
    elsewhere: bool = False
    """It needs what not every machine has: a GPU, libraries of others, another release. It is made
    where `--only` names it; else the page keeps what it has, and says where that was."""

    def source(self, quick: bool) -> str:
        """The command as it is written down, with its placeholders."""
        return (self.quick or self.command) if quick else self.command

    def on_two_cores(self) -> float:
        """What two cores take, with others beside it [min]."""
        return self.minutes / (1 if self.alone or "{jobs}" in self.command else 2)


class Published(StrictModel):
    """All figures, by name."""

    figures: dict[str, Figures]


def figures_in(path: Path = FIGURES) -> dict[str, Figures]:
    """What is published.

    Raises:
        InputError: The file is not as it should be.
    """
    return read_toml(path, Published).figures


class Results:
    """What was made of one commit, in a file: it is read where it is there.

    Args:
        root: Of the project whose pages and `docs/published.json` it fills.
        quick: Whether fewer missions are flown.
    """

    def __init__(self, root: Path, quick: bool) -> None:
        self.root, self.quick = root, quick
        self.path = root / RESULTS
        self.kept: dict[str, Any] = {"commit": "", "quick": quick, "files": {}, "figures": {}}
        if self.path.exists():
            self.kept = json.loads(self.path.read_text("utf-8"))

    def has(self, name: str, figures: Figures) -> bool:
        """Whether some figures are there, by the command that is asked for now."""
        source = self.kept["figures"].get(name, {}).get("source")
        return source == figures.source(self.quick)

    def add(self, name: str, made: dict[str, Any], files: dict[str, bytes]) -> None:
        """Put figures on the pages and into the file.

        Args:
            name: Of the figures.
            made: What is kept of them; `tables` go to the pages.
            files: Other files that they made, by their names in the project.

        Raises:
            InputError: A page lacks a mark.
        """
        for where, text in made["tables"].items():
            page, _, mark = where.partition(": ")
            _put(self.root / page, mark, text)
        for path, content in files.items():
            (self.root / path).parent.mkdir(parents=True, exist_ok=True)
            (self.root / path).write_bytes(content)
            self.kept["files"][path] = hashlib.sha256(content).hexdigest()
        self.kept["figures"][name] = made
        self.kept["figures"] = dict(sorted(self.kept["figures"].items()))
        text = json.dumps(self.kept, indent=1, ensure_ascii=False)
        write_atomically(self.path, f"{text}\n".encode())


class Checkout:
    """A clone of one commit, in which everything runs, and what came of it.

    Args:
        out: Where it is, beside what is flown.
        source: What is cloned, at the commit of `docs/published.json` or, without, its own.
        quick: Fly fewer missions.
        jobs: Processes side by side.
        anew: Leave aside what `docs/published.json` has.

    Raises:
        InputError: What is to be flown is not committed, or `out` has another commit.
    """

    def __init__(self, out: Path, source: Path, quick: bool, jobs: int, anew: bool = False) -> None:
        self.out, self.quick, self.jobs = out.resolve(), quick, jobs
        self.folder = self.out / "checkout"
        wanted = "" if quick or anew else Results(source, quick).kept["commit"]
        if anew and self.folder.exists():
            raise InputError(f"--anew: {out} has flights of a commit; name another folder")
        if not self.folder.exists():
            self._clone(source, wanted)
        self.commit = _git(self.folder, "rev-parse", "HEAD")
        if wanted and wanted != self.commit:
            raise InputError(
                f"--out: {out} has flights of {self.commit[:8]}, and {RESULTS.as_posix()} of "
                f"{wanted[:8]}; name another folder"
            )
        self.results = Results(self.folder if quick else source, quick)
        if self.results.kept["commit"] != self.commit:
            self.results.kept = {"commit": self.commit, "quick": quick, "files": {}, "figures": {}}
        for name in self.results.kept["files"]:
            if not quick:  # what later figures add to
                shutil.copyfile(source / name, self.folder / name)
        self._one_at_a_time = Lock()

    def _clone(self, source: Path, commit: str) -> None:
        known = commit and _is_known(source, commit)
        if commit and not known:
            raise InputError(
                f"{RESULTS.as_posix()}: is of {commit[:8]}, which is not in the history of what is "
                "checked out; fetch all of it, or begin again with --anew"
            )
        changed = _git(source, "status", "--porcelain", "--untracked-files=no")
        if changed and not commit:
            raise InputError(
                f"{changed.split()[1]}: is changed; commit it, since only what is committed is "
                "flown"
            )
        self.out.mkdir(parents=True, exist_ok=True)
        _git(source, "clone", "--quiet", "--no-hardlinks", str(source), str(self.folder))
        if commit:
            _git(self.folder, "checkout", "--quiet", commit)

    def run(self, command: str, log: Path) -> tuple[int, float | None]:
        """Run a command in `out`, by this checkout. Its outputs go to files.

        Returns:
            Its exit code, and the processor time it took [s], where the system tells.
        """
        rooms = (self.folder, *(self.folder / room for room in ("baselines", "agents")))
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(map(str, rooms)),
            "OMP_NUM_THREADS": "1",
            "COLUMNS": "400",  # no cell of a table is broken
        }
        program, *words = shlex.split(command)
        words = [each for word in words for each in self._expanded(word)]
        if program == "python":
            words[0] = str(self.folder / words[0])
        else:
            words[:0] = ["-m", "uas_coverage_env"]
        with (
            log.open("wb") as stdout,
            log.with_suffix(".log").open("ab") as stderr,
            subprocess.Popen(
                [sys.executable, *words],
                cwd=self.out,
                env=environment,
                stdout=stdout,
                stderr=stderr,
            ) as process,
        ):
            if not hasattr(os, "wait4"):  # Windows
                return process.wait(), None
            _, status, spent = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        return process.returncode, spent.ru_utime + spent.ru_stime

    def _expanded(self, word: str) -> list[str]:
        """The files and folders for which a word with a star stands, as in a shell."""
        return (sorted(glob(word, root_dir=self.out)) if "*" in word else []) or [word]

    def make(self, name: str, figures: Figures) -> bool:
        """Make some figures and publish them, if they are not there; whether they are there now."""
        if self.results.has(name, figures):
            return True
        if not self._flown(name, figures) and not self._fly(name, figures):
            return False
        try:
            with self._one_at_a_time:
                self._publish(name, figures)
        except InputError as error:
            sys.stderr.write(f"error: {error}\n")
            return False
        return True

    def _fly(self, name: str, figures: Figures) -> bool:
        sys.stderr.write(f"{name}: some {figures.minutes:g} minutes; {self.out / name}.log\n")
        began_s = time.monotonic()
        command = self._command(name, figures)
        asked = self.out / f"{name}.asked"
        source = figures.source(self.quick)
        if asked.exists() and asked.read_text("utf-8") != source:
            shutil.rmtree(self.out / name, ignore_errors=True)  # begun by another command
        asked.write_text(source, "utf-8")
        code, spent_s = self.run(command, self.out / f"{name}.txt")
        if code:
            sys.stderr.write(f"error: {name}: ended with {code}; see {self.out / name}.log\n")
            return False
        done = {
            "source": source,
            "command": command,
            "minutes": round((time.monotonic() - began_s) / 60.0, 1),
            "processor_minutes": None if spent_s is None else round(spent_s / 60.0, 2),
            "finished_at": datetime.now(UTC).isoformat(timespec="seconds"),
            "versions": versions(),
            "machine": machine(),
        }
        write_atomically(self.out / f"{name}.json", json.dumps(done, indent=2).encode())
        sys.stderr.write(
            f"{name}: took {done['minutes']} minutes, {done['processor_minutes']} of a processor\n"
        )
        return True

    def _command(self, name: str, figures: Figures) -> str:
        return figures.source(self.quick).format(out=name, jobs=self.jobs)

    def _flown(self, name: str, figures: Figures) -> bool:
        path = self.out / f"{name}.json"
        if not path.exists():
            return False
        return json.loads(path.read_text("utf-8"))["source"] == figures.source(self.quick)

    def _publish(self, name: str, figures: Figures) -> None:
        done = json.loads((self.out / f"{name}.json").read_text("utf-8"))
        tables = {}
        for page, mark, _ in self._places(figures):
            _put(page, mark, _EMPTY)
        self._fill(name, figures, done["command"])
        for page, mark, text in self._places(figures):
            if text == _EMPTY:
                raise InputError(f"{name}: has not filled <!-- {mark} --> of {page.name}")
            tables[f"{page.relative_to(self.folder).as_posix()}: {mark}"] = text
        text = "" if tables else (self.out / f"{name}.txt").read_text("utf-8").strip()
        self.results.add(name, {**done, "tables": tables, "text": text}, self._other_files())

    def _places(self, figures: Figures) -> list[tuple[Path, str, str]]:
        return [place for place in places(self.folder) if place[1] in figures.marks]

    def _fill(self, name: str, figures: Figures, command: str) -> None:
        log = self.out / f"{name}.fill.txt"
        for fill in figures.fill:
            words = fill.format(out=name, command=command, checkout=self.folder)
            if self.run(words, log)[0]:
                raise InputError(f"{name}: `{words}` failed; see {log.with_suffix('.log')}")
        if not figures.fill:
            written = (self.out / f"{name}.txt").read_text("utf-8")
            for page, mark, _ in self._places(figures):
                _put(page, mark, f"`{command}`\n\n{markdown(written)}")

    def _other_files(self) -> dict[str, bytes]:
        """What has changed in the checkout, but for tables between marks."""
        lines = _git(self.folder, "status", "--porcelain", "--untracked-files=all").splitlines()
        paths = [self.folder / line.strip().split(maxsplit=1)[1] for line in lines]
        filled_in = {page for page in pages(self.folder) if marks_on(page.read_text("utf-8"))}
        return {
            path.relative_to(self.folder).as_posix(): path.read_bytes()
            for path in paths
            if path not in filled_in and path != self.folder / RESULTS
        }


def make_all(checkout: Checkout, wanted: dict[str, Figures]) -> dict[str, Figures]:
    """Make all figures that are asked for; those that are there."""

    def make(name: str) -> bool:
        return checkout.make(name, wanted[name])

    def chosen(is_of: Callable[[Figures], bool]) -> list[str]:
        return [name for name, figures in wanted.items() if is_of(figures)]

    there = {}
    for name in chosen(lambda one: not one.alone and "{jobs}" in one.command):
        there[name] = make(name)
    one_core = chosen(lambda one: not one.alone and "{jobs}" not in one.command)
    with ThreadPoolExecutor(checkout.jobs) as pool:
        there |= dict(zip(one_core, pool.map(make, one_core), strict=True))
    for name in chosen(lambda one: one.alone):
        there[name] = make(name)
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
            if any(command in line for command in commands):
                found.append(f"{page.relative_to(root)}:{number}")
    return found


def main(
    out: Annotated[Path | None, typer.Option(help="Keeps what was flown.")] = None,
    only: Annotated[str, typer.Option(help="Some figures, by name.")] = "",
    quick: Annotated[bool, typer.Option("--quick", help="Fewer missions and seeds.")] = False,
    jobs: Annotated[int, typer.Option(min=1, help="Processes side by side.")] = 2,
    anew: Annotated[
        bool, typer.Option("--anew", help="Fly what docs/published.json has, too.")
    ] = False,
    listed: Annotated[bool, typer.Option("--list", help="Only say what there is.")] = False,
) -> None:
    """Fly and publish."""
    wanted = figures_in()
    for name in filter(None, only.split(",")):
        check_choice("--only", name, wanted)
    if only:
        wanted = {name: wanted[name] for name in only.split(",")}
    else:
        wanted = {name: one for name, one in wanted.items() if not one.elsewhere}
    if listed:
        there = Results(ROOT, quick=False)
        for name, one in wanted.items():
            done = "there" if there.has(name, one) else ""
            sys.stdout.write(f"{one.minutes:6g} min  {done:6}{name:24} {one.command}\n")
        for what, some in (
            ("all", wanted.values()),
            ("left", [one for name, one in wanted.items() if not there.has(name, one)]),
        ):
            hours = sum(one.on_two_cores() for one in some) / 60.0
            sys.stdout.write(f"{hours:6.1f} h    {what}, on two quiet cores\n")
        return
    if out is None:
        raise InputError("--out: is missing; name a folder")
    checkout = Checkout(out, ROOT, quick, jobs, anew)
    there = make_all(checkout, wanted)
    sys.stdout.write(f"{checkout.results.path}\n")
    for line in lines_that_name(there.values(), ROOT):
        sys.stdout.write(f"to be read: {line}\n")
    if len(there) < len(wanted):
        raise typer.Exit(1)


def _put(page: Path, mark: str, content: str) -> None:
    try:
        text = filled(page.read_text("utf-8"), content, mark)
    except (OSError, ValueError) as error:
        raise InputError(f"{page.name}: {error}") from error
    page.write_text(text, encoding="utf-8")


def _is_known(folder: Path, commit: str) -> bool:
    """Whether a commit is in the history of what is checked out."""
    words = ["git", "-C", str(folder), "merge-base", "--is-ancestor", commit, "HEAD"]
    return subprocess.run(words, check=False, capture_output=True).returncode == 0


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

"""Agent-steps per second and peak memory, beside other libraries' environments, in one run.

    python benchmarks/throughput.py                          ours alone
    python benchmarks/throughput.py --peers all --cache DIR  beside mpe2, VMAS and JaxMARL
    python benchmarks/throughput.py --against PYTHON --drawn beside another version of ours
    python benchmarks/throughput.py --threads 1,2 --json FILE
    python benchmarks/throughput.py --profile                where the time of our step goes

Each environment is a process of its own (`throughput_case.py`). They take turns, so that whatever
else the machine does meets all of them alike; ratios are taken turn by turn. Peers come from PyPI
into virtual environments of their own, made where they are missing. The models differ (a peer's
step is a point mass in the plane over 0.1 s; ours two UAS with battery, 49 waypoints and 11
obstacles over 1 s): the ratios say what a learner waits for, not who computes better.
"""

import json
import shutil
import statistics
import subprocess
import sys
import venv
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

CASE_PROGRAM = Path(__file__).with_name("throughput_case.py")

PEERS = {
    "mpe2": ("mpe2==1.1.1", "pettingzoo==1.27.0"),
    "vmas": ("vmas==1.5.2",),
    "jaxmarl": ("jaxmarl==0.2.0",),
}
"""What pip installs for each."""

VECTOR_PEERS = ("vmas", "jaxmarl")

AGAINST = "against"
"""In place of the name of a library: ours as another interpreter has it."""

DRAWN = ("generated", "streets", "hard", "own-scenes")
"""Cases of missions that are drawn, `hard` with its assistants, measured with DRAWN_ENVS each."""

DRAWN_ENVS = 1024

PROFILED, STEPS_A_TURN = 256, 40
"""Missions of `--profile`, unless one number is given, and how many of their steps a turn is."""

SYNC_ENVS = 64
"""So many single environments stand for the naive way, `SyncVectorEnv`."""

DEFAULT_CACHE = Path(typer.get_app_dir("uas-coverage")) / "peers"

console = Console(width=160)


@dataclass
class Case:
    """One environment, and what it did in each of its turns.

    Attributes:
        name: A case of `throughput_case.py`.
        num_envs: How many in one.
        threads: How many it may use.
        peer: The library; None: ours.
        rates: Agent-steps per second, turn by turn.
        row_rates: Rows per second: also those of UAS that are lost or home.
        peak_mb: Largest memory of its process so far [MB].
    """

    name: str
    num_envs: int
    threads: int
    peer: str | None = None
    rates: list[float] = field(default_factory=list)
    row_rates: list[float] = field(default_factory=list)
    peak_mb: float = 0.0


class CaseFailedError(Exception):
    """An environment ended instead of answering."""


class CaseProcess:
    """The process of a case."""

    def __init__(self, case: Case, python: str | Path) -> None:
        self.case = case
        command = [python, CASE_PROGRAM, case.name, str(case.num_envs), str(case.threads)]
        self._process = subprocess.Popen(
            [str(part) for part in command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def answer(self) -> dict[str, Any]:
        """What it says next.

        Raises:
            CaseFailedError: Nothing; with the end of what it wrote.
        """
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            _, errors = self._process.communicate()
            last = errors.strip().splitlines()[-1:] or ["no message"]
            raise CaseFailedError(f"{self.case.name} x {self.case.num_envs}: {last[0]}")
        return json.loads(line)

    def play(self, seconds: float, clock: str) -> None:
        """Let it step for some seconds, and note how fast it was."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{seconds}\n")
        self._process.stdin.flush()
        answer = self.answer()
        self.case.rates.append(answer["agent_steps"] / answer[f"{clock}_s"])
        self.case.row_rates.append(answer["rows"] / answer[f"{clock}_s"])
        self.case.peak_mb = answer["peak_mb"]

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()


def cases_of(
    envs: list[int],
    threads: list[int],
    peers: list[str],
    *,
    drawn: bool = False,
    against: bool = False,
) -> list[Case]:
    """What is measured: dictionaries on one thread, the vector environments on each number.

    Args:
        envs: Numbers of environments.
        threads: Numbers of threads.
        peers: Libraries.
        drawn: Those of `DRAWN` too.
        against: Each of ours a second time, for another interpreter.
    """
    cases = [Case("village-dict", 1, 1)]
    if "mpe2" in peers:
        cases.append(Case("mpe2-dict", 1, 1, "mpe2"))
    if SYNC_ENVS in envs:
        cases.append(Case("village-sync", SYNC_ENVS, 1))
    for n_threads in threads:
        for num_envs in envs:
            cases.append(Case("village", num_envs, n_threads))
            cases += [
                Case(peer, num_envs, n_threads, peer) for peer in peers if peer in VECTOR_PEERS
            ]
        if drawn:
            cases += [Case(name, DRAWN_ENVS, n_threads) for name in DRAWN]
    if against:
        ours = [case for case in cases if case.peer is None]
        cases += [Case(case.name, case.num_envs, case.threads, AGAINST) for case in ours]
    return cases


def python_of(peer: str | None, cache: Path) -> Path:
    """The interpreter with a peer's library, which is installed if it is not there yet.

    Raises:
        CaseFailedError: pip could not install it.
    """
    if peer is None:
        return Path(sys.executable)
    folder = cache / "-".join(PEERS[peer]).replace("==", "-")
    python = folder / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    installed = folder / "installed"
    if not installed.exists():
        console.print(f"installing {', '.join(PEERS[peer])} into {folder}")
        venv.create(folder, with_pip=True, clear=True)
        done = subprocess.run(
            [str(python), "-m", "pip", "install", "-q", *PEERS[peer]],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        if done.returncode:
            last = done.stderr.strip().splitlines()[-1:] or ["no message"]
            raise CaseFailedError(f"{peer} could not be installed: {last[0]}")
        installed.touch()
    return python


def _group(case: Case) -> tuple[str, int, int]:
    """Cases of missions that are drawn are compared by themselves, the others by their numbers."""
    return case.name if case.name in DRAWN else "", case.num_envs, case.threads


def measure(
    cases: list[Case],
    turns: int,
    seconds: float,
    cache: Path,
    clock: str,
    against: str | None = None,
) -> list[tuple[Case, str]]:
    """Let all cases take turns; what they did is in them.

    A group of cases that are compared (`_group`) takes its turns together: not more processes are
    kept in memory than that.

    Args:
        cases: These.
        turns: Of each.
        seconds: Length of a turn.
        cache: Folder of the virtual environments of peers.
        clock: "wall" or "cpu".
        against: The other interpreter.

    Returns:
        The cases that failed, and why.
    """
    failed: list[tuple[Case, str]] = []
    for group in dict.fromkeys(map(_group, cases)):
        processes: list[CaseProcess] = []
        for case in cases:
            if _group(case) != group:
                continue
            try:
                other = against if case.peer == AGAINST else None
                process = CaseProcess(case, other or python_of(case.peer, cache))
                processes.append(process)
                process.answer()
                # the first turn is not kept: it finds how many steps a turn has
                process.play(seconds / 2, clock)
                case.rates.clear()
                case.row_rates.clear()
            except CaseFailedError as error:
                failed.append((case, str(error)))
        lost = [case for case, _ in failed]
        alive = [process for process in processes if process.case not in lost]
        for turn in range(turns):
            # the other way round in every second turn: none always follows the same one
            for process in alive[:: 1 if turn % 2 == 0 else -1]:
                process.play(seconds, clock)
        for process in processes:
            process.close()
    return failed


def _spread(values: list[float], shown: str) -> str:
    middle = format(statistics.median(values), shown)
    return f"{middle} [{format(min(values), shown)} .. {format(max(values), shown)}]"


def _thousands(rates: list[float]) -> str:
    return _spread([rate / 1e3 for rate in rates], ",.0f")


def ratios(case: Case, cases: list[Case], counted: str = "rates") -> dict[str, list[float]]:
    """How many times as fast as each peer of its group one of ours is, turn by turn.

    Args:
        case: Ours.
        cases: All.
        counted: "rates" or "row_rates".
    """
    if case.peer is not None:
        return {}
    return {
        other.peer: [
            ours / theirs
            for ours, theirs in zip(getattr(case, counted), getattr(other, counted), strict=True)
        ]
        for other in cases
        if other.peer is not None
        and other.rates
        and case.name.endswith("-dict") == other.name.endswith("-dict")
        and (other.name == case.name or other.peer != AGAINST)
        and _group(other) == _group(case)
    }


def _beside(case: Case, cases: list[Case], counted: str) -> str:
    lines = ratios(case, cases, counted).items()
    return "\n".join(f"{peer}: {_spread(values, '.2f')}" for peer, values in lines)


def table_of(cases: list[Case]) -> Table:
    """One row for each case."""
    table = Table("environment", "envs", "threads", "1000 agent-steps/s", "1000 rows/s")
    table.add_column("times a peer: agent-steps")
    table.add_column("rows")
    table.add_column("peak MB")
    for case in cases:
        if not case.rates:
            continue
        table.add_row(
            f"{case.name} ({AGAINST})" if case.peer == AGAINST else case.name,
            str(case.num_envs), str(case.threads),
            _thousands(case.rates), _thousands(case.row_rates),
            *(_beside(case, cases, counted) for counted in ("rates", "row_rates")),
            f"{case.peak_mb:.0f}",
        )  # fmt: skip
    return table


def main(
    envs: Annotated[str, typer.Option(help="Numbers of environments.")] = "1,64,1024,16384",
    threads: Annotated[str, typer.Option(help="Numbers of threads.")] = "1",
    peers: Annotated[str, typer.Option(help="none, all, or some of mpe2,vmas,jaxmarl.")] = "none",
    turns: Annotated[int, typer.Option(min=1, help="Turns of each case.")] = 5,
    seconds: Annotated[float, typer.Option(min=0.01, help="Length of a turn [s].")] = 1.0,
    clock: Annotated[
        str, typer.Option(help="wall, or cpu: a process's own time, for one thread when busy.")
    ] = "wall",
    cache: Annotated[
        Path, typer.Option(help="Folder for the virtual environments of peers.")
    ] = DEFAULT_CACHE,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Also write what was measured.")
    ] = None,
    against: Annotated[
        str | None, typer.Option(help="Ours also with this Python, which has another version.")
    ] = None,
    drawn: Annotated[
        bool, typer.Option("--drawn", help=f"Missions that are drawn too, {DRAWN_ENVS} at once.")
    ] = False,
    profile: Annotated[
        bool, typer.Option("--profile", help="Only show where the time of our step goes.")
    ] = False,
) -> None:
    """Measure our environments, and peers beside them."""
    if profile:
        # only here: it compiles what it measures
        from throughput_profile import profile_table

        n_lanes = int(envs) if envs.isdecimal() else PROFILED
        console.print(profile_table(turns * STEPS_A_TURN, n_lanes))
        return
    chosen = {"none": [], "all": list(PEERS)}.get(peers, peers.split(","))
    unknown = [peer for peer in chosen if peer not in PEERS]
    if against is not None and shutil.which(against) is None:
        console.print(f"there is no program {against!r}; give the Python of an environment")
        raise typer.Exit(2)
    if unknown or clock not in ("wall", "cpu"):
        wrong = f"peer {unknown[0]!r}" if unknown else f"clock {clock!r}"
        console.print(
            f"there is no {wrong}; peers: none, all, {', '.join(PEERS)}; clock: wall, cpu"
        )
        raise typer.Exit(2)
    n_envs, n_threads = ([int(part) for part in text.split(",")] for text in (envs, threads))
    cases = cases_of(n_envs, n_threads, chosen, drawn=drawn, against=against is not None)
    failed = measure(cases, turns, seconds, cache, clock, against)
    console.print(table_of(cases))
    for _, why in failed:
        console.print(f"failed: {why}", markup=False)
    if json_file is not None:
        rows = [
            {
                **asdict(case),
                "clock": clock,
                "ratios": ratios(case, cases),
                "row_ratios": ratios(case, cases, "row_rates"),
            }
            for case in cases
            if case.rates
        ]
        json_file.write_text(json.dumps(rows, indent=1) + "\n")
    raise typer.Exit(1 if failed else 0)


if __name__ == "__main__":
    typer.run(main)

"""What a person sees while a flight is computed: a line that changes, or lines now and then."""

import itertools
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress

from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as ProgressBar
from rich.spinner import Spinner

from uas_coverage_env.cli.ascii_map import AsciiMap
from uas_coverage_env.cli.compilation import compilation_shown
from uas_coverage_env.cli.watch import FlightWindow
from uas_coverage_env.draw.window import NoDisplayError
from uas_coverage_env.entities.state import LANDED, LOST
from uas_coverage_env.files.digits import three_digits
from uas_coverage_env.flight import Planner, Progress
from uas_coverage_env.replay.live import LivePage
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle.layout import DOD

_SECONDS_BETWEEN_LINES = 5.0
_NO_CHARGE = {LANDED: "landed", LOST: "lost"}


@contextmanager
def shown(
    out: Console,
    scenario: Scenario,
    *,
    watch: Planner | None = None,
    live: bool = False,
    after: ExitStack | None = None,
) -> Iterator[Callable[[Progress], object]]:
    """Show how a flight goes: gives the function that `rollout` calls in every step.

    Args:
        out: Where to write.
        scenario: The scenario flown.
        watch: The planner, if the flight is to be watched: in a window, or as an ASCII map where
            there is no display.
        live: Serve the replay page of the flight while it is flown.
        after: On a terminal, the window stays open until this ends and a person closes it.
    """
    window = None if watch is None else _window(out, scenario, watch)
    ascii_map = None
    if watch is not None and window is None:
        ascii_map = AsciiMap(scenario, *out.size)
    server = _LiveView(out) if live else None
    flown = False
    try:
        with _lines(out, ascii_map) as write:

            def update(progress: Progress) -> None:
                with _lost_alone():
                    write(progress)
                if window is not None:
                    window(progress)
                if server is not None:
                    server(progress)

            yield update
        flown = True
    finally:
        if server is not None:
            server.close()
        if window is not None and flown and after is not None and out.is_terminal:
            after.callback(window.close)
            after.callback(window.stay)
        elif window is not None:
            window.close()


def _lost_alone() -> AbstractContextManager[object]:
    """What goes to a terminal or a pipe that is gone by now is lost, and not the flight as well."""
    return suppress(OSError, SystemExit)  # with the latter rich answers a broken pipe


def _window(out: Console, scenario: Scenario, planner: Planner) -> FlightWindow | None:
    try:
        return FlightWindow(scenario, planner)
    except (ImportError, NoDisplayError) as error:
        instead = "a map of letters" if out.is_terminal else "lines"
        out.print(f"{error}; {instead} instead", markup=False)
        return None


@contextmanager
def _lines(out: Console, ascii_map: AsciiMap | None) -> Iterator[Callable[[Progress], object]]:
    if out.quiet or not out.is_terminal:
        yield _PlainLines(out)
        return
    live = Live(console=out, refresh_per_second=8)
    with ExitStack() as ending:
        compiling = ending.enter_context(ExitStack())
        compiling.enter_context(compilation_shown())

        @ending.callback
        def stop() -> None:
            with _lost_alone():
                live.stop()

        def update(progress: Progress) -> None:
            if not live.is_started:  # all is compiled
                compiling.close()
                live.start()
            line = Spinner("dots", progress_line(progress))
            if ascii_map is None:
                live.update(line)
                return
            if ascii_map.scenario is not progress.scenario:  # an event has changed it
                ascii_map.change(progress.scenario)
            live.update(Group(ascii_map.drawn(progress.swarm), line))

        yield update


def progress_line(progress: Progress) -> str:
    """Step, coverage, charge of each UAS and time of the last decision in one line."""
    swarm = progress.swarm
    charges = [
        f"{name} {_NO_CHARGE.get(int(status), f'{1 - dod:.0%}')}"
        for name, status, dod in zip(swarm.names, swarm.status, swarm.x[:, DOD], strict=True)
    ]
    decision_s = progress.decision_time_s
    return "  ".join(
        [
            f"step {swarm.step}/{progress.max_steps}",
            f"covered {progress.covered}/{len(swarm.uncovered)}",
            *charges,
            *([] if decision_s is None else [f"decision {three_digits(1e3 * decision_s)} ms"]),
        ]
    )


class _LiveView:
    """Serves the flight from before the first decision until it ends, and says where.

    Args:
        out: Where to write.
    """

    def __init__(self, out: Console) -> None:
        self._out = out
        self._page: LivePage | None = None
        self._last: Progress | None = None

    def __call__(self, progress: Progress) -> None:
        """Show where the flight stands, if somebody looks."""
        self._last = progress
        if self._page is None:
            self._page = LivePage(progress.flown())
            self._out.print(f"live at {self._page.address}", markup=False)
        elif self._page.due:
            self._page.update(progress.flown())

    def close(self) -> None:
        """Show the rest of the flight to whoever looks, and end the server."""
        if self._page is not None and self._last is not None:
            self._page.close(self._last.flown())


class _PlainLines:
    """One line every few seconds, for logs."""

    def __init__(self, out: Console) -> None:
        self._out = out
        self._next = time.monotonic() + _SECONDS_BETWEEN_LINES

    def __call__(self, progress: Progress) -> None:
        if progress.decision_time_s is None or self.due():
            self._out.print(progress_line(progress), markup=False)

    def due(self) -> bool:
        """Whether it is time for another line."""
        now = time.monotonic()
        if now < self._next:
            return False
        self._next = now + _SECONDS_BETWEEN_LINES
        return True


@contextmanager
def missions_shown(screen: Console, total: int, kept: int) -> Iterator[Callable[[str], object]]:
    """Show how far many missions are: gives the function to call with the name of each.

    Args:
        screen: Where.
        total: Missions.
        kept: Those that were flown before.
    """
    if not screen.is_terminal:
        screen.print(f"{kept} of {total} flights are there" if kept else f"{total} flights to fly")
        lines, began, done = _PlainLines(screen), time.monotonic(), itertools.count(kept + 1)

        def line(name: str) -> None:
            flown = next(done)
            if lines.due():
                each_s = (time.monotonic() - began) / (flown - kept)
                left_min = each_s * (total - flown) / 60.0
                screen.print(f"{flown} of {total} flights, {left_min:.1f} min left")

        yield line
        return
    columns = (
        *(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()),
        TimeRemainingColumn(),
    )
    # long flights and short ones take turns: only a long look back tells the speed
    with ProgressBar(*columns, console=screen, speed_estimate_period=3600.0) as bar:
        task = bar.add_task("flying", total=total, completed=kept)
        yield lambda name: bar.update(task, description=name, advance=1)

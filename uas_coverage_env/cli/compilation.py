"""Compilation as it shows at a terminal."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from uas_coverage_env.compiled.progress import listening
from uas_coverage_env.compiled.purpose import compiling_for, purpose
from uas_coverage_env.flight import Planner, rollout
from uas_coverage_env.flight.registry import name_of
from uas_coverage_env.scenario import Scenario


@contextmanager
def compilation_shown(screen: Console | None = None) -> Iterator[None]:
    """Show compilations as a bar; where there is no terminal, as one line.

    Args:
        screen: Where; None: on stderr.
    """
    screen = screen or Console(stderr=True, highlight=False)
    if not screen.is_terminal:
        yield
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
    bar = Progress(*columns, TimeElapsedColumn(), console=screen, transient=True)
    task = bar.add_task("", total=1.0)

    def listener(share: float | None) -> None:
        if share is None:
            bar.stop()
            return
        if not bar.live.is_started:
            bar.start()
        bar.update(task, completed=share, description=f"compiling for {purpose()}")

    try:
        with listening(listener):
            yield
    finally:
        bar.stop()


@contextmanager
def compiling_for_flight(planner: Planner, *, quiet: bool = False) -> Iterator[None]:
    """Say that what is compiled, for the flight or for its map, is for a planner's flight.

    Args:
        planner: It flies.
        quiet: Say nothing.
    """
    with (
        compiling_for(f"planner {name_of(planner)}"),
        listening(lambda share: None) if quiet else nullcontext(),
    ):
        yield


def compile_flight(scenario: Scenario, *, return_mode: bool, safety_filter: bool) -> None:
    """Compile what every flight and its record need, or see that it is there."""
    rollout(scenario, "hover", max_steps=1, return_mode=return_mode, safety_filter=safety_filter)

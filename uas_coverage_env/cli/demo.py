"""`uas-coverage demo`: a recorded flight to look at while a first one is flown."""

import os
import sys
import webbrowser
from pathlib import Path
from typing import Annotated, Any

import typer

from uas_coverage_env.cli.compilation import compiling_for_flight
from uas_coverage_env.cli.flights import keep_flight, report_flight
from uas_coverage_env.cli.options import ReplaceFlightOption
from uas_coverage_env.cli.output import console, loaded
from uas_coverage_env.cli.progress import shown
from uas_coverage_env.cli.run import free_directory
from uas_coverage_env.flight import load_planner, rollout
from uas_coverage_env.flight.directory import check_directory
from uas_coverage_env.replay import write_replay
from uas_coverage_env.replay.recorded import write_recorded_page

_SCENARIO, _PLANNER = "corridor", "nearest-waypoint"
_LITTLE: dict[str, Any] = {"return_mode": False, "safety_filter": False, "reward": ()}
"""What the mission does without: a third of what else would be compiled."""
_SCREENS = ("DISPLAY", "WAYLAND_DISPLAY")


def demo(
    out: Annotated[
        Path | None, typer.Option(help="Flight directory; default: flights/demo, numbered.")
    ] = None,
    overwrite: ReplaceFlightOption = False,
    no_open: Annotated[
        bool, typer.Option("--no-open", help="Do not open the page in a browser.")
    ] = False,
) -> None:
    """Show a recorded flight, fly a first one, and open the page of each in a browser.

    The first page is there at once, the other one after half a minute on a fresh installation,
    which compiles first; seconds from then on.
    """
    screen = console()
    directory = out or free_directory("demo")
    check_directory(directory, overwrite=overwrite)
    page = directory / "recorded.html"
    planner_then, scenario_then = write_recorded_page(page)
    screen.print(f"recorded flight of {planner_then} in the {scenario_then}:", markup=False)
    _show(page, no_open)
    screen.print(
        f"now {_PLANNER} flies the {_SCENARIO} here, without return mode and safety filter",
        markup=False,
    )
    mission = loaded(_SCENARIO)
    planner = load_planner(_PLANNER)
    with compiling_for_flight(planner):
        with shown(screen, mission) as on_step:
            flight = rollout(mission, planner, 0, **_LITTLE, on_step=on_step)
        keep_flight(flight, directory, overwrite=True)
        page = write_replay([flight], directory / "replay.html", sources=[str(directory)])
    report_flight(screen, flight, directory)
    _show(page, no_open)


def _show(page: Path, no_open: bool) -> None:
    opened = not no_open and _open(page)
    console().print(f"{'opened' if opened else 'to look at it, open'} {page}", markup=False)


def _open(page: Path) -> bool:
    """Show a page in a browser that has a screen; one for the terminal would take it over."""
    if sys.platform == "linux" and not any(os.environ.get(name) for name in _SCREENS):
        return False
    try:
        return webbrowser.open(page.resolve().as_uri())
    except webbrowser.Error:
        return False

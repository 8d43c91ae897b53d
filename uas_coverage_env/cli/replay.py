"""`uas-coverage replay`: a page, a video or a GIF of a flight."""

from pathlib import Path
from typing import Annotated

import typer

from uas_coverage_env.cli.options import FlightDirectory, SecondFlight, check_file
from uas_coverage_env.cli.output import console
from uas_coverage_env.flight import Flight
from uas_coverage_env.replay import write_gif, write_replay, write_video


def replay(
    directory: FlightDirectory,
    other: SecondFlight = None,
    video: Annotated[
        Path | None, typer.Option(metavar="FILE.mp4", help="Write a video too (extra `view`).")
    ] = None,
    gif: Annotated[Path | None, typer.Option(metavar="FILE.gif", help="Write a GIF too.")] = None,
    fps: Annotated[
        int, typer.Option(min=1, max=50, help="Pictures per second; one picture per step.")
    ] = 10,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an existing film.")
    ] = False,
) -> None:
    """Write DIR/replay.html, a page that opens from disk and needs no network.

    It is written anew each time. With two flights, both are played side by side, in a page of its
    own, DIR/replay_with_DIR2.html.
    """
    for path, suffix in ((video, ".mp4"), (gif, ".gif")):
        if path is not None:
            check_file(path, (suffix,), overwrite=overwrite)
    sources = [str(path) for path in (directory, other) if path is not None]
    flights = [Flight.load(source) for source in sources]
    out = console()
    for path, write in ((video, write_video), (gif, write_gif)):
        if path is not None:
            write(flights, path, fps=fps)
            out.print(f"film in {path} ({path.stat().st_size / 1e3:.0f} kB)", markup=False)
    page = directory / (f"replay_with_{other.resolve().name}.html" if other else "replay.html")
    write_replay(flights, page, sources=sources)
    out.print(f"page in {page} ({page.stat().st_size / 1e3:.0f} kB)", markup=False)

"""`uas-coverage figure`: a figure of a flight for print."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from uas_coverage_env.cli.output import console
from uas_coverage_env.cli.replay import check_file
from uas_coverage_env.flight import Flight
from uas_coverage_env.strict_toml import InputError

_SUFFIXES = (".pdf", ".svg", ".png")


def figure(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Flight directory.")],
    kind: Annotated[
        Literal["map", "battery", "modes", "decision-time"],
        typer.Option(help="What is drawn; map and battery are the paper's Fig. 1 to 3."),
    ],
    step: Annotated[
        int | None, typer.Option(min=0, help="The sample that the map shows; default: the last.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="A .pdf, .svg or .png; default: DIR/KIND.pdf.")
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the file that --out names.")
    ] = False,
) -> None:
    """Draw a figure as a vector file (needs the extra `view`).

    DIR/KIND.pdf is drawn anew each time; a file that --out names is replaced only on request.
    """
    path = out or directory / f"{kind}.pdf"
    check_file(path, _SUFFIXES, overwrite=overwrite or out is None)
    if step is not None and kind != "map":
        raise InputError(f"--step is for --kind map; a figure of kind {kind} shows all steps")
    try:
        from uas_coverage_env.replay.figures import KINDS, map_figure, save_figure
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "matplotlib":
            raise
        raise InputError(
            'a figure needs matplotlib: pip install "uas-coverage-env[view]"'
        ) from error
    flight = Flight.load(directory)
    drawn = KINDS[kind](flight) if step is None else map_figure(flight, step=step)
    save_figure(drawn, path)
    console().print(f"figure in {path}", markup=False)

"""`uas-coverage figure`: a figure of a flight, of a comparison or of trainings, for print."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from uas_coverage_env.cli.options import ReplaceFileOption, check_file
from uas_coverage_env.cli.output import console, extra
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.files.suggestions import check_choice
from uas_coverage_env.flight import Flight
from uas_coverage_env.leaderboard import leaderboard_figure, read_comparison, scores_of
from uas_coverage_env.leaderboard.publish import SCORES
from uas_coverage_env.replay.figure_kinds import KINDS, figure_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SUFFIXES = (".pdf", ".svg", ".png")
_MM_PER_IN = 25.4
_LEADERBOARD, _TRAINING = "leaderboard", "training"
_FLIGHT_KINDS = ", ".join(KINDS)


Step = Annotated[
    int | None, typer.Option(min=0, help="The sample that the map shows; default: the last.")
]


def figure(
    directories: Annotated[
        list[Path],
        typer.Argument(
            metavar="DIR...",
            help="A flight directory; for `leaderboard` the --out of `compare`; for `training` "
            "that of `train`, or several of them.",
        ),
    ],
    kind: Annotated[
        str,
        typer.Option(
            metavar="KIND",
            help=f"{_FLIGHT_KINDS}, {_LEADERBOARD} or {_TRAINING}; map and battery are the paper's "
            "Fig. 1 to 3.",
        ),
    ],
    step: Step = None,
    width: Annotated[
        float | None,
        typer.Option(
            metavar="MM", min=40.0, max=1000.0, help="Width in millimetres; default: 160."
        ),
    ] = None,
    style: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="A style of matplotlib, or an .mplstyle file, that wins over ours.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="A .pdf, .svg or .png; default: DIR/KIND.pdf.")
    ] = None,
    overwrite: ReplaceFileOption = False,
) -> None:
    """Draw a figure as a vector file (needs the extra `view`).

    DIR/KIND.pdf is drawn anew each time; a file that --out names is replaced only on request.
    """
    check_choice("--kind", kind, (*KINDS, _LEADERBOARD, _TRAINING))
    for directory in directories:
        if not directory.is_dir():
            raise InputError(f"{directory}: there is no such directory")
    path = out or directories[0] / f"{kind}.pdf"
    check_file(path, _SUFFIXES, overwrite=overwrite or out is None)
    if step is not None and kind != "map":
        raise InputError(f"--step is for --kind map; a figure of kind {kind} shows all steps")
    if len(directories) > 1 and kind != _TRAINING:
        raise InputError(f"--kind {kind} shows one directory; {len(directories)} were given")
    with extra("view", "a figure needs", ["matplotlib"]):
        from uas_coverage_env.replay.figures import save_figure
        from uas_coverage_env.replay.figures.style import WIDTH_IN, look
        from uas_coverage_env.replay.figures.training import CURVE
    for directory in directories:
        _check_sort(directory, kind, CURVE)
    width_in = WIDTH_IN if width is None else width / _MM_PER_IN
    with look(width_in, style):
        save_figure(_drawn(directories, kind, step), path)
    console().print(f"figure in {path}", markup=False)


def _drawn(directories: list[Path], kind: str, step: int | None) -> "Figure":
    from uas_coverage_env.replay.figures import map_figure, training_figure
    from uas_coverage_env.replay.figures.training import with_baselines

    if kind == _LEADERBOARD:
        rows, reference = read_comparison(directories[0])
        return leaderboard_figure(scores_of(rows, reference), rows, reference)
    if kind == _TRAINING:
        return training_figure(with_baselines(_named(directories)))
    if step is not None:
        return map_figure(Flight.load(directories[0]), step=step)
    return figure_of(kind)(Flight.load(directories[0]))


def _check_sort(directory: Path, kind: str, curve: str) -> None:
    """Whether a directory is of the sort that the kind draws, as far as its files tell."""
    sorts = {SCORES: "a comparison", curve: "a training", "flight.csv": "a flight"}
    kinds = {SCORES: _LEADERBOARD, curve: _TRAINING, "flight.csv": _FLIGHT_KINDS}
    wanted = {_LEADERBOARD: SCORES, _TRAINING: curve}.get(kind, "flight.csv")
    if (directory / wanted).is_file():
        return
    for file, sort in sorts.items():
        if (directory / file).is_file():
            raise InputError(
                f"{directory}: is the directory of {sort}, of which there is no figure {kind}; "
                f"draw {kinds[file]}"
            )
    raise InputError(f"{directory}: is no directory of {sorts[wanted]}: it has no {wanted}")


def _named(directories: list[Path]) -> dict[str, Path]:
    """What a training is called in the legend: its directory; nothing where it is alone."""
    if len(directories) == 1:
        return {"": directories[0]}
    names = [directory.resolve().name for directory in directories]
    if len(set(names)) < len(names):
        names = [str(directory) for directory in directories]
    if len(set(names)) < len(names):
        raise InputError("a directory is given twice; give each once")
    return dict(zip(names, directories, strict=True))

"""Figures for print, drawn with matplotlib (extra `view`): of a flight, and of trainings.

A new figure of a flight is one file with a function `flight -> Figure`, and one line in
`figure_kinds.KINDS`.
"""

from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure

from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.replay.figures.battery import battery_figure, published_battery
from uas_coverage_env.replay.figures.decision_time import decision_time_figure
from uas_coverage_env.replay.figures.map import map_figure
from uas_coverage_env.replay.figures.modes import modes_figure
from uas_coverage_env.replay.figures.style import printed
from uas_coverage_env.replay.figures.training import training_figure

__all__ = [
    "battery_figure",
    "decision_time_figure",
    "map_figure",
    "modes_figure",
    "published_battery",
    "save_figure",
    "training_figure",
]


def save_figure(figure: Figure, path: Path) -> Path:
    """Write a figure as .pdf, .svg or .png; the same figure always gives the same file.

    Raises:
        InputError: The file cannot be written.
    """
    suffix, content = path.suffix.lower(), BytesIO()
    dates = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}, ".png": {}}
    with printed():
        figure.savefig(content, format=suffix[1:], metadata=dates[suffix])
    try:
        write_atomically(path, content.getvalue())
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from error
    return path


def png_of(figure: Figure) -> bytes:
    """A figure as the content of a PNG."""
    content = BytesIO()
    with printed():
        figure.savefig(content, format="png")
    return content.getvalue()

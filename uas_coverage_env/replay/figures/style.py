"""The look that all figures share."""

from contextlib import AbstractContextManager
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from uas_coverage_env.draw import colours

WIDTH_IN = 6.3
"""Text width of an A4 page."""

LINE_STYLES = ("-", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 2, 1.5, 2)))

_RC: dict[Any, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.5,
    "axes.axisbelow": True,
    "lines.linewidth": 1.1,
    "legend.frameon": False,
    "legend.fontsize": 8,
    # fonts that can be searched, and copied, in a PDF; ids that do not change in an SVG
    "pdf.fonttype": 42,
    "svg.hashsalt": "uas-coverage-env",
    "savefig.dpi": 200,
}


def printed() -> AbstractContextManager[None]:
    """Figures are made and saved within this context; what a person has set stays as it was."""
    return mpl.rc_context({**mpl.rcParamsDefault, **_RC})


def rows(height_in: float, heights: list[float]) -> tuple[Figure, list[Axes]]:
    """A figure of text width with one column of axes that share their time.

    Args:
        height_in: Height of the figure [in].
        heights: Relative heights of the axes, from above.
    """
    figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
    grid = figure.subplots(
        len(heights), 1, sharex=True, squeeze=False, gridspec_kw={"height_ratios": heights}
    )
    return figure, list(grid[:, 0])


def shade(colour: colours.Colour) -> tuple[float, float, float]:
    """A colour of the draw room as matplotlib counts it."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255


def uas_colour(i: int) -> tuple[float, float, float]:
    """The colour of the UAS at place `i` of the fleet."""
    return shade(colours.UAS[i % len(colours.UAS)])


def line_style(i: int):
    """The dashes of the UAS at place `i`: lines are told apart without colour too."""
    return LINE_STYLES[i % len(LINE_STYLES)]

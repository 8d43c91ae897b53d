"""The look that all figures share."""

import re
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib import style as styles
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from uas_coverage_env.draw import colours
from uas_coverage_env.files.plain_files import read_text
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.files.suggestions import did_you_mean

WIDTH_IN = 6.3
"""Text width of an A4 page; of figures for which no other is asked."""

MANY = 8
"""Of more UAS, figures show spans and counts, and names are short."""

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


_MOST_BYTES = 1_000_000
_COMMENT = re.compile(r'("[^"]*")|#.*')

_width_in: ContextVar[float] = ContextVar("width_in", default=WIDTH_IN)
_style: ContextVar[dict[Any, Any]] = ContextVar("style")


@contextmanager
def look(width_in: float = WIDTH_IN, style: str | None = None) -> Iterator[None]:
    """Figures made within this context are of a width and a style.

    Args:
        width_in: Their width [in].
        style: The name of a style of matplotlib, or the path of an `.mplstyle` file; it wins over
            ours. None: ours.

    Raises:
        InputError: There is no such style, or it cannot be read.
    """
    tokens = _width_in.set(width_in), _style.set({} if style is None else _settings(style))
    try:
        yield
    finally:
        _width_in.reset(tokens[0])
        _style.reset(tokens[1])


def width_in() -> float:
    """The width of figures now [in]."""
    return _width_in.get()


def columns_of(words: int, most: int) -> int:
    """How many columns of a legend fit, where one of so many letters is the longest entry."""
    return max(1, min(most, int(width_in() / (0.35 + 0.062 * words))))


def _settings(style: str) -> dict[Any, Any]:
    if style in styles.library:
        return dict(styles.library[style])
    path = Path(style)
    if path.suffix != ".mplstyle":
        known = ", ".join(name for name in styles.available if not name.startswith("_"))
        close = did_you_mean(style, styles.available, f"take the path of an .mplstyle or {known}")
        raise InputError(f"unknown style {style[:80]!r}; {close}")
    try:
        text = read_text(path, _MOST_BYTES)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is no style of matplotlib; save it as text in UTF-8") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    read: Any = mpl.RcParams()
    for number, line in enumerate(text.splitlines(), 1):
        _set(read, _COMMENT.sub(r"\1", line).strip(), f"{path}, line {number}")
    return dict(read)


def _set(read: Any, line: str, where: str) -> None:
    """Take over a line of a style: matplotlib itself only logs what it does not know."""
    if not line:
        return
    key, colon, value = (part.strip() for part in line.partition(":"))
    if not colon:
        raise InputError(f"{where}: {key[:60]!r} has no colon; write KEY: VALUE")
    if key not in mpl.rcParamsDefault:
        close = did_you_mean(key, mpl.rcParamsDefault, "take one of matplotlib.rcParams")
        raise InputError(f"{where}: unknown key {key[:60]!r}; {close}")
    try:
        read[key] = value.strip('"')
    except ValueError as error:
        reason = " ".join(str(error).removeprefix(f"Key {key}: ").split())
        raise InputError(f"{where}, {key}: {reason[:160]}; correct the value") from error


def printed() -> AbstractContextManager[None]:
    """Figures are made and saved within this context; what a person has set stays as it was."""
    style = _style.get({})
    # the grids of a style that does not draw them itself are not meant to be behind curves
    grids: dict[Any, Any] = {"axes.grid": False} if "grid.color" in style else {}
    return mpl.rc_context({**mpl.rcParamsDefault, **_RC, **grids, **style})


def rows(height_in: float, heights: list[float]) -> tuple[Figure, list[Axes]]:
    """A figure with one column of axes that share their time.

    Args:
        height_in: Height of the figure [in].
        heights: Relative heights of the axes, from above.
    """
    figure = Figure(figsize=(width_in(), height_in), layout="constrained")
    grid = figure.subplots(
        len(heights), 1, sharex=True, squeeze=False, gridspec_kw={"height_ratios": heights}
    )
    return figure, list(grid[:, 0])


def shade(colour: colours.Colour) -> tuple[float, float, float]:
    """A colour of the draw package as matplotlib counts it."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255


def uas_colour(i: int) -> tuple[float, float, float]:
    """The colour of the UAS at place `i` of the fleet."""
    return shade(colours.of_uas(i))


def words_colour(i: int) -> tuple[float, float, float]:
    """The colour of words about that UAS."""
    return shade(colours.of_words(colours.of_uas(i)))


def line_style(i: int):
    """The dashes of the UAS at place `i`: lines are told apart without colour too."""
    return LINE_STYLES[i % len(LINE_STYLES)]

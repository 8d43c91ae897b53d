"""Writing on a picture, word by word. Rendered words are kept: the same come back again."""

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from uas_coverage_env.draw import colours
from uas_coverage_env.draw.colours import Colour
from uas_coverage_env.draw.frame import SMOOTHING

if TYPE_CHECKING:
    from PIL.Image import Image

# Share of the font size from the baseline up to the middle of a digit.
_MIDDLE = 0.36
_SMALLEST_PX = 6


def write(
    image: "Image",
    place: tuple[float, float],
    words: str,
    size: float,
    colour: Colour,
    *,
    align: float = 0.0,
    halo: float = 0.0,
) -> None:
    """Write one line, vertically centred on a place; what would be too small to read is left out.

    Args:
        image: Where to write.
        place: On the canvas.
        words: What to write.
        size: Of the font, in canvas pixels.
        colour: Of the words.
        align: Share of the line that lies left of the place: 0 starts, 0.5 centres, 1 ends there.
        halo: Width of a white edge that keeps words readable on any ground, in canvas pixels.
    """
    if size < _SMALLEST_PX * SMOOTHING:
        return
    if halo:
        _paste(image, place, words, size, colours.WHITE, align, round(halo))
    _paste(image, place, words, size, colour, align, 0)


@lru_cache(maxsize=1024)
def width_of(words: str, size: float) -> float:
    """How wide a line is, in canvas pixels."""
    return _font(round(size)).getlength(words)


@lru_cache(maxsize=256)
def fitted(words: str, size: float, room: float) -> str:
    """A line that is no wider than there is room for: the words, or their beginning."""
    shorter = words
    while width_of(shorter, size) > room and words:
        words = words[:-1]
        shorter = words.rstrip() + "..."
    return shorter if words else ""


def _paste(
    image: "Image",
    place: tuple[float, float],
    words: str,
    size: float,
    colour: Colour,
    align: float,
    edge: int,
) -> None:
    shapes = [_shape(word, round(size), edge) for word in words.split(" ")]
    space = width_of(" ", size)
    x = place[0] - align * (sum(shape.advance for shape in shapes) + space * (len(shapes) - 1))
    for shape in shapes:
        corner = (round(x) + shape.left, round(place[1] + _MIDDLE * size) + shape.top)
        image.paste(colour, corner, shape.mask)
        x += shape.advance + space


class _Shape(NamedTuple):
    """A word.

    Attributes:
        mask: Its pixels.
        left: Of the mask, from the start of the baseline.
        top: Of the mask, from the baseline.
        advance: How far the next letter would start from there.
    """

    mask: "Image"
    left: int
    top: int
    advance: float


@lru_cache(maxsize=2048)
def _shape(word: str, size: int, edge: int) -> _Shape:
    from PIL import Image, ImageDraw

    font = _font(size)
    left, top, right, bottom = font.getbbox(word, anchor="ls", stroke_width=edge)
    left, top = int(left), int(top)
    mask = Image.new("L", (max(1, int(right) - left), max(1, int(bottom) - top)), 0)
    draw = ImageDraw.Draw(mask)
    draw.text((-left, -top), word, fill=255, font=font, anchor="ls", stroke_width=edge)
    return _Shape(mask, left, top, font.getlength(word))


@lru_cache(maxsize=32)
def _font(size: int):
    from PIL import ImageFont

    return ImageFont.load_default(size)
